"""First screen of a case that was checked: can it be run, and what will its gears do?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from coupling.check.robot_findings import RobotFindings
from coupling.report.expected import expected_words
from coupling.report.lengths import in_words
from coupling.results.cut_result import WILL_CHATTER
from coupling.results.section import Answer, KeyFigure, NextStep

# Distance to a joint's limit that should remain [rad].
_NEAR = np.deg2rad(5.0)


def check_answer(
    robots: Sequence[RobotFindings],
    case: Mapping[str, Any],
    file: Path,
    chatter: Sequence[str] = (),
) -> Answer:
    """Return the first screen of a case that was checked.

    Args:
        robots: Findings on its robots.
        case: Content of the case.
        file: The case file, as it was named.
        chatter: Sentences on a cut that chatters; none where it does not.
    """
    limits = [
        f"joint {demand.joint} of {robot.name} exceeds its {' and '.join(demand.exceeded)}"
        for robot in robots
        for demand in robot.demands
        if demand.exceeded
    ]
    loads = [str(warning) for robot in robots for warning in robot.warnings]
    problems = [*limits, *chatter, *loads]
    margin = min(
        (d.margin for robot in robots for d in robot.demands if d.margin is not None),
        default=np.inf,
    )
    gears = [gear for robot in robots for gear in robot.gears if gear.at_risk]
    wrong = [
        replay.deviation.maximum
        for robot in robots
        for replay in (*robot.backlash, *(robot.hysteresis or ()))
    ]
    tolerance = case.get("part", {}).get("tolerance_mm")
    felt = bool(wrong) and tolerance is not None and max(wrong) > 1e-3 * tolerance
    expected = max(
        (robot.expected for robot in robots if robot.expected is not None),
        key=lambda figure: figure.maximum,
        default=None,
    )
    fits = None if tolerance is None or expected is None else expected.fits(1e-3 * tolerance)
    if chatter:
        sentence = WILL_CHATTER
    elif limits:
        sentence = f"The robot cannot follow this path: {limits[0]}."
    elif loads:
        sentence = "The robot reaches the whole path, but is loaded beyond its rating."
    else:
        sentence = "The robot reaches the whole path within its limits."
        if expected is not None:
            sentence += (
                f" Corrected, {expected_words(expected)} to expect on the real robot"
                f"{'' if tolerance is None else f', your tolerance is {in_words(1e-3 * tolerance)}'}."
            )
        elif felt:
            sentence += (
                f" Its gears have to be known well: an error of their backlash alone leaves up to"
                f" {in_words(max(wrong))}, your tolerance is {in_words(1e-3 * tolerance)}."
            )
    return Answer(
        sentence=sentence,
        reason=problems[0] if problems and not limits else _of_gears(gears),
        good=False if problems or felt else fits,
        figures=(
            KeyFigure(
                "To the nearest joint limit",
                f"{np.rad2deg(margin):.3g} deg" if np.isfinite(margin) else "no limit",
                _room(margin),
            ),
            KeyFigure(
                "Gears that reverse",
                str(len(gears)),
                "their backlash is felt at the tool" if gears else "backlash is not felt",
            ),
            KeyFigure(
                "If backlash is 20 % off",
                in_words(max(wrong)) if wrong else "nothing",
                "largest deviation of the tool",
            ),
        ),
        steps=_steps(bool(chatter), bool(problems), bool(gears), file),
    )


def _room(margin: float) -> str:
    if not np.isfinite(margin):
        return "the robot file states none"
    return "little" if margin < _NEAR else "enough"


def _of_gears(gears: Sequence[Any]) -> str:
    if not gears:
        return "No gear reverses along the path, so that backlash does little harm."
    numbers = sorted({gear.joint for gear in gears})
    names = " and ".join(filter(None, (", ".join(map(str, numbers[:-1])), str(numbers[-1]))))
    return (
        f"The gears of joint{'s' if len(numbers) > 1 else ''} {names} reverse along the path, and the"
        " tool jumps by their backlash; a compensation removes that as well as it is known."
    )


def _steps(chatters: bool, is_beyond: bool, reverses: bool, file: Path) -> list[NextStep]:
    if chatters:
        words = "Find a depth, a speed and a place that do not chatter:"
        return [NextStep.by(words, "stability", str(file))]
    place = NextStep.by("Find a better place for the part:", "place", str(file))
    if is_beyond:
        return [place]
    steps = [NextStep.by("Correct the command:", "compensate", str(file))]
    return [*steps, place] if reverses else steps
