"""First screen of a run: what to expect on the real robot, whether it is good enough, what to do now."""

from __future__ import annotations

from coupling.path.length_text import in_words
from coupling.path.path_ends import MOVING_END
from coupling.report.expected import expected_sentence, expected_words
from coupling.report.lengths import NOT_KNOWN, judged, state_tolerance
from coupling.report.run_steps import (
    STABLE,
    STIFFER,
    RunContext,
    critical_joints,
    gears_of,
    is_enough,
    is_validated_quasistatic,
    repeat_alike,
    run_steps,
)
from coupling.results.cut_result import WILL_CHATTER
from coupling.results.expected_deviation import ExpectedDeviation
from coupling.results.outlook import WorstReplay
from coupling.results.replay import Worsening
from coupling.results.run_result import RunResult
from coupling.results.section import Answer, KeyFigure, NextStep

# Ends of an iteration without a result, in words that need no glossary.
_UNFINISHED = {
    "diverged": "Each further step made it worse.",
    "limit cycle": "Further steps went to and fro without coming closer.",
    "stagnated": "Further steps no longer helped.",
    "exhausted": "It takes more steps than the case allows.",
    "process failed": "The process could not be evaluated on the path.",
    "robot failed": "The robot could not be simulated on the path.",
}


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
    first = KeyFigure("Before", size, before)
    if figures.forecast is not None:
        # Its desired path is moved by what was measured: uncorrected it tells of no run that was made.
        last = in_words(figures.forecast.before)
        first = KeyFigure("Measured on average", last, "under the last command")
    reason = _reason(figures, expected)
    if good and outlook is not None and outlook.shift_alone is not None:
        reason += " Touching the part off, without a correction, leaves less."
    return Answer(
        sentence=_sentence(figures, context, expected, worse or shift),
        reason=reason,
        good=good,
        figures=(
            first,
            KeyFigure(
                "Expected after", NOT_KNOWN if expected is None else expected_words(expected), after
            ),
            KeyFigure(
                "If the file is right",
                in_words(figures.deviation_after_m.maximum),
                "on a robot exactly as its file says",
            ),
        ),
        steps=list(run_steps(figures, context, good, shift)),
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
    if not figures.converged and is_enough(figures, context):
        return (
            f"NOT FINISHED: the last command leaves {after} on a robot exactly as its file says,"
            f" uncorrected {before}; the case asks for less than that."
        )
    if is_validated_quasistatic(figures):
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


def _reason(figures: RunResult, expected: ExpectedDeviation | None) -> str:
    """Return whether the cut is stable, and what makes up the figure that is expected."""
    stability = figures.stability
    if stability is None:
        return _reason_of_size(figures, expected)
    if stability.stable:
        return f"{_reason_of_size(figures, expected)} {stability.sentence}.".strip()
    remedy = f" Stable would be {stability.alternative}." if stability.alternative else ""
    return f"{stability.sentence}.{remedy}"


def _reason_of_size(figures: RunResult, expected: ExpectedDeviation | None) -> str:
    """Return what makes up the figure that is expected."""
    outlook = figures.outlook
    if (difference := figures.disturbing_difference) is not None:
        return (
            "The process answers one path with different forces, up to"
            f" {difference.largest:.3g} N apart of {difference.peak:.3g} N, and no iteration can end."
        )
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
    text = f"Most of the {in_words(expected.maximum)} comes from {cause} {in_words(causes[cause])}."
    may_be_worse = outlook.may_be_worse
    if may_be_worse is not None and outlook.worse is None:
        text += (
            " On some robots that its file allows it leaves more than no correction:"
            f" {in_words(may_be_worse.deviation)} for {in_words(may_be_worse.uncorrected)}."
        )
    names = critical_joints(figures)
    if names:
        many = " and " in names
        text += (
            f" The {gears_of(names)} {'reverse' if many else 'reverses'} along this path, where"
            f" {'their' if many else 'its'} backlash is felt most."
        )
    return text


def _capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"


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
        steps.append(NextStep.by(STIFFER, "place", context.case))
    if not figures.is_stable:
        steps = [NextStep.by(STABLE, "stability", context.case)]
    elif figures.disturbing_difference is not None:
        steps = [repeat_alike(context)]
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
