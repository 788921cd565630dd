"""An iteration of Gauss and Newton's method for the links along a path, in C (`desk/link_path.h`)."""

from __future__ import annotations

import ctypes
import weakref
from dataclasses import dataclass

import numpy as np

from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import DeskRobot, address, finite_numbers

# Coefficients of a quintic spline that move a point between its nodes, and at a node.
REACH = 6
_AT_NODE = REACH - 1
_ORDERS = 3


@dataclass(frozen=True)
class DesiredPoses:
    """Desired poses of a tool and the wrench on it at k instants.

    Attributes:
        position: Position of the TCP [m], (k, 3).
        quaternion: Quaternions of base_from_tool, x, y, z, w [1], (k, 4).
        wrench: Wrench on the robot at the TCP, base axes [N, N m], (k, 6).
    """

    position: np.ndarray
    quaternion: np.ndarray
    wrench: np.ndarray

    def checked(self, what: str, count: int) -> DesiredPoses:
        """Return it as C reads it, of so many instants."""
        return DesiredPoses(
            finite_numbers(f"positions {what}", self.position, (count, 3)),
            finite_numbers(f"rotations {what}", self.quaternion, (count, 4)),
            finite_numbers(f"wrenches {what}", self.wrench, (count, 6)),
        )


@dataclass(frozen=True)
class EndConditions:
    """Combinations of neighbouring coefficients of an angle that are to have a value, c of them.

    Attributes:
        first: Number of the first coefficient, (c,).
        angle: Number of the angle, (c,).
        weights: Weights of five coefficients [1], (c, 5).
        target: Value of their sum [rad], (c,).
    """

    first: np.ndarray
    angle: np.ndarray
    weights: np.ndarray
    target: np.ndarray


@dataclass(frozen=True)
class LinkPath:
    """What the links are to do, node by node.

    Attributes:
        weights: Weights of coefficients for theta, theta', theta'' at a node, then in the middle of an
            interval, (2, 3, 6).
        nodes: Desired poses at the nodes, intervals + 1 of them.
        middles: The same in the middles of the outermost intervals, first those at the start, (2 e,).
        rigid: Coefficients of the joints of the rigid robot [rad], (intervals + 5, joints).
        balance: Weight of a torque missing in each tilt [1/(N m)], (tilts,).
        of_position, of_rotation: Weights of errors of the pose [1/m], [1/rad].
        of_acceleration, of_angle: Weights of the joints' acceleration and angle less those of the rigid
            robot [s^2/rad], [1/rad].
        ends: Conditions at the ends.
    """

    weights: np.ndarray
    nodes: DesiredPoses
    middles: DesiredPoses
    rigid: np.ndarray
    balance: np.ndarray
    of_position: float
    of_rotation: float
    of_acceleration: float
    of_angle: float
    ends: EndConditions

    @property
    def intervals(self) -> int:
        """Number of intervals between nodes."""
        return len(self.nodes.position) - 1


class _Task(ctypes.Structure):
    """er_link_task of desk/link_path.h."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("intervals", "edge")),
        *(
            (name, ctypes.c_void_p)
            for name in (
                *("weights", "position", "quaternion", "wrench"),
                *("middle_position", "middle_quaternion", "middle_wrench", "rigid", "balance"),
            )
        ),
        *(
            (name, ctypes.c_double)
            for name in ("of_position", "of_rotation", "of_acceleration", "of_angle")
        ),
        ("conditions", ctypes.c_int64),
        *(
            (name, ctypes.c_void_p)
            for name in (
                "condition_first",
                "condition_angle",
                "condition_weights",
                "condition_target",
            )
        ),
    )


class GaussNewtonStep(ctypes.Structure):
    """An iteration of Gauss and Newton's method for the links: er_link_report of desk/link_path.h.

    Attributes:
        position, rotation: Largest error of the tool's pose before the iteration [m], [rad].
        torque: Largest torque missing in a tilt before it [N m].
        step: Largest change of an angle in it [rad].
        cut: Largest difference of changes that were solved for twice, behind a cut [rad].
    """

    _fields_ = tuple(
        (name, ctypes.c_double) for name in ("position", "rotation", "torque", "step", "cut")
    )


class LinkIterations:
    """Iterations for the links of a robot.

    Args:
        robot: The robot.
        path: Desired motion of its links.
        lag: Nodes over which the end of what is solved at once is taken to die out.

    Raises:
        ValueError: If an array has another shape than the others ask for, or is not finite.
        MemoryError: If the factors of a part of the path do not fit into memory.
    """

    def __init__(self, robot: DeskRobot, path: LinkPath, lag: int) -> None:
        count, edge = path.intervals, len(path.middles.position) // 2
        joints, angles, tilts = robot.sizes
        self._shape = count + REACH - 1, angles
        nodes = path.nodes.checked("at the nodes", count + 1)
        middles = path.middles.checked("in the middles", 2 * edge)
        ends, conditions = path.ends, len(path.ends.first)
        first, angle = (np.ascontiguousarray(v, dtype=np.int64) for v in (ends.first, ends.angle))
        if 2 * edge > count or lag < REACH:
            raise ValueError(f"expected fewer middles than intervals, got {2 * edge} of {count}")
        if not (np.isin(first, (0, count)).all() and ((angle >= 0) & (angle < angles)).all()):
            raise ValueError("expected conditions at the ends of the path on angles of the chain")
        arrays = (
            finite_numbers("weights", path.weights, (2, _ORDERS, REACH)),
            *(nodes.position, nodes.quaternion, nodes.wrench),
            *(middles.position, middles.quaternion, middles.wrench),
            finite_numbers("rigid robot", path.rigid, (count + REACH - 1, joints)),
            finite_numbers("balance", path.balance, (tilts,)),
        )
        at_ends = (
            *(first, angle.reshape(first.shape)),
            finite_numbers("conditions", ends.weights, (conditions, _AT_NODE)),
            finite_numbers("conditions", ends.target, (conditions,)),
        )
        of = path.of_position, path.of_rotation, path.of_acceleration, path.of_angle
        # The arrays stay as long as C reads them.
        self._read = robot, arrays, at_ends
        self._task = _Task(
            count, edge, *map(address, arrays), *of, conditions, *map(address, at_ends)
        )
        self._library = loaded_library()
        handle = self._library.er_link_iterations_create(robot.handle, ctypes.c_int64(lag))
        if not handle:
            raise MemoryError("the links' equations of motion do not fit into memory")
        self._handle = ctypes.c_void_p(handle)
        weakref.finalize(self, self._library.er_link_iterations_free, self._handle)

    def change(
        self, coefficients: np.ndarray, damping: float = 0.0
    ) -> tuple[np.ndarray, GaussNewtonStep] | None:
        """Return an iteration's change of coefficients [rad], (intervals + 5, angles), and its figures.

        None where rounding has left no positive definite matrix.

        Args:
            coefficients: The motion before the iteration [rad], (intervals + 5, angles).
            damping: Part of the matrix's diagonal that is added to it.
        """
        motion = finite_numbers("coefficients", coefficients, self._shape)
        step, report = np.empty_like(motion), GaussNewtonStep()
        solved = self._library.er_link_iterations_improve(
            self._handle,
            ctypes.byref(self._task),
            address(motion),
            ctypes.c_double(damping),
            address(step),
            ctypes.byref(report),
        )
        return (step, report) if solved else None
