"""A robot in the desk library: loads, poses and masses of its chain at many instants."""

from __future__ import annotations

import ctypes
import weakref
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from coupling.native.desk_library import loaded_library
from coupling.native.robot_text import MOST_JOINTS, robot_text
from elastic_robot.description import Joint, Robot
from elastic_robot.errors import RobotFileError
from elastic_robot.torque_curves import TORQUE_CURVES

# Damping of a step towards a pose: as a part of the squared error (Levenberg-Marquardt, Sugihara 2011,
# eq. (33)), and what keeps the inverse of a singular matrix finite.
DAMPING, LEAST_DAMPING = 1e-3, 1e-12
# Largest change of a joint in one step [rad]: the linearisation holds no further.
LARGEST_STEP = 0.3
_MESSAGE = 400


def numbers(name: str, values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return an array as C reads it: doubles of a given shape, in its unit.

    Args:
        name: Name of the array, for the message.
        values: Array of that shape, any unit.
        shape: The shape that it must have.

    Raises:
        ValueError: If it has another shape.
    """
    rows = np.ascontiguousarray(values, dtype=np.float64)
    if rows.shape != shape:
        raise ValueError(f"{name}: expected an array of shape {shape}, got {rows.shape}")
    return rows


def finite_numbers(name: str, values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return an array of a shape as `numbers` does, in its unit, and refuse what is not finite.

    Args:
        name: Name of the array, for the message.
        values: Array of that shape, any unit.
        shape: The shape that it must have.

    Raises:
        ValueError: If it has another shape, or is not finite.
    """
    rows = numbers(name, values, shape)
    if not np.isfinite(rows).all():
        raise ValueError(f"{name}: expected finite numbers, got {rows[~np.isfinite(rows)][0]}")
    return rows


def address(values: np.ndarray) -> ctypes.c_void_p:
    """Return where the numbers of an array begin; the caller keeps the array.

    Args:
        values: Array as `numbers` returns it, any unit and shape.
    """
    return ctypes.c_void_p(values.ctypes.data)


class ReachRules(ctypes.Structure):
    """Rules by which poses are approached, by damped least squares: er_reach_rules of desk/reach.h.

    Attributes:
        tolerance: A step is the last one where position [m] and rotation vector [rad] were off by less.
        iterations: Steps at most.
        damping: Damping as a part of the squared error [1].
        least: Damping that there always is [1].
        largest_step: Largest change of a joint in a step [rad].
    """

    _fields_ = (
        ("tolerance", ctypes.c_double),
        ("iterations", ctypes.c_int64),
        *((name, ctypes.c_double) for name in ("damping", "least", "largest_step")),
    )

    @classmethod
    def usual(cls, tolerance: float, iterations: int) -> ReachRules:
        """Return the rules with the damping and the largest step of this module."""
        return cls(tolerance, iterations, DAMPING, LEAST_DAMPING, LARGEST_STEP)


@dataclass(frozen=True)
class ReachedAngles:
    """Angles under which a tool is at poses.

    Attributes:
        theta: Angles of the chain [rad], (k, angles).
        error: Norm of what position [m] and rotation vector [rad] were off before the last step, (k,).
        away: Smallest distance of the TCP from its place on the way [m], (k,).
    """

    theta: np.ndarray
    error: np.ndarray
    away: np.ndarray


class LinearisedChain(NamedTuple):
    """Loads of a chain of n angles at k instants, their derivatives, and its tool.

    Attributes:
        load: M theta'' + h - J^T w, balancers taken off [N m], (k, n).
        by_motion: Its derivatives by theta, theta', theta'' [N m/rad, ..], (k, 3, n, n).
        jacobian: Jacobian of the TCP, base axes [m/rad, rad/rad], (k, 6, n).
        position: Position of the TCP [m], (k, 3).
        rotation: base_from_tool [1], (k, 3, 3).
    """

    load: np.ndarray
    by_motion: np.ndarray
    jacobian: np.ndarray
    position: np.ndarray
    rotation: np.ndarray


class DeskRobot:
    """The chain of a robot, in C.

    Args:
        robot: The robot; what its gears and motors do is none of the chain's.
        plain: Whether plain C is used where the processor could do better.

    Attributes:
        handle: Its address in the library.
        sizes: Numbers of joints, of angles of the chain and of tilts.

    Raises:
        RobotFileError: If it has more joints than the library holds.
        CompilerError: If the library is neither shipped nor can be compiled here.
    """

    def __init__(self, robot: Robot, plain: bool = False) -> None:
        if len(robot.joints) > MOST_JOINTS:
            raise RobotFileError(
                f"{robot.name}: expected at most {MOST_JOINTS} joints for the inverse, got"
                f" {len(robot.joints)}: leave out joints that stand still"
            )
        self._robot, self._library = robot, loaded_library()
        chain = replace(robot, joints=tuple(map(_of_chain, robot.joints)))
        self.handle = _handle_of(self, chain, plain)
        elastic = [joint.stiffness is not None for joint in robot.joints]
        tilts = sum(len(joint.tilt) for joint in robot.joints)
        self.sizes = len(robot.joints), len(robot.joints) + tilts, tilts
        self._angles, self._elastics = self.sizes[1], sum(elastic) + tilts

    def __reduce__(self) -> tuple[type[DeskRobot], tuple[Robot]]:
        return DeskRobot, (self._robot,)

    def loads(
        self, theta: np.ndarray, rate: np.ndarray, acceleration: np.ndarray, wrench: np.ndarray
    ) -> np.ndarray:
        """Return M theta'' + h - J^T w, balancers taken off [N m], (k, angles).

        Args:
            theta, rate, acceleration: Motion of all angles of the chain [rad, rad/s, rad/s^2],
                (k, angles) each.
            wrench: Wrench on the robot at the TCP, base axes [N, N m], (k, 6).
        """
        motion = self._motion(theta, rate, acceleration, wrench)
        load = np.empty_like(motion[0])
        self._call("er_desk_loads", *motion, load)
        return load

    def linearised(
        self, theta: np.ndarray, rate: np.ndarray, acceleration: np.ndarray, wrench: np.ndarray
    ) -> LinearisedChain:
        """Return the loads [N m], (k, n), their derivatives, Jacobian and pose; arguments as `loads`."""
        motion = self._motion(theta, rate, acceleration, wrench)
        count, n = motion[0].shape
        shapes = ((n,), (3, n, n), (6, n), (3,), (3, 3))
        linearised = LinearisedChain(*(np.empty((count, *shape)) for shape in shapes))
        self._call("er_desk_linearise", *motion, *linearised)
        return linearised

    def placements(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return position [m], (k, 3), and rotation base_from_tool of the TCP, (k, 3, 3).

        Args:
            theta: Angles of the chain [rad], (k, angles).
        """
        angles = numbers("angles", theta, (len(theta), self._angles))
        position, rotation = np.empty((len(angles), 3)), np.empty((len(angles), 3, 3))
        self._call("er_desk_place", angles, position, rotation)
        return position, rotation

    def reach(
        self, rules: ReachRules, position: np.ndarray, quaternion: np.ndarray, theta: np.ndarray
    ) -> ReachedAngles:
        """Return angles of the chain with the TCP at poses; of those given the joints' alone change.

        Args:
            rules: Rules by which the poses are approached.
            position: Positions of the TCP [m], (k, 3).
            quaternion: Quaternions of base_from_tool, x, y, z, w [1], (k, 4).
            theta: Angles of the chain to begin with [rad], (k, angles).
        """
        count = len(theta)
        poses = (
            finite_numbers("positions", position, (count, 3)),
            finite_numbers("quaternions", quaternion, (count, 4)),
        )
        angles = finite_numbers("angles", theta, (count, self._angles)).copy()
        error, away = np.empty(count), np.empty(count)
        self._library.er_desk_reach(
            self.handle,
            ctypes.byref(rules),
            ctypes.c_int64(count),
            *map(address, (*poses, angles, error, away)),
        )
        return ReachedAngles(angles, error, away)

    def masses(self, theta: np.ndarray) -> np.ndarray:
        """Return the mass matrices of the elastic coordinates [kg m^2], (k, m, m).

        Args:
            theta: Angles of the chain [rad], (k, angles).
        """
        angles = numbers("angles", theta, (len(theta), self._angles))
        mass = np.empty((len(angles), self._elastics, self._elastics))
        self._call("er_desk_masses", angles, mass)
        return mass

    def _motion(
        self, theta: np.ndarray, rate: np.ndarray, acceleration: np.ndarray, wrench: np.ndarray
    ) -> list[np.ndarray]:
        shape = len(theta), self._angles
        names = ("angles", "rates", "accelerations")
        motion = zip(names, (theta, rate, acceleration), strict=True)
        rows = [numbers(name, values, shape) for name, values in motion]
        return [*rows, numbers("wrenches", wrench, (len(theta), 6))]

    def _call(self, name: str, *arrays: np.ndarray) -> None:
        count = ctypes.c_int64(len(arrays[0]))
        getattr(self._library, name)(self.handle, count, *map(address, arrays))


class DeskRest:
    """Rest of a robot in C, its gears from unloaded: as `elastic_robot.statics.equilibrium`.

    Args:
        robot: The robot; its kinematic errors and motors have no effect.
        torque_curve: Name of its gears' torque curve.

    Raises:
        RobotFileError: If it has more joints, points or elements than the library holds.
        CompilerError: If the library is neither shipped nor can be compiled here.
    """

    def __init__(self, robot: Robot, torque_curve: str) -> None:
        joints = (replace(joint, kinematic_error=(), drive=None) for joint in robot.joints)
        self._handle = _handle_of(self, replace(robot, joints=tuple(joints)))
        self._law = list(TORQUE_CURVES).index(torque_curve)
        tilts = sum(len(joint.tilt) for joint in robot.joints)
        gears = sum(joint.stiffness is not None for joint in robot.joints)
        self._joints, self._elastics = len(robot.joints), gears + tilts

    def at(self, q: np.ndarray, wrench: np.ndarray) -> np.ndarray | None:
        """Return the elastic coordinates at rest [rad], (m,); None if there is no rest.

        Args:
            q: Angles of the gears' outputs without wind-up [rad], (joints,).
            wrench: Wrench on the robot at the TCP, base axes [N, N m], (6,).
        """
        given = (
            finite_numbers("angles", q, (self._joints,)),
            finite_numbers("wrench", wrench, (6,)),
        )
        x = np.empty(self._elastics)
        law = ctypes.c_int64(self._law)
        rests = loaded_library().er_desk_rest(self._handle, law, *map(address, (*given, x)))
        return x if rests else None


def _handle_of(owner: object, robot: Robot, plain: bool = False) -> ctypes.c_void_p:
    """Return the address of a robot in the library, freed when its owner is no longer used."""
    library, message = loaded_library(), ctypes.create_string_buffer(_MESSAGE)
    create = library.er_desk_create_plain if plain else library.er_desk_create
    handle = create(robot_text(robot, "{desk}").encode(), message)
    if not handle:
        raise RobotFileError(f"{robot.name}: {message.value.decode(errors='replace')}")
    address_of_robot = ctypes.c_void_p(handle)
    weakref.finalize(owner, library.er_desk_free, address_of_robot)
    return address_of_robot


def _of_chain(joint: Joint) -> Joint:
    """Return a joint without what acts between motor and gear."""
    return replace(joint, torque_table=None, hysteresis=(), kinematic_error=(), drive=None)
