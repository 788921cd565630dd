"""Torques of motors at their gears' outputs: from currents, and whether a robot's motors can have them.

A measured torque is a T + F along the motion, where the model needs T for weight and acceleration.  a is
1 but for wrong masses, and friction F takes energy from any motor: a column with another sign has both
turned round, one in another unit or at the motor, before the gear, has both in that ratio.  All columns
together tell by where friction turns when they were recorded, and of which motors.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastic_robot.description import Robot
from elastic_robot.drive import Drive

# A motor moves from this part of its largest rate on; it must do so both ways for this part of the rows,
# as weight and friction look alike where it moves one way.
_MOVES, _EACH_WAY = 0.1, 0.15
# Shortest time of such rows [s], parts of them that are left out in turn, and how many of their
# deviations decide, of two estimates and of one alone.
_SHORTEST, _PARTS, _SURE, _SURE_ALONE = 1.0, 12, 4.0, 10.0
# Friction below this part of the torque is none.
_NO_FRICTION = 0.02
# Masses that are wrong, a payload or balancer that is not in the file, make the torque so many times as
# large or small; units and gear ratios make it at least the larger of these.
_MASSES, _UNITS = 3.0, 30.0
# Nothing that one controller records is later than this [s]; lags that are looked for, their step [s].
LATEST, _LAGS, _LAG_STEP = 0.05, 0.5, 0.01
# A lag leaves so much less of the torques in the mean [1], and of two of them at least; another joint
# leaves so much less of two of them.  Both leave at most this part.
_LATE, _OTHER, _EXPLAINED = 0.9, 0.67, 0.7
# Rows that these are looked for in.
_ROWS = 4000


def torque_per_current(robot: Robot, joint: int, table: object, error: type[Exception]) -> float:
    """Return the torque at the gear's output over the current of a joint's motor [N m/A].

    Args:
        joint: Number of the joint, from 0.
        table: Name of the table with the current, for the message.
        error: Exception class where the robot's file does not tell.
    """
    drive = robot.joints[joint].drive
    if drive is None or drive.torque_per_current is None:
        raise error(
            f"{table}: motor_current[{joint + 1}]: expected torque_constant_Nm_A in [joint.drive] of"
            f" joint {joint + 1} in the robot file, got none"
        )
    return drive.torque_per_current


@dataclass(frozen=True)
class MotorTorques:
    """Measured torques of motors beside those that a model predicts along the same motion.

    Attributes:
        name: Name of the recording, for messages.
        joints: Joints of the columns, from 0, (k,).
        time: Times [s], (n,).
        measured: Measured torques at the gears' outputs [N m], (n, k).
        predicted: The same as the robot's file predicts them [N m], (n, k).
        rate: Rates of the motors over their gears' ratios [rad/s], (n, k).
    """

    name: str
    joints: Sequence[int]
    time: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    rate: np.ndarray

    def every(self, step: int) -> MotorTorques:
        """Return each row of so many."""
        rows = (column[::step] for column in (self.time, self.measured, self.predicted, self.rate))
        return MotorTorques(self.name, self.joints, *rows)

    def residual(self, column: int, motor: int, late: float = 0.0) -> float:
        """Return which part of a column load, friction and offset of a motor do not explain [1].

        Args:
            late: Time by which the column is behind the motor [s].
        """
        rate = self.rate[:, motor]
        friction = np.clip(rate / max(_MOVES * np.abs(rate).max(), 1e-300), -1.0, 1.0)
        terms, time = np.column_stack([self.predicted[:, motor], friction, rate]), self.time
        inside = (time - late >= time[0]) & (time - late <= time[-1])
        if late:
            terms = np.column_stack(
                [np.interp(time[inside] - late, time, values) for values in terms.T]
            )
        terms = terms - terms.mean(axis=0)
        terms /= np.maximum(np.sqrt(np.mean(terms**2, axis=0)), 1e-300)
        torque = self.measured[inside, column] - self.measured[inside, column].mean()
        unexplained = torque - terms @ np.linalg.lstsq(terms, torque, rcond=1e-9)[0]
        return max(float(np.sqrt(np.sum(unexplained**2) / max(np.sum(torque**2), 1e-300))), 1e-9)


def torque_remarks(torques: MotorTorques, robot: Robot, error: type[Exception]) -> tuple[str, ...]:
    """Return a sentence on each joint whose measured torque the model's masses hardly explain.

    Args:
        robot: The robot, for the friction of its file.
        error: Exception class where a torque is none that the motor can have, is late or another's.
    """
    remarks, time = [], torques.time
    step = float(np.ptp(time)) / max(len(time) - 1, 1)
    _require_own(torques.every(1 + len(time) // _ROWS), error)
    for k, joint in enumerate(torques.joints):
        columns = (rows[:, k] for rows in (torques.measured, torques.predicted, torques.rate))
        fault, impossible = _fault(robot.joints[joint].drive, step, *columns)
        where = f"{torques.name}: joint {joint + 1}"
        words = f"{where}: expected torques at the gear's output [N m], {fault}"
        if impossible:
            raise error(words)
        if fault:
            remarks.append(words)
    return tuple(remarks)


def in_ms(late: float) -> str:
    """Return a lag [s], negative where it is early, in words."""
    return f"{1e3 * abs(late):.0f} ms {'late' if late > 0.0 else 'early'}"


def _require_own(torques: MotorTorques, error: type[Exception]) -> None:
    """Refuse torques on another clock than their motors' angles, or in each other's columns."""
    name, joints, every = torques.name, torques.joints, range(len(torques.joints))
    now = np.array([torques.residual(k, k) for k in every])
    for i, k in itertools.combinations(every, 2):
        other = torques.residual(i, k), torques.residual(k, i)
        if max(other) < _EXPLAINED and other[0] < _OTHER * now[i] and other[1] < _OTHER * now[k]:
            raise error(
                f"{name}: expected torques of joints {joints[i] + 1} and {joints[k] + 1}, each in its"
                " column, got in each the torque of the other: are the columns swapped?"
            )
    lags = np.arange(-_LAGS, _LAGS + 0.5 * _LAG_STEP, _LAG_STEP)
    lags = lags[np.abs(lags) < 0.25 * np.ptp(torques.time)]
    of_lags = np.array([[torques.residual(k, k, late) for k in every] for late in lags])
    best = int(np.argmin(np.log(of_lags).sum(axis=1)))
    less = of_lags[best] / now
    if (
        LATEST < abs(lags[best]) < abs(lags[[0, -1]]).min()
        and np.exp(np.log(of_lags[best]).mean()) < _EXPLAINED
        and np.exp(np.log(less).mean()) < _LATE
        and np.count_nonzero(less < _LATE) > 1
    ):
        raise error(
            f"{name}: expected torques on the clock of the motors' angles, got them"
            f" {in_ms(lags[best])}: record both on one clock, or shift the columns by that"
        )


def _fault(
    drive: Drive | None,
    step: float,
    measured: np.ndarray,
    predicted: np.ndarray,
    rate: np.ndarray,
) -> tuple[str, bool]:
    """Return what is wrong with a joint's torques in words, and whether no motor has them.

    Args:
        step: Time of a row [s].
        measured, predicted: Torques [N m], (n,).
        rate: Rate of its motor [rad/s], (n,).
    """
    speed = np.abs(rate)
    moves = speed > _MOVES * speed.max()
    ways = [np.count_nonzero(moves & (sign * rate > 0.0)) for sign in (1.0, -1.0)]
    if step * sum(ways) < _SHORTEST or min(ways) < _EACH_WAY * sum(ways):
        return "", False
    measured, predicted, rate = measured[moves], predicted[moves], rate[moves]
    file = np.zeros_like(rate)
    if drive is not None:
        file = drive.friction_torque(drive.friction, np.sign(rate), rate, predicted)
    load = predicted - file
    factor, friction = _load_and_friction(measured, load, rate)
    usual = float(np.mean(np.abs(file)))
    size, needed = (float(np.sqrt(np.mean(values**2))) for values in (measured, load))
    lost = friction.sure and abs(friction.value) > _NO_FRICTION * size
    got = f"got {factor.value:.3g} times the torque of weight and acceleration of its links"
    if not factor.sure:
        got = f"got friction of {friction.value:.3g} N m, {usual:.3g} N m in the robot file"
    is_reversed = factor.sure and -_MASSES < factor.value < -1.0 / _MASSES
    if lost:
        gained = friction.value < 0.0 and (is_reversed or (friction.alone and not factor.sure))
    else:
        gained = is_reversed and factor.alone
    if gained:
        return (
            f"positive in the positive direction of the joint, {got}: is the sign reversed?",
            True,
        )
    ratios = [abs(factor.value)] if factor.sure else []
    if lost and usual > 0.0:
        ratios.append(abs(friction.value) / usual)
    if ratios and (max(ratios) < 1.0 / _UNITS or min(ratios) > _UNITS):
        # A balancer that is not in the file may leave little of the weight, but not of friction.
        both = (
            len(ratios) == 2 or not _MASSES / _UNITS < size / max(needed, 1e-300) < _UNITS / _MASSES
        )
        return (
            f"{got}: is the column in kN m, relative to a rated torque, or not multiplied by the gear"
            " ratio?",
            factor.sure and both,
        )
    if factor.sure and not 1.0 / _MASSES < factor.value < _MASSES:
        return (
            f"{got}: is the unit or sign of the column wrong, or a payload or balancer missing in the"
            " robot file?",
            False,
        )
    return "", False


@dataclass(frozen=True)
class _Estimate:
    value: float
    deviation: float

    @property
    def sure(self) -> bool:
        """Whether its sign and size are known."""
        return abs(self.value) > _SURE * self.deviation

    @property
    def alone(self) -> bool:
        """Whether they are, without a second estimate that agrees."""
        return abs(self.value) > _SURE_ALONE * self.deviation


def _load_and_friction(
    measured: np.ndarray, load: np.ndarray, rate: np.ndarray
) -> tuple[_Estimate, _Estimate]:
    """Return how many times the load is measured [1], and the mean friction [N m], of rows (n,)."""
    columns = np.column_stack([load, np.sign(rate), rate])
    size = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300)
    mean = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, float(np.mean(np.abs(rate)))]])

    def fitted(rows: np.ndarray) -> np.ndarray:
        by = np.linalg.lstsq(columns[rows] / size, measured[rows], rcond=1e-9)[0]
        return mean @ (by / size)

    every = np.arange(len(measured))
    parts = np.array_split(every, _PARTS)
    others = np.array([fitted(np.setdiff1d(every, part)) for part in parts])
    # The jackknife over parts of the recording.
    deviation = np.sqrt((_PARTS - 1.0) * np.var(others, axis=0))
    first, second = zip(fitted(every).tolist(), deviation.tolist(), strict=True)
    return _Estimate(*first), _Estimate(*second)
