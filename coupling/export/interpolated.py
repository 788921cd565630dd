"""What a controller makes of a program: the motion of the drives, from the text alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import ProgramError
from coupling.export.curves import JointCurve, PoseCurve, SampledCurve, continuous
from coupling.export.frames import controller_from_base, with_tool
from coupling.export.spline_points import spline_values
from coupling.files.controller_axes import ControllerAxes
from coupling.path.controller import Controller
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.path.joint_path import JointPath
from coupling.programs.program import HERE, ProgramMove, RobotProgram
from coupling.robot.inverse_kinematics import InverseKinematics
from elastic_robot.description import Robot

# Position [m] and rotation [rad] agree to this where a pose is reached; steps at most; a Jacobian is
# inverted whose smallest singular value is larger than this.
_POSE_TOLERANCE, _MAX_ITERATIONS, _MIN_SINGULAR_VALUE = 1e-10, 6, 1e-4


@dataclass(frozen=True)
class NearAngles:
    """Drive angles near those of set points, from which Newton's method finds these.

    Attributes:
        q: Angles [rad], (n, 6).
        inverses: Inverses of the Jacobians of TCP [m/rad] and rotation [rad/rad] there, (n, 6, 6).
    """

    q: np.ndarray
    inverses: np.ndarray

    @classmethod
    def of(cls, q: np.ndarray, jacobians: np.ndarray) -> NearAngles | None:
        """Return them; None where a Jacobian is none that is inverted.

        Args:
            q: Angles [rad], (n, joints).
            jacobians: Jacobians there [m/rad], [rad/rad], (n, 6, joints).
        """
        if q.shape[1] != 6:
            return None
        try:
            inverses = np.linalg.inv(jacobians)
        except np.linalg.LinAlgError:
            return None
        # The norm of an inverse is at least one over the smallest singular value.
        largest = float(np.linalg.norm(inverses, axis=(1, 2)).max())
        return cls(q, inverses) if largest * _MIN_SINGULAR_VALUE < 1.0 else None

    def solve(self, planner: InverseKinematics, path: ToolPath) -> JointPath | None:
        """Return the joint angles of a path; None if it has other set points, or if the method fails.

        All set points go on together, with the Jacobians of where they begin.

        Args:
            planner: Inverse kinematics of the robot with the tool that takes the path.
        """
        if len(self.q) != len(path.time):
            return None
        q = self.q
        for _ in range(_MAX_ITERATIONS):
            off = path.deviation_from(ToolPath(path.time, planner.poses(q)))[0]
            if np.abs(off).max() < _POSE_TOLERANCE:
                return JointPath(path.time, (q,))
            q = q + np.einsum("nij,nj->ni", self.inverses, off)
        return None


def drive_motion(
    program: RobotProgram,
    robot: Robot,
    axes: ControllerAxes,
    cycle: float,
    start: float,
    near: NearAngles | None = None,
) -> JointPath:
    """Return the motion of a robot's drives under the timed motions of a program.

    The controller's interpolator gives set points on a cycle: between the targets straight or on the C2
    cubic spline through them that rests at both ends, poses with a quaternion that is normalised, and
    it does not blend.  Poses become joint angles by the rigid robot's inverse kinematics with the tool
    that the program states.  The drives follow the C2 cubic spline through the set points.

    Args:
        cycle: Time between set points [s].
        start: Time at which the timed motions begin [s].
        near: Angles near those of every set point; saves time, no more.
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
        values = spline_values(time, angles, at) if spline else _straight(curve, time, at)
        return JointPath(at, (values,))
    rows = np.array([move.pose for move in timed])
    rows[:, 3:] = continuous(rows[:, 3:])
    values = spline_values(time, rows, at) if spline else _straight(PoseCurve(rows, 0.0), time, at)
    values[:, 3:] /= np.linalg.norm(values[:, 3:], axis=1, keepdims=True)
    base_from_path = controller_from_base(axes).inverse() @ Frame.of_pose(program.base or HERE)
    in_base = ToolPath(at, values).transformed(base_from_path)
    carrying = with_tool(robot, Frame.of_pose(program.tool or HERE), axes)
    home = axes.file_angles(np.array([_home(program)]))[0]
    planner = InverseKinematics(_remove_limits(carrying), home)
    joints = None if near is None else near.solve(planner, in_base)
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
