"""Motors with rotor, friction and servo: drives that do not follow their command exactly.

    J q'' = tau - (1 + eps'(q)) T - f(T, s, q')       T: torque of the gear on its link
    tau = sat(Kp w + z),   z' = Ki w,   w = Kv (q_cmd - q) + kff q_cmd' - q'

f is `Drive.friction_torque`, whose elongation s over q is one more stop element (`hysteresis.py`).  At
the torque limit z' = 0 where w would lead on beyond it.  Where the torque would go beyond the limit if z
grew and fall behind it if z waited, z grows as much as keeps it there (Filippov's solution).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from elastic_robot.chain import Chain
from elastic_robot.description import Robot
from elastic_robot.drive import Drive
from elastic_robot.errors import ParameterError
from elastic_robot.hysteresis import Elements, Hysteresis
from elastic_robot.kinematic_errors import KinematicErrors

IDEAL: Literal["ideal"] = "ideal"
DriveKind = Literal["ideal", "servo", "torque"]
DRIVES: tuple[DriveKind, ...] = get_args(DriveKind)
# What z does: it grows as w has it, waits at the torque limit, or keeps the torque there.
_GROWS, _WAITS, _KEEPS = 0, 1, 2
# Part of the torque limit within which a torque is at it, and which a rate there must be in a second.
_AT_LIMIT = 1e-9
_STILL = 1e-9  # w that is as good as none, found to the spacing of times only [rad/s]


@dataclass(frozen=True)
class MotorState:
    """Motors at a time.

    Attributes:
        angle, rate: q and q' [rad, rad/s], (d,).
        integral: z [N m], (d,).
        presliding: Elongation s of the friction [rad], (d,).
    """

    angle: np.ndarray
    rate: np.ndarray
    integral: np.ndarray
    presliding: np.ndarray


NO_MOTORS = MotorState(*np.zeros((4, 0)))


@dataclass(frozen=True)
class MotorInstant:
    """What motors do in a state.

    Attributes:
        rate_error, turning: w and w' [rad/s, rad/s^2], (d,).
        torque_command, torque: Kp w + z, and tau [N m], (d,).
        acceleration: q'' [rad/s^2], (d,).
    """

    rate_error: np.ndarray
    turning: np.ndarray
    torque_command: np.ndarray
    torque: np.ndarray
    acceleration: np.ndarray

    @property
    def heading(self) -> np.ndarray:
        """Sign of w a little later, where w itself turns at least, in any unit, (d,)."""
        return np.where(np.abs(self.rate_error) <= _STILL, self.turning, self.rate_error)


# What there is to say of a robot without moving motors, asked for in every evaluation.
NO_INSTANT = MotorInstant(*np.zeros((5, 0)))


class DriveColumns(Drive):
    """All drives side by side: each number is an array, (d,), nan where there is no torque limit."""

    @classmethod
    def of(cls, drives: Sequence[Drive]) -> DriveColumns:
        """Return those of drives."""
        rows = np.array([astuple(drive) for drive in drives], dtype=float)
        return cls(*rows.reshape(-1, len(fields(Drive))).T)

    def __post_init__(self) -> None:
        """The drives were looked at one by one."""


@dataclass(frozen=True)
class Motors:
    """The motors of a robot that move by themselves, d of them, none under ideal drives.

    Attributes:
        drives: Their numbers.
        joint: Number of the joint of each, from 0, (d,).
        gear: Index of its gear's wind-up among the elastic coordinates, (d,).
        friction: F of each, which may be tuned [N m], (d,).
        errors: Kinematic errors of all gears.
        servo: Whether they have their servos; else they are given torques.
    """

    drives: tuple[Drive, ...]
    joint: np.ndarray
    gear: np.ndarray
    friction: np.ndarray
    errors: KinematicErrors
    servo: bool

    @classmethod
    def of(cls, robot: Robot, chain: Chain, friction: np.ndarray, kind: str) -> Motors:
        """Return those of a robot's description, `friction` [N m] of all its drives, (d,)."""
        moving = [(i, j.drive) for i, j in enumerate(robot.joints) if j.drive and kind != IDEAL]
        joint = np.array([i for i, _ in moving], dtype=int)
        gear = chain.torsions[np.searchsorted(chain.elastic_joint[chain.torsions], joint)]
        drives = tuple(drive for _, drive in moving)
        errors = chain.kinematic_errors
        return cls(drives, joint, gear, friction[: len(drives)], errors, kind == "servo")

    def with_friction(self, hysteresis: Hysteresis) -> Hysteresis:
        """Return a law over x and q, (m + d,): the elements of the gears, then each motor's friction.

        Its torques and slopes are of use where the gears' are.
        """
        if not self.drives:
            return hysteresis
        of, m, unit_share = (
            hysteresis.elements,
            len(hysteresis.slip_torque),
            np.ones(len(self.drives)),
        )
        elements = Elements(
            np.append(of.coordinate, m + np.arange(len(unit_share))),
            np.append(of.number, unit_share.astype(int)),
            np.append(of.slip_angle, self._each.slip_angle),
            np.append(of.share, unit_share),
        )
        slips = self.friction + self._each.load_friction
        return Hysteresis(elements, np.append(hysteresis.slip_torque, slips))

    def joined(self, commands: np.ndarray, motors: np.ndarray) -> np.ndarray:
        """Return the motion of all drives from their commands and that of the motors.

        In any unit, (..., n) from (..., n) and (..., d).
        """
        joined = commands.copy()
        joined[..., self.joint] = motors
        return joined

    def at(
        self,
        commands: np.ndarray,
        state: MotorState,
        gear_torque: np.ndarray,
        commanded_torque: np.ndarray,
    ) -> MotorInstant:
        """Return what the motors do.

        Args:
            commands: q, q', q'' of all drives' commands [rad, rad/s, rad/s^2], (3, n).
            gear_torque: S + H + d x' of all elastic coordinates, -T of gears [N m], (m,).
            commanded_torque: Torques of motors without servo [N m], (d,).
        """
        (q, qd, qdd), gears = commands[:, self.joint], gear_torque[self.gear]
        each = self._each
        k_v, forward = each.position_gain, each.feed_forward
        rate_error = k_v * (q - state.angle) + forward * qd - state.rate
        torque_command = (
            each.rate_gain * rate_error + state.integral if self.servo else commanded_torque
        )
        torque = (
            np.minimum(np.maximum(torque_command, -self.limit), self.limit)
            if self.servo
            else commanded_torque
        )
        rise = self.errors.slope(self.joined(commands[0], state.angle))[self.joint]
        part = state.presliding / each.slip_angle
        friction = each.friction_torque(self.friction, part, state.rate, gears)
        acceleration = (torque + rise * gears - friction) / each.inertia
        turning = k_v * (qd - state.rate) + forward * qdd - acceleration
        return MotorInstant(rate_error, turning, torque_command, torque, acceleration)

    def modes(self, now: MotorInstant) -> np.ndarray:
        """Return the numbers of what z does from a state on, (d,)."""
        if not self.servo:
            return np.full(len(self.drives), _WAITS)
        side, room = np.sign(now.torque_command), self.room(now)
        onwards = side * now.heading > 0.0
        is_beyond = room < -_AT_LIMIT * self.limit
        at_limit = (np.abs(room) <= _AT_LIMIT * self.limit) & np.isfinite(self.limit)
        waiting, growing = side * self._by(now, _WAITS), side * self._by(now, _GROWS)
        falls = waiting < -_AT_LIMIT * self.limit
        waits = onwards & (is_beyond | (at_limit & ~falls))
        keeps = onwards & at_limit & falls & (growing > _AT_LIMIT * self.limit)
        return np.where(waits, _WAITS, np.where(keeps, _KEEPS, _GROWS))

    def growth(self, now: MotorInstant, modes: np.ndarray) -> np.ndarray:
        """Return z' [N m/s], (d,)."""
        keeps = np.where(modes == _KEEPS, -self._each.rate_gain * now.turning, 0.0)
        return np.where(modes == _GROWS, self._each.integral_gain * now.rate_error, keeps)

    def ways(self, now: MotorInstant, modes: np.ndarray, before: MotorInstant) -> np.ndarray:
        """Return what falls through zero where z goes on otherwise or the torque limit is passed.

        In any unit, (k,).

        Args:
            modes: Numbers of what z does, (d,).
            before: The motors where that began.
        """
        limited = self.servo & np.isfinite(self.limit)
        side, keeps, room = np.sign(before.torque_command), modes == _KEEPS, self.room(now)
        is_beyond = (self.room(before) < -_AT_LIMIT * self.limit) | (modes == _WAITS)
        stays = np.minimum(-side * self._by(now, _WAITS), side * self._by(now, _GROWS))
        to_limit = np.where(keeps, stays, np.where(is_beyond, -room, room))
        onwards = np.sign(before.heading) * now.rate_error
        return np.concatenate([to_limit[limited], onwards[limited & is_beyond & ~keeps]])

    def room(self, now: MotorInstant) -> np.ndarray:
        """Return the way to the torque limit, below 0 beyond it [N m], (d,)."""
        return self.limit - np.abs(now.torque_command)

    def holding_integral(self, commands: np.ndarray, gear_torque: np.ndarray) -> np.ndarray:
        """Return z [N m], (d,), with which servos hold motors that start as commanded; as of `at`."""
        q, qd, qdd = commands[:, self.joint]
        none = np.zeros(len(q))
        now = self.at(commands, MotorState(q, qd, none, none), gear_torque, none)
        inertia = self._each.inertia
        free = now.acceleration - now.torque / inertia
        return inertia * (qdd - free) - self._each.rate_gain * now.rate_error

    @cached_property
    def limit(self) -> np.ndarray:
        """Torque limits [N m], infinite where there is none, (d,)."""
        return np.array([drive.torque_limit or np.inf for drive in self.drives])

    @cached_property
    def stiffness(self) -> np.ndarray:
        """Stiffness Kp Kv of the servos [N m/rad], (d,)."""
        return np.multiply(self._each.rate_gain, self._each.position_gain)

    @cached_property
    def _each(self) -> DriveColumns:
        return DriveColumns.of(self.drives)

    def _by(self, now: MotorInstant, mode: int) -> np.ndarray:
        """Return the rate of the torque that is asked for if all z were in one mode [N m/s], (d,)."""
        return self._each.rate_gain * now.turning + self.growth(
            now, np.full(len(self.drives), mode)
        )


def require_drives(robot: Robot, kind: str, quasistatic: bool, trajectory: bool = False) -> None:
    """Refuse drives of a kind that is not possible.

    Raises:
        ParameterError: With what was expected and what was got.
    """
    if kind not in DRIVES:
        raise ParameterError(f"drive: expected one of {', '.join(DRIVES)}, got {kind!r}")
    if kind != IDEAL and not any(joint.drive for joint in robot.joints):
        raise ParameterError(
            f"drive: expected ideal, as no joint of the robot has a drive, got {kind}"
        )
    if kind == "torque" and (quasistatic or trajectory):
        raise ParameterError(
            "drive torque: expected mode dynamic and no trajectory, as torques are not told at rest or"
            f" by one, got {'mode quasistatic' if quasistatic else 'a trajectory'}"
        )
