"""The page of a case that was checked: path, robot and what it reaches, in one picture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from coupling.check.robot_findings import RobotFindings
from coupling.path.length_text import in_words
from coupling.report.colours import AFTER, BEFORE
from coupling.report.drives import drives_table
from coupling.report.expected import expected_words
from coupling.report.result_report import ResultReport
from coupling.report.run_scene import scene_robot, thinned_motion, tool_of
from coupling.report.thinning import PARTS, rows_within
from coupling.results.cut_result import WILL_CHATTER, CutStability
from coupling.results.replay import Replay
from coupling.results.scene import Scene, SceneLine
from coupling.results.section import Answer, KeyFigure, NextStep, Note, Section, Table, warned
from coupling.run.gear_check import gear_sections
from coupling.run.predicted_motor_torques import COLD, WARM, PredictedMotorTorque
from coupling.run.simulated_motor_torques import motor_limit

_REACH = "#009E73"
# What is not seen of a path [m].
_SEEN = 2e-4
# Distance to a joint's limit that should remain [rad].
_NEAR = np.deg2rad(5.0)
_NOTE = Note(
    "In the picture: the robot along its path, under the loads named above. Thin lines: reach"
    " of the TCP from the middle of the path with the tool's orientation there, in the vertical"
    " plane through the robot's base and in the horizontal plane. Beyond them a joint exceeds its"
    " limit, the pose is out of reach or singular. Collisions are not checked."
)


def check_report(
    name: str,
    robots: Sequence[RobotFindings],
    case: Mapping[str, Any],
    sections: Sequence[Section],
    warnings: Sequence[Section],
    answer: Answer,
) -> ResultReport:
    """Return what is told of a case that was checked.

    Args:
        name: Name of the case.
        robots: Findings on the robots.
        case: Content of the case.
        sections: Sections for terminal and page.
        warnings: Those that warn.
        answer: First screen.
    """
    return ResultReport(
        "check",
        name,
        answer,
        lambda: [*sections, Section("", [_NOTE])],
        warnings=warnings,
        scene=partial(workspace, robots, case),
    )


def check_answer(
    robots: Sequence[RobotFindings],
    case: Mapping[str, Any],
    file: Path,
    loads: str,
    stability: CutStability | None = None,
) -> Answer:
    """Return the first screen of a case that was checked.

    Args:
        robots: Findings on its robots.
        case: Content of the case.
        file: The case file, as it was named.
        loads: Loads of the robots, in words.
        stability: Stability of a cut; None where nothing is milled.
    """
    chatters = stability is not None and not stability.stable
    cut = "" if stability is None else f"{stability.sentence}."
    limits = [
        f"joint {demand.joint} of {robot.name} exceeds its {' and '.join(demand.exceeded)}"
        for robot in robots
        for demand in robot.demands
        if demand.exceeded
    ]
    overloads = [str(warning) for robot in robots for warning in robot.warnings]
    problems = [*([cut] if chatters else []), *limits, *overloads]
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
    if chatters:
        sentence = WILL_CHATTER
    elif limits:
        sentence = f"The robot cannot follow this path: {limits[0]}."
    elif overloads:
        sentence = "The robot reaches the whole path, but is loaded beyond its rating."
    else:
        sentence = "The robot reaches the whole path within its limits."
        if not np.isfinite(margin):
            sentence = "The robot reaches the whole path; its file states no limits of the joints."
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
    further = problems[0] if problems and not limits else _say_of_gears(gears)
    return Answer(
        sentence=sentence,
        reason=cut if chatters else f"{cut} {further}".strip(),
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
                f"largest deviation of the tool, under {loads}",
            ),
        ),
        steps=_steps(
            chatters=chatters,
            is_beyond=bool(problems),
            is_to_place=len(robots) == 1 and bool(gears or problems),
            case=str(file),
        ),
    )


def _room(margin: float) -> str:
    if not np.isfinite(margin):
        return "the robot file states none"
    return "little" if margin < _NEAR else "enough"


def _say_of_gears(gears: Sequence[Any]) -> str:
    if not gears:
        return "No gear reverses along the path, so that backlash does little harm."
    numbers = sorted({gear.joint for gear in gears})
    names = " and ".join(filter(None, (", ".join(map(str, numbers[:-1])), str(numbers[-1]))))
    if len(numbers) > 1:
        subject, whose = f"The gears of joints {names} reverse", "their"
    else:
        subject, whose = f"The gear of joint {names} reverses", "its"
    return (
        f"{subject} along the path, and the tool jumps by {whose} backlash; a compensation removes that"
        " as well as it is known."
    )


def _steps(chatters: bool, is_beyond: bool, is_to_place: bool, case: str) -> list[NextStep]:
    if chatters:
        return [
            NextStep.by("Find a depth, a speed and a place that do not chatter:", "stability", case)
        ]
    steps = [] if is_beyond else [NextStep.by("Correct the command:", "compensate", case)]
    if is_to_place:
        steps.append(NextStep.by("Find a better place for the part:", "place", case))
    return steps


def check_summary(robots: Sequence[RobotFindings], loads: str) -> list[Section]:
    """Return what there is to say of robots.

    Args:
        robots: Findings on the robots.
        loads: Their loads, in words.
    """
    return [section for robot in robots for section in _of_robot(robot, loads)]


def _of_robot(robot: RobotFindings, loads: str) -> list[Section]:
    ways = ", ".join(f"{name} {1e3 * way:.0f}" for name, way in robot.clearance.free.items())
    sentences = (
        f"Path: {robot.path_length:.3f} m in {robot.path.time[-1]:.1f} s.",
        drives_table(robot.demands),
        f"Possible shift of the whole path [mm], base axes: {ways}.",
        f"Smallest conditioning {robot.clearance.conditioning:.3f} (1/|J^-1|, 0 is singular; place"
        " requires 0.03).",
    )
    return [
        Section(robot.name, sentences),
        Section(f"{robot.name} under {loads}", list(_of_gears(robot))),
        *gear_sections(robot.gears),
        *motor_table(robot.motors),
        *warned(map(str, robot.warnings)),
    ]


def motor_table(motors: Sequence[PredictedMotorTorque]) -> list[Section]:
    """Return what a path asks of motors beside their limits, warm and cold."""
    if not motors:
        return []
    rows = [
        (
            f"joint {motor.joint}",
            *(f"{motor.torque[factor]:.4g}" for factor in (WARM, 1.0, COLD)),
            *motor_limit(motor.torque[1.0], motor.limit),
            f"{motor.time[1.0]:.3f}",
            motor.exceeded,
        )
        for motor in motors
    ]
    columns = (
        *("motor [N m]", "friction -30 %", "as in the file", "friction +30 %"),
        *("limit", "used", "at t = [s]", "BEYOND LIMIT"),
    )
    return [Section("Demands on the motors", (_MOTORS, Table(columns, rows)))]


_MOTORS = Note(
    "Largest torques of rotor, friction and gear at the gear's output. Only a compensation computes the"
    " additional torque of a rotor that crosses its gear's backlash."
)


def _of_gears(robot: RobotFindings) -> Iterator[str]:
    """Yield what a wrong backlash and hysteresis would leave, and whether any gear reverses."""
    if any(gear.backlash for gear in robot.gears):
        yield _worst_deviation("backlash", robot.backlash, robot.unknown)
        if not any(gear.at_risk for gear in robot.gears):
            yield "No gear reverses: an error of the backlash causes little but a constant deviation."
    else:
        yield "No gear has backlash in this model."
    if robot.hysteresis is not None:
        yield _worst_deviation("hysteresis", robot.hysteresis, robot.unknown)


def _worst_deviation(what: str, wrong: Sequence[Replay], unknown: str) -> str:
    """Return what an error of the gears leaves, or why that is not known."""
    if not wrong:
        return f"The effect of an error of the {what} is not known: {unknown}"
    most = max(replay.deviation.maximum for replay in wrong)
    less_constant = max(replay.deviation.maximum_less_constant for replay in wrong)
    return (
        f"With {' or '.join(replay.name for replay in wrong)} in all gears the deviation under the exact"
        f" command is up to {in_words(most)}, {in_words(less_constant)} less a constant (simulated)."
    )


def workspace(robots: Sequence[RobotFindings], case: Mapping[str, Any]) -> Scene:
    """Return robots, paths and outlines of what is reached, in the world.

    Args:
        robots: Findings on the robots.
        case: Content of the case.
    """
    lines, drawn_robots = [], []
    for robot, table in zip(robots, ("robot", "support"), strict=False):
        position, reach = robot.path.position[0], robot.clearance
        for name, points, color in (
            ("reach, vertical plane", reach.vertical, _REACH),
            ("reach, horizontal plane", reach.horizontal, AFTER),
            ("path", position[_rows_of(robot)], BEFORE),
        ):
            lines.append(SceneLine(name, color, robot.world_from_base.points(points)))
        process = case.get("process" if table == "robot" else table, {})
        drawn_robots.append(
            scene_robot(
                robot.name,
                robot.chain,
                thinned_motion(robot.joints, robot.torque),
                tool=tool_of(process),
                description=case.get(table, {}).get("description"),
            )
        )
    return Scene(robots=drawn_robots, lines=lines)


def _rows_of(robot: RobotFindings) -> np.ndarray:
    """Return the rows of a path that are drawn: straight lines between them are within a millimetre."""
    path = robot.path
    return rows_within(path.time, path.position[0], np.full(3, _SEEN), 2 * PARTS)
