"""Runs in space: their robots along the path, and how far the tools are off."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from coupling.errors import CouplingError
from coupling.files.robot_file import find_robot, load_robot
from coupling.inverse.inversion import MovingRobot
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.path.linear import interpolate_rows
from coupling.report.meshes import robot_meshes
from coupling.report.part_deviation import signed_deviation
from coupling.report.shaped_part import shaped_part
from coupling.report.thinning import rows_within
from coupling.report.workpiece_figures import workpiece_surface
from coupling.results.gear_result import BacklashReversal
from coupling.results.run_result import ChainResult, shown_name
from coupling.results.scene import (
    Scene,
    SceneMotion,
    SceneRobot,
    SceneSurface,
    SceneTool,
    SceneTrack,
)
from coupling.run.stored_run import FORMING, StoredRobot, StoredRun
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError

# Errors that thinning may make: of positions as a part of the path's extent, of deviations as a part of
# the largest one, of joint angles [rad]; and the largest number of rows.
_POSITION, _DEVIATION, _ANGLE, _MOST = 5e-4, 1e-2, 1e-3, 5000
# Error of torques, as a part of the largest one, and that of rounding [N m].
_TORQUE, _ROUND = 0.02, 0.1
# Field of a workpiece that a tool has shaped, and how far below the tool's surface it has not, as a part
# of its diameter.
_ABOVE, _UNTOUCHED = "height above the tool's surface [mm]", 0.1
# Name of the path on the worst of the robots that are drawn from what is known.
EXPECTED = "on a robot to be expected"
# Extent that a path has at least, and largest deviation below which no detail is of interest [m].
_LEAST, _SEEN = 1e-9, 1e-5


def run_scene(run: StoredRun, world_from_part: Frame, case: Mapping[str, Any]) -> Scene:
    """Return what a run shows in space.

    Args:
        case: Content of its case.toml.
    """
    tolerance = case.get("part", {}).get("tolerance_mm")
    return Scene(
        robots=list(_robots(run, case)),
        tracks=[
            replace(track, robot=name if len(run.robots) > 1 else "")
            for name, robot in run.robots.items()
            for track in tracks_of(robot)
        ],
        surfaces=list(_surfaces(run, world_from_part, case)),
        world_from_part=world_from_part,
        tolerance=None if tolerance is None else 1e-3 * tolerance,
    )


def _surfaces(
    run: StoredRun, world_from_part: Frame, case: Mapping[str, Any]
) -> Iterator[SceneSurface]:
    """Yield the workpieces of a run, or the part that its tool shapes, in the world."""
    tool, robot = tool_of(case.get("process", {})), run.first
    shaped = None
    if tool is not None and FORMING in run.robots:
        shaped = shaped_part(robot.desired, robot.wrench, world_from_part, tool)
    for name, piece in run.workpieces.items():
        surface, time, fields = workpiece_surface(name, piece), None, {}
        if shaped is not None and tool is not None:
            height, time = shaped.nearest_to(piece.points)
            above = piece.points[:, 2] - height
            fields = {_ABOVE: 1e3 * np.where(above > -_UNTOUCHED * tool.diameter, above, np.nan)}
        points = world_from_part.points(surface.points)
        fields = {**fields, **surface.fields}
        yield replace(surface, name=shown_name(name), points=points, time=time, fields=fields)
    if shaped is not None and not run.workpieces:
        points = world_from_part.points(shaped.points)
        yield SceneSurface("", points, shaped.triangles, time=shaped.time)


def tracks_of(robot: StoredRobot) -> list[SceneTrack]:
    """Return the paths of one robot's tool that a run has, as pictures show them."""
    return [track(name, robot.desired, path) for name, path in named_paths(robot).items()]


def named_paths(robot: StoredRobot) -> dict[str, ToolPath]:
    """Return the paths of one robot's tool that a run has, by what pages call them.

    That on a robot to be expected stands before that on the file's, as pages show the first two.
    """
    stage, path = next(iter(robot.actual.items()))
    paths = {stage: path}
    if robot.expected is not None:
        paths[EXPECTED] = robot.expected
    paths |= robot.actual | robot.on_other_robots
    return {shown_name(name): path for name, path in paths.items()}


def track(name: str, desired: ToolPath, actual: ToolPath) -> SceneTrack:
    """Return a tool's path beside the desired one with as few rows as show it.

    Args:
        desired, actual: Paths of one tool at the same times.
    """
    signed = signed_deviation(desired, actual)
    position, deviation = desired.position[0], (actual.position - desired.position)[0]
    extent = max(float(np.ptp(position, axis=0).max()), _LEAST)
    largest = max(float(np.abs(deviation).max()), _SEEN)
    errors = np.repeat([_POSITION * extent, _DEVIATION * largest], [3, 4])
    values = np.hstack([position, deviation, signed[:, :1]])
    rows = rows_within(desired.time, values, errors, _MOST)
    rows = np.union1d(rows, np.linalg.norm(deviation, axis=1).argmax())
    return SceneTrack(name, desired.time[rows], position[rows], deviation[rows], signed[rows])


def _robots(run: StoredRun, case: Mapping[str, Any]) -> Iterator[SceneRobot]:
    results = {result.name: result for result in run.figures.robots}
    for name, stored in run.robots.items():
        result = results.get(name)
        if result is None or result.chain is None:  # of an earlier version
            continue
        table = case.get("robot" if name == FORMING else name, {})
        description = _description(table)
        torque = None
        if description is not None:
            frame = Frame.of_pose(result.chain.base_pose)
            torque = _gear_torque(
                description, result.torque_curve, stored.joints, stored.wrench, frame
            )
        motion = thinned_motion(stored.joints, torque)
        reversals = [c for c in run.figures.reversals if c.robot in ("", name)]
        tool = tool_of(case.get("process" if name == FORMING else name, {}))
        yield scene_robot(result.title, result.chain, motion, reversals, tool, _file_of(table))


def scene_robot(
    name: str,
    chain: ChainResult,
    motion: SceneMotion,
    reversals: Sequence[BacklashReversal] = (),
    tool: SceneTool | None = None,
    description: str | None = None,
) -> SceneRobot:
    """Return a robot in space.

    Args:
        chain: Its joints.
        motion: Their motion.
        reversals: Passages of its gears through their backlash.
        tool: Shape of its tool.
        description: Its file, of which meshes are taken; None: links are drawn.
    """
    return SceneRobot(
        name=name,
        world_from_base=Frame.of_pose(chain.base_pose),
        origins=np.array(chain.origins_m),
        axes=np.array(chain.axes),
        body_from_tool=Frame.of_pose(chain.tool_pose),
        motion=motion,
        flanks=_flanks(reversals),
        tool=tool,
        meshes=() if description is None else robot_meshes(description),
    )


def thinned_motion(joints: JointPath, torque: np.ndarray | None = None) -> SceneMotion:
    """Return the motion of one robot's joints with as few rows as show it.

    Args:
        torque: Torques of the gears at its times [N m], (n, joints).
    """
    values = q = joints.q[0]
    errors = np.full(q.shape[1], _ANGLE)
    if torque is not None:
        values = np.hstack([q, torque])
        errors = np.append(errors, _TORQUE * np.abs(torque).max(axis=0) + _ROUND)
    rows = rows_within(joints.time, values, errors, _MOST)
    return SceneMotion(joints.time[rows], q[rows], None if torque is None else torque[rows])


def tool_of(table: Mapping[str, Any]) -> SceneTool | None:
    """Return the tool that a table of a case describes; None where it does not.

    Example:
        >>> tool_of({"cutter_diameter_m": 0.016})
        SceneTool(diameter=0.016, is_round=False)
    """
    for key, is_round in (("cutter_diameter_m", False), ("tool_diameter_m", True)):
        if isinstance(table.get(key), float):
            return SceneTool(table[key], is_round)
    return None


def _file_of(table: Mapping[str, Any]) -> str | None:
    name = table.get("description")
    return name if isinstance(name, str) else None


def _description(table: Mapping[str, Any]) -> Robot | None:
    """Return the robot of a case's table; None where its file is gone, which spoils no picture."""
    name = _file_of(table)
    try:
        return None if name is None else load_robot(find_robot(name))
    except ElasticRobotError:
        return None


def _gear_torque(
    robot: Robot, curve: str, joints: JointPath, wrench: WrenchHistory, world_from_base: Frame
) -> np.ndarray | None:
    """Return the torques of the gears at rest in every row [N m], (n, joints); None if not known.

    A command accelerates its drives to pass their backlash, which the links do not follow: what it would
    need of rigid gears says nothing.
    """
    try:
        moving = MovingRobot(robot, curve)
    except (CouplingError, ElasticRobotError, ValueError):
        return None
    model, chain, q = moving.model, build_chain(robot), joints.q[0]
    instants = np.clip(joints.time, wrench.time[0], wrench.time[-1])
    load = interpolate_rows(instants, wrench.time, wrench.wrench[0])
    to_base = world_from_base.rotation.inv()
    load = np.hstack([to_base.apply(load[:, :3]), to_base.apply(load[:, 3:])])
    theta = chain.theta(q)
    zero_rates, torque = np.zeros_like(theta), np.zeros_like(q)
    torque[:, np.asarray(model.gear_joint)] = -model.desk.loads(
        theta, zero_rates, zero_rates, load
    )[:, model.gears]
    return torque


def _flanks(reversals: Sequence[BacklashReversal]) -> dict[int, np.ndarray]:
    """Return at which flanks gears are from which time on, by the number of the joint from 0."""
    flanks: dict[int, list[tuple[float, float]]] = {}
    for change in sorted(reversals, key=lambda change: change.begins):
        gear = flanks.setdefault(change.joint - 1, [(-1e9, float(change.before))])
        gear += [(change.begins, 0.0), (change.ends, float(change.after))]
    return {joint: np.array(gear) for joint, gear in flanks.items()}


def part_frame(part: Mapping[str, Any]) -> Frame:
    """Return the placement of a part by the keys of [part]."""
    return Frame.of_rpy(part["position_m"], np.deg2rad(part["rpy_deg"]))
