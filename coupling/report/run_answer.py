"""First screen of a run: what to expect on the real robot, whether it is good enough, what to do now."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from coupling.path.path_ends import MOVING_END
from coupling.report.expected import expected_sentence, expected_words
from coupling.report.lengths import NOT_KNOWN, in_words, judged, state_tolerance
from coupling.results.cut_result import WILL_CHATTER
from coupling.results.expected_deviation import ExpectedDeviation
from coupling.results.iteration_result import QUASISTATIC_VALIDATION
from coupling.results.outlook import WorstReplay
from coupling.results.replay import Worsening
from coupling.results.run_result import RunResult
from coupling.results.section import Answer, KeyFigure, NextStep

# Gears that are named on the first screen.
_NAMED = 2

# Part of what is allowed that is as good as nothing.
_SMALL = 0.02

# Purposes of steps.
_STABLE = "Find a depth and speed that do not chatter:"
_STIFFER = "Find a place where the robot is stiffer:"

# Ends of an iteration without a result, in words that need no glossary.
_UNFINISHED = {
    "diverged": "Each further step made it worse.",
    "limit cycle": "Further steps went to and fro without coming closer.",
    "stagnated": "Further steps no longer helped.",
    "exhausted": "It takes more steps than the case allows.",
    "process failed": "The process could not be evaluated on the path.",
    "robot failed": "The robot could not be simulated on the path.",
}


@dataclass(frozen=True)
class RunContext:
    """What a first screen needs beside a run's figures.

    Attributes:
        folder, case: Run folder and case file, as commands name them.
        robots: Robot files, as the case names them, by the robots' names.
        tolerance: Deviation that the part allows [m]; None where it is not stated.
    """

    folder: str
    case: str
    robots: Mapping[str, str]
    tolerance: float | None = None


def run_answer(figures: RunResult, context: RunContext) -> Answer:
    """Return the first screen of a run.

    Args:
        figures: Content of result.json.
        context: Names and tolerance of the run.
    """
    if figures.kind == "couple":
        return _coupling_answer(figures, context)
    expected = figures.expected_deviation() if figures.converged else None
    tolerance = context.tolerance
    fits = None if tolerance is None or expected is None else expected.fits(tolerance)
    outlook = None if expected is None else figures.outlook
    worse = None if outlook is None else outlook.worse
    shift = None if outlook is None or fits else _shift_that_does(outlook)
    good = (
        fits
        if figures.converged and worse is None and shift is None and figures.is_stable
        else False
    )
    size, before = _uncorrected(figures.deviation_before_m.maximum, expected)
    after = "on the real robot"
    if shift is not None:
        before += f"; {in_words(shift.uncorrected)} after a shift of the part"
        after += f"; {in_words(shift.deviation)} after such a shift"
    elif figures.converged and (expected is None or not expected.is_whole):
        after += "; its file does not say how exact it is"
    reason = _reason(figures, expected)
    if good and outlook is not None and outlook.shift_alone is not None:
        reason += " Touching the part off, without a correction, leaves less."
    return Answer(
        sentence=_sentence(figures, context, expected, worse or shift),
        reason=reason,
        good=good,
        figures=(
            KeyFigure("Before", size, before),
            KeyFigure(
                "Expected after", NOT_KNOWN if expected is None else expected_words(expected), after
            ),
            KeyFigure(
                "If the file is right",
                in_words(figures.deviation_after_m.maximum),
                "on a robot exactly as its file says",
            ),
        ),
        steps=list(_steps(figures, context, good, shift)),
    )


def _uncorrected(before: float, expected: ExpectedDeviation | None) -> tuple[str, str]:
    """Return the deviation before a correction, and on which robot.

    Where the real robot may leave more under the correction than the file's robot does without, it is
    that of the real robot: both figures are of the same robots.
    """
    size = in_words(before)
    if expected is None or expected.uncorrected is None or expected.maximum <= before:
        return size, "uncorrected, with this robot file"
    return (
        f"about {in_words(expected.uncorrected)}",
        f"uncorrected, on the real robot; {size} with this robot file",
    )


def _shift_that_does(outlook: WorstReplay) -> Worsening | None:
    """Return the robot on which a shift of the part does as well as the command; None for none."""
    worse = outlook.worse
    if worse is None:
        return outlook.shift_alone
    return worse if worse.is_shifted else None


def _sentence(
    figures: RunResult,
    context: RunContext,
    expected: ExpectedDeviation | None,
    worse: Worsening | None,
) -> str:
    before = in_words(figures.deviation_before_m.maximum)
    after = in_words(figures.deviation_after_m.maximum)
    if not figures.is_stable:
        return WILL_CHATTER
    if not figures.converged and _is_enough(figures, context):
        return (
            f"NOT FINISHED: the last command leaves {after} on a robot exactly as its file says,"
            f" uncorrected {before}; the case asks for less than that."
        )
    if _is_validated_quasistatic(figures):
        return (
            f"NOT FINISHED: the last command leaves {after} on the robot without inertia that the case"
            f" asks for, uncorrected {before}; it was computed for the robot that moves."
        )
    if not figures.converged:
        return (
            f"NOT FINISHED: no command was found that keeps the path. The last one leaves {after} even"
            f" on a robot exactly as its file says, uncorrected {before}: do not send it to a robot."
        )
    if expected is None:
        return (
            f"NOT CERTAIN: up to {after} if the robot is exactly as its file says; nothing tells how"
            " exact that is."
        )
    if worse is not None and worse.is_shifted:
        return (
            "TOUCHING OFF ALONE DOES BETTER: with the part shifted to fit, the tool may be off by"
            f" {in_words(worse.uncorrected)} uncorrected and by {in_words(worse.deviation)} under this"
            f" command, by what is not known well of robot and force{_beside(context.tolerance)}."
        )
    if worse is not None:
        return (
            "WORSE THAN NOTHING is possible: what is not known well of robot and force may leave"
            f" {in_words(worse.deviation)}, uncorrected {in_words(worse.uncorrected)} on the same robot"
            f"{_beside(context.tolerance)}: do not send this command to a robot."
        )
    if context.tolerance is None and expected.maximum > figures.deviation_before_m.maximum:
        return (
            f"About {in_words(expected.maximum)} may remain on the real robot until it is identified;"
            f" uncorrected most such robots would be off by more, though the file says {before}. How"
            " much the part allows is not stated."
        )
    if context.tolerance is None:
        share = "about" if expected.is_whole else "at least"
        return (
            f"Of {before} {share} {in_words(expected.maximum)} may remain on the real robot until it is"
            " identified. How much the part allows is not stated."
        )
    return expected_sentence(expected, context.tolerance)


def _beside(tolerance: float | None) -> str:
    """Return a tolerance [m], as the end of a sentence; empty where it is not stated."""
    return "" if tolerance is None else f"; your tolerance is {in_words(tolerance)}"


def _is_enough(figures: RunResult, context: RunContext) -> bool:
    """Return whether an iteration without a result came so near that its tolerance is to be raised."""
    allowed = figures.deviation_before_m.maximum if context.tolerance is None else context.tolerance
    return figures.deviation_after_m.maximum <= _SMALL * allowed


def _is_validated_quasistatic(figures: RunResult) -> bool:
    """Return whether an inverse failed on a robot without inertia, for which it was not computed."""
    return not figures.converged and QUASISTATIC_VALIDATION in figures.reason


def _reason(figures: RunResult, expected: ExpectedDeviation | None) -> str:
    """Return whether the cut is stable, and what makes up the figure that is expected."""
    stability = figures.stability
    if stability is None:
        return _reason_of_size(figures, expected)
    if stability.stable:
        return f"{stability.sentence}. {_reason_of_size(figures, expected)}".strip()
    remedy = f" Stable would be {stability.alternative}." if stability.alternative else ""
    return f"{stability.sentence}.{remedy}"


def _reason_of_size(figures: RunResult, expected: ExpectedDeviation | None) -> str:
    """Return what makes up the figure that is expected."""
    outlook = figures.outlook
    if not figures.converged:
        advice = f" {_capital(MOVING_END)}." if MOVING_END in figures.reason else ""
        return f"{_UNFINISHED.get(figures.outcome, f'{_capital(figures.reason)}.')}{advice}"
    if figures.forecast is not None:
        forecast = figures.forecast
        return (
            f"Measured under the last command: {in_words(forecast.before)} on average; expected next:"
            f" {in_words(forecast.rms)}, {in_words(forecast.low)} to {in_words(forecast.high)}."
        )
    if outlook is None or expected is None:
        return ""
    causes = {f"one number of the file: {outlook.worst} leaves": outlook.deviation}
    drawn = outlook.expected
    if drawn is not None:
        causes[f"what is known only roughly: {' and '.join(drawn.drawn)} alone up to"] = drawn.high
        for name, deviation in drawn.left_out_m.items():
            usual = f"usual values of what the robot file does not state: {name} alone"
            causes[usual] = deviation
    cause = max(causes, key=lambda words: causes[words])
    text = f"Most of this comes from {cause} {in_words(causes[cause])}."
    may_be_worse = outlook.may_be_worse
    if may_be_worse is not None and outlook.worse is None:
        text += (
            " On some robots that its file allows it leaves more than no correction:"
            f" {in_words(may_be_worse.deviation)} for {in_words(may_be_worse.uncorrected)}."
        )
    names = critical_joints(figures)
    if names:
        text += f" The gears of {names} reverse along this path, where their backlash is felt most."
    return text


def critical_joints(figures: RunResult, robot: str | None = None) -> str:
    """Return the joints whose backlash is felt most along the path, in words; empty for none.

    Args:
        robot: Name of the robot whose joints are asked for; None: they are named with their robots.
    """
    gears = [
        gear
        for gear in figures.gears
        if gear.at_risk and gear.reversals and robot in (None, gear.robot)
    ]
    worst = sorted(gears, key=lambda gear: -gear.backlash_error)[:_NAMED]
    is_named = robot is None and len(figures.robots) > 1
    return " and ".join(
        f"joint {gear.joint}{f' of the {gear.robot} robot' if is_named else ''}"
        for gear in sorted(worst, key=lambda gear: (gear.robot or "", gear.joint))
    )


def _plans(figures: RunResult, context: RunContext) -> Iterator[NextStep]:
    """Yield the steps that plan the measurement of every robot."""
    for robot in figures.robots:
        is_alone = len(figures.robots) == 1
        joints = critical_joints(figures, None if is_alone else robot.name)
        who = "robot" if is_alone else f"{robot.name} robot"
        plan = "plan.csv" if is_alone else f"plan_{robot.name}.csv"
        yield NextStep.by(
            f"Measure the {who}{f', the gears of {joints} first' if joints else ''}; this plans it:",
            *("identify", "--plan", "--robot", context.robots[robot.name], "-o", plan),
        )


def _capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"


def _steps(
    figures: RunResult, context: RunContext, good: bool | None, shift: Worsening | None
) -> Iterator[NextStep]:
    """Yield what to do next; `place` and `next` are for one robot.

    Args:
        shift: Robot on which a shift of the part does as well; None for none.
    """
    folder, is_alone = context.folder, len(figures.robots) == 1
    if not figures.is_stable:
        yield NextStep.by(_STABLE, "stability", context.case)
        return
    if not figures.converged and _is_enough(figures, context):
        ask = 1.5 * figures.deviation_after_m.maximum
        yield NextStep.by(
            f"Ask for less: tolerance_m = {ask:.1g} in [compensation] of {context.case}; then again:",
            *("compensate", context.case, "-o", folder, "--overwrite"),
        )
        return
    if _is_validated_quasistatic(figures):
        yield NextStep.by(
            f'Validate it on the robot that moves, mode = "dynamic" in [robot] of {context.case}:',
            *("compensate", context.case, "-o", folder, "--overwrite"),
        )
        yield NextStep(
            f'Or correct the other: method = "mirror" in [compensation] of {context.case}.'
        )
        return
    if not figures.converged:
        yield NextStep.by("See whether robot and path fit each other:", "check", context.case)
        if is_alone:
            yield NextStep.by(_STIFFER, "place", context.case)
        return
    if context.tolerance is None:
        yield state_tolerance(context.case)
    if shift is not None:
        touch_off = "" if figures.touched_off else f"touch_off = true in [part] of {context.case}, "
        yield NextStep.by(
            f"Touch the part off and run it uncorrected; {touch_off}this computes what remains:",
            *("couple", context.case, "-o", f"{folder}_uncorrected"),
        )
    if good is not True and figures.forecast is None:
        yield from _plans(figures, context)
        if is_alone and any(gear.at_risk for gear in figures.gears):
            yield NextStep.by("Or place the part where no gear reverses:", "place", context.case)
    is_worse = figures.outlook is not None and figures.outlook.worse is not None
    if not figures.gains and good is not True and (is_worse or not is_alone):
        return
    purpose = "Write the robot program:"
    if shift is not None:
        purpose = "Or learn the robot from a part made under this command; write its program:"
    yield NextStep.export(purpose, folder, figures.robots[0].title)
    if is_alone:
        yield NextStep.by(
            "Run it, measure the tool's path, and correct what remains:",
            *("next", folder, "measured.csv", "-o", f"{folder}_next"),
        )


def _coupling_answer(figures: RunResult, context: RunContext) -> Answer:
    """Return the first screen of a run without a correction."""
    before = figures.deviation_before_m
    size = in_words(before.maximum)
    fits = None if context.tolerance is None else before.maximum <= context.tolerance
    if not figures.is_stable:
        sentence = WILL_CHATTER
    elif not figures.converged:
        sentence = f"NOT FINISHED: robot and process did not come to rest; so far {size}."
    else:
        sentence = judged(
            f"uncorrected, the tool is off its path by up to {size} with this robot file",
            fits,
            context.tolerance,
        )
    reason = _reason(figures, None)
    correction = ("compensate", context.case, "-o", f"{context.folder}_corrected")
    steps = [NextStep.by("Correct the command:", *correction)]
    if context.tolerance is None:
        steps.insert(0, state_tolerance(context.case))
    if len(figures.robots) == 1:
        steps.append(NextStep.by(_STIFFER, "place", context.case))
    if not figures.is_stable:
        steps = [NextStep.by(_STABLE, "stability", context.case)]
    return Answer(
        sentence=sentence,
        reason=reason,
        good=fits if figures.converged and figures.is_stable else False,
        figures=(
            KeyFigure("Uncorrected", size, "largest, with this robot file"),
            KeyFigure(
                "Less a constant",
                in_words(before.maximum_less_constant),
                "after the part is shifted to fit",
            ),
            KeyFigure("Largest force", f"{figures.peak_force_N:.3g} N", "on the tool"),
        ),
        steps=steps,
    )
