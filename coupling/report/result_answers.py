"""First screens of what is no run: next command, placement, study, stability and modes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coupling.report.bars import bars
from coupling.report.expected import expected_sentence, expected_words
from coupling.report.lengths import in_words, judged, state_tolerance, words_if_known
from coupling.report.modes_scene import modes_scene
from coupling.results.cut_result import WILL_CHATTER
from coupling.results.modes_result import ModesResult
from coupling.results.next_result import NextResult
from coupling.results.outlook import EXPECTED_SHARE
from coupling.results.placement_result import PlacementResult, SettingResult
from coupling.results.section import Answer, KeyFigure, NextStep
from coupling.results.stability_result import StabilityResult
from coupling.study.stored_study import StoredStudy

# Force that tells how soft a robot is [N].
_PRESSED = 100.0


def next_answer(result: NextResult, folder: str, next_words: Sequence[str]) -> Answer:
    """Return the first screen of a next command.

    Args:
        result: Its figures.
        folder: Its run folder, or before it is computed its case file, as commands name it.
        next_words: Words of the command that goes on from it.
    """
    forecast, runs, last = result.forecast, result.runs, result.runs[-1].size_m
    steps = [
        NextStep.by("Write the robot program:", "export", folder, "--to", "krl"),
        NextStep.by("Run it, measure again, and go on:", *next_words),
    ]
    good = None
    if forecast is None:
        sentence = f"Measured: {in_words(last.maximum)}. A next command has not been computed."
        steps = [NextStep.by("Compute it:", "compensate", folder)]
    else:
        if result.tolerance_m is not None:
            good = forecast.maximum <= result.tolerance_m
        words = (
            f"expect the tool within at most about {in_words(forecast.maximum)} of its path in the next"
            " run"
        )
        sentence = judged(words, good, result.tolerance_m)
    if result.step.worse:
        good = False
        sentence = (
            f"WORSE THAN BEFORE: the last command left {in_words(last.maximum)}, more than an earlier"
            " one, from which this one goes on."
        )
    return Answer(
        sentence=sentence,
        reason=_against_forecast(result),
        good=good,
        figures=(
            KeyFigure("Measured last", in_words(last.maximum), "largest, noise taken off"),
            KeyFigure(
                "Expected next",
                words_if_known(None if forecast is None else forecast.maximum),
                "at most about, on your robot",
            ),
            KeyFigure(
                "On average",
                words_if_known(None if forecast is None else forecast.rms),
                f"after {in_words(last.rms)} in the last run",
            ),
        ),
        steps=steps,
        picture=bars(
            [
                *(
                    (f"measured, run {k}", run.size_m.maximum)
                    for k, run in enumerate(runs, start=1)
                ),
                ("expected next", None if forecast is None else forecast.maximum),
            ],
            result.tolerance_m,
        ),
    )


def refused_answer(result: NextResult, path_words: Sequence[str]) -> Answer:
    """Return the first screen where no parameter could be learned.

    Args:
        result: The figures.
        path_words: Words of the command that learns along the path alone.
    """
    last = result.runs[-1].size_m
    return Answer(
        sentence=f"NO NEXT COMMAND: {result.parameters_refused}.",
        good=False,
        figures=(
            KeyFigure("Measured last", in_words(last.maximum), "largest, noise taken off"),
            KeyFigure("On average", in_words(last.rms), "in the last run"),
            KeyFigure("Noise", in_words(result.runs[-1].noise_m), "of the measurement"),
        ),
        steps=[NextStep.by("Correct the path alone:", *path_words)],
    )


def _against_forecast(result: NextResult) -> str:
    """Return how the last run compares with what was expected of it, and what is not corrected."""
    last, forecast, sentences = result.runs[-1], result.runs[-1].forecast, []
    if forecast is not None:
        average = last.size_m.rms if forecast.absolute else last.size_m.rms_less_constant
        state = "as much as" if forecast.low <= average <= forecast.high else "more than"
        sentences.append(
            f"The last run left {'less than' if average < forecast.low else state} was expected:"
            f" {in_words(average)} on average, expected {in_words(forecast.low)} to"
            f" {in_words(forecast.high)}."
        )
    if not result.absolute:
        sentences.append(
            "A shift of the whole path is not counted: the frame of the measuring device is not known."
        )
    return " ".join(sentences)


def place_answer(figures: PlacementResult, folder: str) -> Answer:
    """Return the first screen of a placement in a folder."""
    best, present = figures.best[0], figures.present
    where = best.in_words(figures.free)
    chatters = best.stability is not None and not best.stability.stable
    tolerance, placed_case = figures.tolerance_m, f"{folder}/{best.file}"
    fits = _fits(best, tolerance)
    good = fits if best.admitted and not chatters else False
    allowed = "" if tolerance is None else f"; your tolerance is {in_words(tolerance)}"
    settings = {"as it is": present, "there": best}
    causes = {
        "process": {name: s.moved_m for name, s in settings.items() if s is not None},
        "gears": {name: s.exposure_m for name, s in settings.items() if s is not None},
    }
    if not best.admitted:
        sentence = "NO PLACE FOUND that keeps all limits of [place]; the least bad one follows."
    elif chatters:
        sentence = f"{WILL_CHATTER} No place was found where it does not."
    elif fits is False:
        sentence = f"NOT GOOD ENOUGH: even at the best place {_remaining(best)}{allowed}."
    elif present is None:
        sentence = (
            "PLACE FOUND: as it is, the robot cannot follow the path; there it can:"
            f" {_remaining(best)}{allowed}."
        )
    elif best.cost_m < present.cost_m:
        as_it_is = _remaining(present)
        sentence = f"BETTER PLACE FOUND: there {_remaining(best)}; as it is {as_it_is}{allowed}."
    else:
        sentence = (
            f"LEAVE IT WHERE IT IS: no better place was found, and {_remaining(best)}{allowed}."
        )
    return Answer(
        sentence=sentence,
        reason=f"There: {where}.{f' {best.stability.sentence}.' if best.stability is not None else ''}",
        good=good,
        figures=(
            KeyFigure(
                "Moved by the process" if figures.forced else "Moved by 100 N",
                in_words(best.moved_m),
                _as_it_is(present),
            ),
            KeyFigure(
                "By unknown gears",
                in_words(best.exposure_m),
                "at rest, in motion several times as much",
            ),
            KeyFigure(
                "To the nearest joint limit",
                f"{np.rad2deg(best.limit_margin_rad):.3g} deg"
                if np.isfinite(best.limit_margin_rad)
                else "no limit",
                "there",
            ),
        ),
        steps=[
            NextStep("Check robot, tool and part for collisions there."),
            *([] if tolerance is not None else [state_tolerance(placed_case)]),
            NextStep.by("Find a depth and speed that do not chatter:", "stability", placed_case)
            if chatters
            else NextStep.by("Correct the command:", "compensate", placed_case),
        ],
        picture=bars(
            [
                (f"{place}, {cause}", length)
                for cause, lengths in causes.items()
                for place, length in lengths.items()
            ],
            tolerance,
        ),
    )


def _fits(setting: SettingResult, tolerance: float | None) -> bool | None:
    """Return whether a tolerance [m] will be kept; None where that is open."""
    if tolerance is None:
        return None
    if setting.exposure_m > tolerance:
        return False
    return None if setting.expected is None else setting.expected.fits(tolerance)


def _remaining(setting: SettingResult) -> str:
    """Return what a corrected command leaves in a setting, in words."""
    if setting.expected is None:
        return f"gears that are not known well leave {in_words(setting.exposure_m)}"
    return f"expect {expected_words(setting.expected)} on the real robot, corrected"


def _as_it_is(present: SettingResult | None) -> str:
    return "there" if present is None else f"there; as it is {in_words(present.moved_m)}"


def study_answer(study: StoredStudy) -> Answer:
    """Return the first screen of a study."""
    figures, source, tolerance = study.figures, study.figures.source, study.figures.tolerance_m
    most, expected = figures.quantile("maximum", EXPECTED_SHARE), figures.expected
    share = f"{100 * EXPECTED_SHARE:g} %"
    good = None if tolerance is None or expected is None else expected.fits(tolerance)
    reasons = []
    if figures.chosen:
        if tolerance is not None and most > tolerance:
            good = False
        names = " and ".join(
            dict.fromkeys(entry.name.split("[")[0] for entry in figures.parameters)
        )
        sentence = judged(
            f"of the robots that differ in {names} alone, as [study] chooses it, {share} stay within"
            f" {in_words(most)} of the path",
            good,
            tolerance,
        )
        if expected is not None:
            reasons.append(f"On the real robot expect {expected_words(expected)}.")
    elif expected is not None:
        sentence = expected_sentence(expected, tolerance)
        reasons.append(
            f"{share} of {figures.samples} robots to expect stay within {in_words(most)}."
        )
    else:
        sentence = judged(f"{share} of the robots stay within {in_words(most)}", good, tolerance)
    if not figures.command.converged:
        good = False
        sentence = (
            "NOT FINISHED: the command of this study keeps its path on no robot: do not send it."
        )
    elif figures.failed:
        good = False
        sentence = (
            f"NOT GOOD ENOUGH: {len(figures.failed)} of {figures.samples} robots"
            f" cannot follow the command at all; {share} of the others stay within {in_words(most)}."
        )
    if figures.ordered:
        worst, shares = figures.ordered[0]
        reasons.append(
            f"{worst.name} decides most: {100 * shares['maximum'].share:.0f} % of the scatter comes from"
            " it alone."
        )
    third = KeyFigure("Robots", f"{figures.samples}", f"{len(figures.failed)} cannot be simulated")
    if tolerance is not None:
        within = 100.0 * np.sum(study.measures["maximum"] <= tolerance) / figures.samples
        third = KeyFigure(
            "Keep your tolerance",
            f"{within:.0f} %",
            f"of {figures.samples} robots",
        )
    steps = [] if tolerance is not None else [state_tolerance(source.case)]
    if not figures.command.converged:
        purpose = "See whether robot and path fit each other:"
        steps = [NextStep.by(purpose, "check", source.case)]
    elif good:
        steps.append(NextStep.by("Write the robot program:", "export", source.run, "--to", "krl"))
    else:
        plan = ("identify", "--plan", "--robot", source.robot, "-o", "plan.csv")
        steps.append(NextStep.by("Measure what decides most; this plans it:", *plan))
        steps.append(NextStep.by("Or place the part where it matters less:", "place", source.case))
    return Answer(
        sentence=sentence,
        reason=" ".join(reasons),
        good=good,
        figures=(
            KeyFigure(f"{share} of robots", in_words(most), "largest deviation, at most"),
            KeyFigure(
                "If the file is right",
                in_words(figures.command.deviation_m.maximum),
                "on a robot exactly as its file says",
            ),
            third,
        ),
        steps=steps,
        picture=bars(
            [
                ("if the file is right", figures.command.deviation_m.maximum),
                *(
                    (f"{100 * float(part):g} % of robots", length)
                    for part, length in figures.quantiles_m["maximum"].items()
                ),
            ],
            tolerance,
        ),
    )


def stability_answer(result: StabilityResult) -> Answer:
    """Return the first screen of a case's stability."""
    case = result.case_file
    worst, tolerance = result.points[result.worst], result.tolerance_m
    is_stable = all(point.stable for point in result.points)
    limit = f"{1e3 * worst.limit_m:.3g} mm" if np.isfinite(worst.limit_m) else "no limit"
    moved = max(point.moved_m for point in result.points)
    steps = [] if tolerance is not None else [state_tolerance(case)]
    steps.append(NextStep.by("Correct the command:", "compensate", case))
    good: bool | None = None
    if not is_stable:
        good, sentence = False, WILL_CHATTER
        if result.instead_of is not None:
            sentence += " No command was computed."
        rpm = ", ".join(f"{low:.0f} to {high:.0f}" for low, high in result.stable_rpm[:3])
        speeds = f", or at a speed of {rpm} 1/min" if rpm else ""
        place = ("place", case, "--optimise", "stability")
        steps = [
            NextStep(f"Cut less than {limit} deep{speeds}."),
            NextStep.by("Or find a place where it is stable:", *place),
        ]
        if result.instead_of is not None:
            words = (*result.instead_of, "--despite-chatter")
            steps.append(NextStep.by("Or compute it as it is, chattering:", *words))
    elif tolerance is None:
        sentence = (
            f"This cut will not chatter; its force moves the tool by up to {in_words(moved)}."
        )
    else:
        good = True if moved <= tolerance else None
        sentence = (
            f"This cut will not chatter; its force moves the tool by up to {in_words(moved)}, your"
            f" tolerance is {in_words(tolerance)}{'' if good else ': correct the command'}."
        )
    where = f"Nearest to chatter{'' if worst.time is None else f' at t = {worst.time:.2f} s'}"
    rigid = (
        "" if result.tool_modes else " The tool is taken as rigid: its own vibration is not seen."
    )
    return Answer(
        sentence=sentence,
        reason=f"{where}: {1e3 * worst.depth_m:.3g} mm deep at {worst.rpm:.0f} 1/min.{rigid}",
        good=good,
        figures=(
            KeyFigure(
                "Stable up to", limit, f"programmed {1e3 * worst.depth_m:.3g} mm, where it is worst"
            ),
            KeyFigure("Vibration", f"{worst.frequency_Hz:.3g} Hz", "the slowest to decay"),
            KeyFigure("Moved by the force", in_words(moved), "on average over a turn, uncorrected"),
        ),
        steps=steps,
        scene=None if result.swinging is None else modes_scene(result.swinging, worst.frequency_Hz),
    )


def modes_answer(result: ModesResult) -> Answer:
    """Return the first screen of a robot's modes, which judge nothing."""
    softest = result.places[0]
    moved = None if softest.softest_m_N is None else _PRESSED * softest.softest_m_N
    slowest = f"{softest.modes[0].frequency_Hz:.3g} Hz" if softest.modes else "none"
    reason = (
        f"The motors are locked, as brakes and small vibrations leave them; {result.loads} acts."
    )
    if softest.modes:
        energy = softest.modes[0].energy_by_joint
        reason += f" Most of the slowest vibration is in joint {int(np.argmax(energy)) + 1}."
    if moved is None:
        joints = ", ".join(map(str, softest.unloaded_joints))
        soft = f"Gears of joints {joints} are free in their backlash, where nothing holds them"
    else:
        soft = f"{_PRESSED:.0f} N move the tool by up to {in_words(moved)}"
    robot = result.robot if result.swinging is None else result.swinging.description
    posture = ",".join(f"{angle + 0.0:.3g}" for angle in np.round(softest.posture_deg, 3).tolist())
    at_posture = [] if softest.time_s is not None else [f"--posture-deg={posture}"]
    return Answer(
        sentence=f"{soft}; the slowest vibration has {slowest}.",
        reason=reason,
        figures=(
            KeyFigure(
                f"Moved by {_PRESSED:.0f} N", words_if_known(moved), "at rest, where it is softest"
            ),
            KeyFigure(
                "In vibration",
                words_if_known(
                    None if softest.dynamic_m_N is None else _PRESSED * softest.dynamic_m_N
                ),
                f"moved by {_PRESSED:.0f} N that swing with {softest.dynamic_Hz:.3g} Hz",
            ),
            KeyFigure(
                "Slowest vibration",
                slowest,
                f"damping {100.0 * softest.modes[0].damping_ratio:.2g} %" if softest.modes else "",
            ),
        ),
        steps=(
            NextStep.by(
                "Measure with a hammer, and see both:",
                *("modes", result.source, *at_posture, "--measured", "hammer.csv"),
            ),
            NextStep.by(
                "Put what was measured into the robot file:",
                *("identify", "hammer.csv", "--robot", robot, f"--posture-deg={posture}"),
            ),
        ),
        scene=None if result.swinging is None else modes_scene(result.swinging),
    )
