"""The page of a case that was checked: path, robot and what it reaches, in one picture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from coupling.check.robot_findings import RobotFindings
from coupling.errors import ResultError
from coupling.report.colours import AFTER, BEFORE
from coupling.report.document import document
from coupling.report.report_file import write_page
from coupling.report.run_scene import scene_robot, thinned_motion, tool_of
from coupling.report.thinning import PARTS, rows_within
from coupling.results.drive_result import DriveMotion
from coupling.results.outlook import Replay
from coupling.results.scene import Scene, SceneLine
from coupling.results.section import Answer, Note, Section, Table, warned
from coupling.run.gear_check import gear_sections
from coupling.run.predicted_motor_torques import COLD, WARM, PredictedMotorTorque
from coupling.run.simulated_motor_torques import motor_limit

_REACH = "#009E73"
# What is not seen of a path [m].
_SEEN = 2e-4
_NOTE = Note(
    "In the picture: the robot along its path, under the loads named above. Thin lines: reach"
    " of the TCP from the middle of the path with the tool's orientation there, in the vertical"
    " plane through the robot's base and in the horizontal plane. Beyond them a joint exceeds its"
    " limit, the pose is out of reach or singular. Collisions are not checked."
)


def write_check_page(
    file: Path,
    title: str,
    robots: Sequence[RobotFindings],
    sections: Sequence[Section],
    case: Mapping[str, Any],
    answer: Answer,
) -> Path:
    """Write the page of a case that was checked; return the file.

    Args:
        file: The HTML file.
        title: Title of the page.
        robots: Findings on the robots.
        sections: Sections of the page.
        case: Content of the case.
        answer: Its first screen.

    Raises:
        ResultError: If it cannot be written.
    """
    shown = replace(answer, scene=workspace(robots, case))
    write_page(file, document(title, [*sections, Section("", [_NOTE])], shown), ResultError)
    return file


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
        joint_table(robot.demands),
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
    most = 1e6 * max(replay.deviation.maximum for replay in wrong)
    less_constant = 1e6 * max(replay.deviation.maximum_less_constant for replay in wrong)
    return (
        f"With {' or '.join(replay.name for replay in wrong)} in all gears the deviation under the exact"
        f" command is up to {most:.1f} um, {less_constant:.1f} um less a constant (simulated)."
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


def joint_table(demands: Sequence[DriveMotion]) -> Table:
    """Return angles, rates and accelerations of joints beside their limits."""

    def degrees(value: float | None) -> str:
        if value is None or not np.isfinite(value):
            return "none"
        return f"{np.rad2deg(value).round(1) + 0.0:.1f}"

    rows = [
        (
            f"joint {demand.joint}",
            *map(
                degrees,
                (
                    *demand.range_rad,
                    *demand.range_limit_rad,
                    demand.margin,
                    demand.rate_rad_s,
                    demand.rate_limit_rad_s,
                    demand.acceleration_rad_s2,
                    demand.acceleration_limit_rad_s2,
                ),
            ),
            ", ".join(demand.exceeded) or "-",
        )
        for demand in demands
    ]
    angles = ("[deg, s]", "lowest", "highest", "from", "to", "margin")
    return Table((*angles, "rate", "limit", "acceleration", "limit", "BEYOND LIMIT"), rows)
