"""What a controller makes of a program: the motion of the drives, from the text alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from coupling.errors import ProgramError
from coupling.export.curves import JointCurve, PoseCurve, SampledCurve, continuous
from coupling.export.frames import controller_from_base, with_tool
from coupling.export.postures import Postures
from coupling.export.spline_points import spline_values
from coupling.files.controller_axes import ControllerAxes
from coupling.path.controller import Controller
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.path.joint_path import JointPath
from coupling.programs.program import HERE, ProgramMove, RobotProgram
from coupling.robot.inverse_kinematics import InverseKinematics
from elastic_robot.description import Robot

Smooth = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def drive_motion(
    program: RobotProgram,
    robot: Robot,
    axes: ControllerAxes,
    cycle: float,
    start: float,
    near: np.ndarray | None = None,
    smooth: Smooth = spline_values,
) -> JointPath:
    """Return the motion of a robot's drives under the timed motions of a program.

    The controller's interpolator gives set points on a cycle: between the targets straight or on the C2
    cubic spline through them that rests at both ends, poses with a quaternion that is normalised, and
    it does not blend.  Poses become joint angles by the rigid robot's inverse kinematics with the tool
    that the program states.  The drives follow the C2 cubic spline through the set points.

    Args:
        cycle: Time between set points [s].
        start: Time at which the timed motions begin [s].
        near: Drive angles near those of every set point [rad], (n, joints); saves time, no more.
        smooth: Function taken for the maker's spline, from times and values of the targets and the times
            that are asked for.
    """
    timed = program.timed
    motions = {move.motion for move in timed[1:]}
    if len(timed) < 2 or len(motions) != 1 or any(move.duration is None for move in timed[1:]):
        raise ProgramError(
            f"{program.name}: expected a start and then timed motions of one kind, got"
            f" {len(timed) - 1} of {', '.join(sorted(motions)) or 'none'}"
        )
    time = start + np.cumsum([0.0, *(move.duration or 0.0 for move in timed[1:])])
    at = Controller(cycle).rows(time[0], time[-1])
    at[-1] = time[-1]
    if at[-1] - at[-2] < _SHORTEST_CYCLE * cycle:
        at = np.delete(at, -2)
    spline = motions == {"spline"}
    if any(move.pose is None for move in timed):
        angles = axes.file_angles(np.array([_joints(move, program) for move in timed]))
        curve = JointCurve(angles, np.empty(0), 0.0)
        values = smooth(time, angles, at) if spline else _straight(curve, time, at)
        return JointPath(at, (values,))
    rows = np.array([move.pose for move in timed])
    rows[:, 3:] = continuous(rows[:, 3:])
    values = smooth(time, rows, at) if spline else _straight(PoseCurve(rows, 0.0), time, at)
    values[:, 3:] /= np.linalg.norm(values[:, 3:], axis=1, keepdims=True)
    base_from_path = controller_from_base(axes).inverse() @ Frame.of_pose(program.base or HERE)
    in_base = ToolPath(at, values).transformed(base_from_path)
    carrying = with_tool(robot, Frame.of_pose(program.tool or HERE), axes)
    home = axes.file_angles(np.array([_home(program)]))[0]
    planner = InverseKinematics(_remove_limits(carrying), home)
    joints = None if near is None else _found_near(planner, carrying, axes, in_base, near)
    return planner.plan(in_base) if joints is None else joints


def joint_lines(motion: JointPath) -> JointPath:
    """Return a motion whose drives go straight from set point to set point.

    This is a controller that does not smooth.  Around each set point a short quintic joins the rates on
    both sides.

    Example:
        >>> rows = JointPath(np.array([0.0, 0.1, 0.2]), (np.array([[0.0], [1.0], [1.0]]),))
        >>> joint_lines(rows).trajectory.at(np.array([0.05, 0.15]))[0].ravel().round(12)
        array([0.5, 1. ])
    """
    time, (q,) = motion.time, motion.q
    steps = np.diff(time)
    rates = np.diff(q, axis=0) / steps[:, None]
    joins = _JOINED_PART * np.minimum(steps, steps.min())
    after, before = time[:-1] + joins, time[1:] - joins
    rows = np.column_stack([after, before]).ravel()
    values = np.stack([q[:-1] + joins[:, None] * rates, q[1:] - joins[:, None] * rates], axis=1)
    speeds = np.repeat(rates, 2, axis=0)
    rest_rates = np.zeros((1, q.shape[1]))
    return JointPath(
        np.concatenate([time[:1], rows, time[-1:]]),
        (np.concatenate([q[:1], values.reshape(-1, q.shape[1]), q[-1:]]),),
        (np.concatenate([rest_rates, speeds, rest_rates]),),
        (np.zeros((len(rows) + 2, q.shape[1])),),
    )


# Part of a cycle within which straight ways are joined.
_JOINED_PART = 0.05


def _found_near(
    planner: InverseKinematics,
    robot: Robot,
    axes: ControllerAxes,
    path: ToolPath,
    near: np.ndarray,
) -> JointPath | None:
    """Return the joint angles of a path by Newton's method from angles near it, None if it fails.

    All set points go on together, with the Jacobians of where they begin.
    """
    if near.shape != (len(path.time), 6):
        return None
    jacobians = Postures(robot, axes).jacobians(near)
    if np.linalg.svd(jacobians, compute_uv=False)[:, -1].min() < _MIN_SINGULAR_VALUE:
        return None
    q = near.copy()
    for _ in range(_MAX_ITERATIONS):
        off = path.deviation_from(ToolPath(path.time, planner.poses(q)))[0]
        if np.abs(off).max() < _POSE_TOLERANCE:
            return JointPath(path.time, (q,))
        q = q + np.linalg.solve(jacobians, off[..., None])[..., 0]
    return None


# Position [m] and rotation [rad] agree to this where a pose is reached; steps at most; smallest singular
# value of a Jacobian that is solved.
_POSE_TOLERANCE, _MAX_ITERATIONS, _MIN_SINGULAR_VALUE = 1e-10, 6, 1e-4


# A last cycle shorter than this part of one is joined to the one before it.
_SHORTEST_CYCLE = 0.5


def _straight(curve: SampledCurve, time: np.ndarray, at: np.ndarray) -> np.ndarray:
    after = np.searchsorted(time, at, side="left").clip(1, len(time) - 1)
    before = after - 1
    share = ((at - time[before]) / (time[after] - time[before])).clip(0.0, 1.0)
    return curve.between(curve.values[before], curve.values[after], share)


def _joints(move: ProgramMove, program: RobotProgram) -> tuple[float, ...]:
    if move.joints is None:
        raise ProgramError(f"{program.name}: expected either poses or joint angles, got both")
    return move.joints


def _home(program: RobotProgram) -> tuple[float, ...]:
    """Return the controller's joint angles at the start of the path."""
    angles = [move.joints for move in program.moves if move.joints is not None]
    angles += [m.configuration.angles for m in program.timed[:1] if m.configuration is not None]
    if not angles:
        raise ProgramError(
            f"{program.name}: expected a motion to joint angles before the path, got none"
        )
    return angles[-1]


def _remove_limits(robot: Robot) -> Robot:
    """Return a robot whose joints have no limits, which are checked for themselves."""
    return replace(robot, joints=tuple(replace(joint, limits=None) for joint in robot.joints))
