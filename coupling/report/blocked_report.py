"""The page of a case whose robot cannot follow its path: where it stops, and what is in the way."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.case.file import TouchOffError
from coupling.check.clearance import Clearance, clearance_around
from coupling.inverse.joint_limits import JointLimits
from coupling.path.histories import ToolPath
from coupling.path.length_text import in_words
from coupling.path.linear import arc_length
from coupling.report.colours import AFTER, BEFORE, DESIRED, GREEN, PLANT
from coupling.report.result_report import ResultReport
from coupling.report.run_scene import scene_robot, tool_of
from coupling.results.scene import Scene, SceneLine, SceneMotion
from coupling.results.section import Answer, KeyFigure, NextStep, Note, Section, Table
from coupling.robot.batch.rigid_robot import RigidRobot
from coupling.robot.blocked_path import BlockedPath, UnreachableError
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.run.robot_results import chain_of

# Half the length of a joint's axis in the picture [m].
_AXIS = 0.4
_NOTE = Note(
    "In the picture: the robot where it stops. Thin lines: reach of its tool, held as on the path up to"
    " there, or as at home where it does not even begin, in the vertical plane through the robot's base"
    " and in the horizontal plane."
)


def blocked_report(
    case: Case, error: UnreachableError, file: Path, touch: TouchOffError | None = None
) -> ResultReport:
    """Return what is told of a case whose path a robot cannot follow, or whose part it cannot touch off.

    Args:
        error: Refusal of its path, or of standing at a point.
        file: The case file, as it was named.
        touch: Refusal of touching off, for which the case is one without; None for a path.
    """
    placed = next(
        robot
        for robot in case.robots
        if (robot.description is error.robot if touch is None else robot.name == touch.robot)
    )
    blocked = error.blocked
    if touch is None:
        answer = _answer(case, placed, blocked, file)
    else:
        answer = _touch_answer(case, placed, blocked, file, touch.point)
    return ResultReport(
        "check",
        case.title,
        answer,
        lambda: [_joints(placed, error), Section("", [_NOTE])],
        scene=partial(_scene, case, placed, blocked, touch is not None),
    )


def _touch_answer(
    case: Case, placed: PlacedRobot, blocked: BlockedPath, file: Path, point: int
) -> Answer:
    place = blocked.path.position[0][0]
    away, length = float(np.linalg.norm(place)), _arm(placed)
    what, reason, hindrance = _hindrance(placed, blocked, away, length)
    who = "robot" if len(case.robots) == 1 else f"{placed.name} robot"
    again = ("check", str(file))
    shown = ", ".join(f"{value:.4g}" for value in placed.world_from_base.points(place))
    touch = f"Touch other points, touch_off = [[x, y, z], ..] in [part] of {file}, and check again:"
    return Answer(
        sentence=(
            f"The {who} cannot touch the part off: at point {point}"
            f" {what.format(joint=blocked.obstacle.joint)}."
        ),
        reason=reason,
        good=False,
        figures=(
            KeyFigure(
                f"Point {point}", f"{shown} m", "of touch_off, where the part is to be touched"
            ),
            hindrance,
            _from_base(away, length, "to the point"),
        ),
        steps=[
            NextStep.by(touch, *again),
            NextStep.by(f"Or move the part, position_m in [part] of {file}:", *again),
        ],
    )


def _from_base(away: float, length: float, where: str) -> KeyFigure:
    return KeyFigure(
        "From the robot's base",
        in_words(away),
        f"{where}; links and tool in a line are {in_words(length)} long",
    )


def _answer(case: Case, placed: PlacedRobot, blocked: BlockedPath, file: Path) -> Answer:
    way = arc_length(blocked.path.position[0])
    followed, whole, time = float(way[blocked.row]), float(way[-1]), blocked.time
    away = float(np.linalg.norm(blocked.path.position[0][blocked.row]))
    length, joint, is_alone = _arm(placed), blocked.obstacle.joint, len(case.robots) == 1
    what, reason, hindrance = _hindrance(placed, blocked, away, length)
    who = "robot" if is_alone else f"{placed.name} robot"
    begins = (
        f"at t = {time:.3g} s, after {followed:.3g} of {whole:.3g} m,"
        if followed
        else "from its start"
    )
    again = ("check", str(file))
    move = f"Move the part, position_m in [part] of {file}, and check again:"
    steps = [NextStep.by(move, *again)]
    if is_alone:
        steps.insert(0, NextStep.by("Find a place where it can:", "place", str(file)))
    if blocked.obstacle.kind != "reach":
        begin = f"Or begin in another posture, home_deg in [{placed.table}] of {file}:"
        steps.append(NextStep.by(begin, *again))
    return Answer(
        sentence=f"The {who} cannot follow this path: {begins} {what.format(joint=joint)}.",
        reason=reason,
        good=False,
        figures=(
            KeyFigure(
                "Followed",
                f"{100.0 * followed / whole if whole else 0.0:.0f} % of the path",
                f"up to t = {time:.3g} of {blocked.path.time[-1]:.3g} s",
            ),
            hindrance,
            _from_base(away, length, "to where it stops"),
        ),
        steps=steps,
    )


def _arm(placed: PlacedRobot) -> float:
    """Return the length of a robot's links and tool in a line [m]."""
    return RigidRobot(placed.description).reach


def _hindrance(
    placed: PlacedRobot, blocked: BlockedPath, away: float, length: float
) -> tuple[str, str, KeyFigure]:
    """Return what is in the way: in half a sentence, the reason, and its figure."""
    obstacle, angles = blocked.obstacle, blocked.angles
    joint = obstacle.joint
    if obstacle.kind == "reach":
        reason = (
            f"That is {in_words(away)} from the robot's base, which is farther than its links reach."
            if away > length
            else "With the tool held so no posture reaches that: another tilt or rotation of the tool"
            " may help as well as another place."
        )
        figure = KeyFigure("Tool stays away", in_words(obstacle.size), "as near as the robot comes")
        return "the tool does not come to its place", reason, figure
    if obstacle.kind == "limit":
        limits = JointLimits.of(placed.description)
        low, high = limits.lower[joint - 1], limits.upper[joint - 1]
        course = angles[:, joint - 1]
        beyond = float(np.maximum(course - high, low - course).max())
        figure = KeyFigure(
            f"Joint {joint} beyond its limit",
            f"{np.rad2deg(beyond):.3g} deg",
            f"at most; it may be {np.rad2deg(low):.4g} to {np.rad2deg(high):.4g} deg",
        )
        return "joint {joint} passes its limit", "", figure
    if obstacle.kind == "jump":
        reason = (
            "The path leads past a posture in which two axes line up or the arm is stretched, or its"
            " points lie too far apart."
        )
        figure = KeyFigure(
            f"Jump of joint {joint}", f"{np.rad2deg(obstacle.size):.3g} deg", "between two points"
        )
        return "joint {joint} would have to jump", reason, figure
    reason = (
        "The arm is stretched there, or two of its axes line up: it cannot move in all directions."
    )
    figure = KeyFigure("Joint in the way", f"joint {joint}", "it would have to move too fast")
    return "joint {joint} would have to move infinitely fast", reason, figure


def _joints(placed: PlacedRobot, error: UnreachableError) -> Section:
    """Return the joints in the posture where a robot stops, beside their limits."""
    limits, q = JointLimits.of(placed.description), error.blocked.angles[error.blocked.row]
    rows = [
        (
            f"joint {number}",
            f"{np.rad2deg(angle):.2f}",
            "none" if not np.isfinite(low) else f"{np.rad2deg(low):.2f}",
            "none" if not np.isfinite(high) else f"{np.rad2deg(high):.2f}",
            "" if low <= angle <= high else "angle",
        )
        for number, (angle, low, high) in enumerate(
            zip(q, limits.lower, limits.upper, strict=True), start=1
        )
    ]
    columns = ("joint", "angle [deg]", "lower limit", "upper limit", "BEYOND LIMIT")
    return Section("Joints where it stops", [f"{str(error).capitalize()}.", Table(columns, rows)])


def _scene(case: Case, placed: PlacedRobot, blocked: BlockedPath, touches: bool) -> Scene:
    """Return the robot where it stops, both pieces of its path, and what is in the way."""
    row, position, q = blocked.row, blocked.path.position[0], blocked.angles[blocked.row]
    serial, joint = RigidRobot(placed.description), blocked.obstacle.joint - 1
    posture, reach = serial.posture(q[:, None]), _reach(placed, blocked)
    lines = [
        ("reach, vertical plane", GREEN, reach.vertical),
        ("reach, horizontal plane", AFTER, reach.horizontal),
    ]
    if touches:
        robots = zip(case.robots, case.desired.tools, strict=True)
        tool = next(path for robot, path in robots if robot is placed)
        programmed = placed.world_from_base.coordinates(tool.position[0])
        lines.append(("path on the part", DESIRED, programmed))
    else:
        lines.append(("path that it does not follow", BEFORE, position[row:]))
    if row:
        lines.append(("path that it follows", DESIRED, position[: row + 1]))
    if blocked.obstacle.kind == "reach":
        gap = np.array([posture.tip[:, 0], position[row]])
        lines.append(("missing to its place", PLANT, gap))
    else:
        axis, origin = posture.axis[joint, :, 0], posture.origin[joint, :, 0]
        ends = np.array([origin - _AXIS * axis, origin + _AXIS * axis])
        lines.append((f"axis of joint {joint + 1}", PLANT, ends))
    table = placed.table
    robot = scene_robot(
        placed.description.name,
        chain_of(placed.description, placed.world_from_base),
        SceneMotion(blocked.path.time[[row]], q[None]),
        tool=tool_of(case.resolved.get("process" if table == "robot" else table, {})),
        description=case.resolved[table].get("description"),
    )
    to_world = placed.world_from_base.points
    return Scene(
        robots=[robot],
        lines=[SceneLine(name, color, to_world(points)) for name, color, points in lines],
    )


def _reach(placed: PlacedRobot, blocked: BlockedPath) -> Clearance:
    """Return what a robot reaches from where it follows the path, else from home."""
    rows = np.arange(blocked.row)
    if len(rows) > 1:
        return clearance_around(
            placed.description, blocked.path.at_rows(rows), blocked.angles[rows]
        )
    home = np.tile(placed.home, (2, 1))
    poses = InverseKinematics(placed.description, placed.home).poses(home)
    return clearance_around(placed.description, ToolPath(np.array([0.0, 1.0]), poses), home)
