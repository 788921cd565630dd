"""Derivatives of what is left of recordings by a robot's numbers, and of the gears' motion in them.

Gears' motion takes a simulation for every number, or two; all else follows from it without one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coupling.identification.motion.driven_fmu import GearMotion
from coupling.identification.motion.driven_motors import motor_losses, motor_torques
from coupling.identification.motion.problem import MotionPoint, Predicted, SmoothedRecording
from coupling.identification.motion.sensors import column, torque_column
from coupling.robot.parameters import apply_values

# Change of a parameter for its derivative, in parts of its usual size: far above what the FMU rounds.
_CHANGE = 1e-2


@dataclass(frozen=True)
class GearSlopes:
    """Derivatives of the gears' motion in every recording.

    Attributes:
        names: Names of the parameters by which, m of them.
        by_one: Changes of `GearMotion.rows` [rad, N m] by 1 of each, as the fit counts, (m, n, 2 j).
        exact: Whether all were simulated where the fit is.
    """

    names: tuple[str, ...]
    by_one: tuple[np.ndarray, ...]
    exact: bool = True

    @classmethod
    def of(cls, point: MotionPoint, near: GearSlopes | None = None) -> GearSlopes:
        """Return those at a point.

        Args:
            near: Derivatives nearby, which stay where they are known; None: all are simulated.
        """
        moving = [k for k, p in enumerate(point.problem.parameters) if p.moves_gears]
        names = tuple(point.problem.parameters[k].name for k in moving)
        indices = {} if near is None else {name: m for m, name in enumerate(near.names)}
        by_one = []
        for r, base in enumerate(point.predicted):
            rows = np.empty((len(moving), *base.gears.rows.shape))
            for m, (k, name) in enumerate(zip(moving, names, strict=True)):
                if near is not None and name in indices:
                    rows[m] = near.by_one[r][indices[name]]
                else:
                    rows[m] = _simulated(point, r, k)
            by_one.append(rows)
        return cls(names, tuple(by_one), not indices.keys() & set(names))

    def changed(
        self,
        step: np.ndarray,
        effect: np.ndarray,
        before: Sequence[np.ndarray],
        there: Sequence[np.ndarray],
    ) -> GearSlopes:
        """Return those after a step [1], (m,), with the least change that explains it [Broyden1965].

        Args:
            step: Change of the parameters [1], (m,).
            effect: Sizes of what is left by 1 of each [1], (m,): without one its derivative stays.
            before, there: `GearMotion.rows` [rad, N m] of each recording before and after it, (n, 2 j).

        Example:
            >>> slopes = GearSlopes(("a", "b"), (np.zeros((2, 1, 2)),))
            >>> step, effect, rows = np.array([9.0, 2.0]), np.array([0.0, 1.0]), np.array([[3.0, 4.0]])
            >>> slopes.changed(step, effect, [np.zeros((1, 2))], [rows]).by_one[0].round(3).tolist()
            [[[0.0, 0.0]], [[1.5, 2.0]]]
        """
        # A step with less effect than the change of differences would bring in what the FMU rounds.
        least = _CHANGE * effect.max(initial=1e-300)
        part = effect**2 * step / (np.sum((effect * step) ** 2) + least**2)
        by_one = tuple(
            slopes + np.multiply.outer(part, new - old - np.tensordot(step, slopes, 1))
            for slopes, old, new in zip(self.by_one, before, there, strict=True)
        )
        return GearSlopes(self.names, by_one, exact=False)


def _simulated(point: MotionPoint, r: int, k: int) -> np.ndarray:
    """Return the derivative of the gears' motion in recording r by parameter k, (n, 2 j)."""
    # Of a gear's numbers alone the motion is not nearly linear: they are changed both ways.
    problem, base = point.problem, point.predicted[r]
    parameter, smoothed = problem.parameters[k], problem.recordings[r]
    back = min(0.5 * _CHANGE, point.x[k] - problem.bounds[0][k]) if parameter.of_gear else 0.0
    ends = []
    for change in (_CHANGE - back, -back):
        further, gears = point.x.copy(), base.gears
        further[k] += change
        if change:
            robot = problem.with_joint(base.robot, further, parameter.joint)
            gears = problem.fmu.simulate(robot, smoothed.recording.time, smoothed.motion)
        ends.append(gears.rows)
    return (ends[0] - ends[1]) / _CHANGE


@dataclass(frozen=True)
class ChannelDerivatives:
    """Derivatives of one channel of a recording, of those parameters that it follows, c of them.

    Attributes:
        recording, channel: Indices of the recording and of its channel.
        numbers: Indices of the parameters, (c,).
        columns: Derivatives of the weighed residual, as the fit counts [1], (c, n).
    """

    recording: int
    channel: int
    numbers: list[int]
    columns: np.ndarray


def derivatives(point: MotionPoint, slopes: GearSlopes) -> list[ChannelDerivatives]:
    """Return the derivatives of a point's residual by x, as the fit counts, (P,).

    Args:
        point: The point, with its weights.
        slopes: Derivatives of the gears' motion there.
    """
    channels, problem = [], point.problem
    with_link = problem.recordings[0].recording.with_link
    gears = [k for k, p in enumerate(problem.parameters) if p.moves_gears]
    for r, (smoothed, base) in enumerate(zip(problem.recordings, point.predicted, strict=True)):
        links, torques = _by_gears(smoothed, base, slopes.by_one[r])
        for channel, i in enumerate([*with_link, *range(len(problem.robot.joints))]):
            of_torque = channel >= len(with_link)
            of_joint = [
                k
                for k, p in enumerate(problem.parameters)
                if not p.moves_gears and p.joint == i and p.of_torque == of_torque
            ]
            if of_torque:
                deviation, of_gears = point.torque_deviation[i], torques[:, :, i]
                others = [-_by_motor(point, smoothed, base, k) for k in of_joint]
            else:
                deviation, of_gears = point.wind_up_deviation[i], links[:, :, i]
                others = [_by_sensor(point, smoothed, base, k) for k in of_joint]
            columns = np.vstack([of_gears, *others]) / deviation
            channels.append(ChannelDerivatives(r, channel, [*gears, *of_joint], columns))
    return channels


def _by_gears(
    smoothed: SmoothedRecording, base: Predicted, by_one: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return changes of what is left of wind-ups [rad] and torques [N m], (m, n, j) each, by gears'."""
    links, torques = [], []
    for rows in by_one:
        change, further = GearMotion(rows), GearMotion(base.gears.rows + _CHANGE * rows)
        wind_up = change.wind_up.copy()
        for i in smoothed.recording.with_link:
            wind_up[:, i] = smoothed.remove_fitted(wind_up[:, i], i)
        links.append(wind_up)
        there = motor_torques(smoothed.motion, base.robot, further, base.part)
        torques.append((base.torque - base.unmodelled - there) / _CHANGE)
    shape = (len(by_one), *base.torque.shape)
    return np.reshape(links, shape), np.reshape(torques, shape)


def _by_motor(
    point: MotionPoint, smoothed: SmoothedRecording, base: Predicted, k: int
) -> np.ndarray:
    """Return the change of a motor's torque [N m], (n,), by a number of it, or of beside it."""
    p = point.problem.parameters[k]
    part, gear_torque = base.part[:, p.joint], base.gears.torque[:, p.joint]
    if p.sensor:
        return p.size * torque_column(p, smoothed.motion, part, smoothed.recording.step)
    there = apply_values(base.robot, {p.name: p.in_robot(point.x[k] + _CHANGE)})
    ends = []
    for robot in (base.robot, there):
        drive = robot.joints[p.joint].drive
        assert drive is not None
        ends.append(motor_losses(smoothed.motion, p.joint, drive, gear_torque, part))
    return (ends[1] - ends[0]) / _CHANGE


def _by_sensor(
    point: MotionPoint, smoothed: SmoothedRecording, base: Predicted, k: int
) -> np.ndarray:
    """Return the change of what is left of a wind-up [rad], (n,), by a number of its encoder."""
    p = point.problem.parameters[k]
    return -p.size * smoothed.remove_fitted(
        column(p, smoothed.motion, base.dry[:, p.joint]), p.joint
    )


def jacobian(point: MotionPoint, slopes: GearSlopes) -> list[np.ndarray]:
    """Return `derivatives` of each recording as one matrix [1], (n, channels, P)."""
    count = len(point.x)
    matrices = [np.zeros((*rows.shape, count)) for rows in point.residuals(point)]
    for channel in derivatives(point, slopes):
        matrices[channel.recording][:, channel.channel, channel.numbers] = channel.columns.T
    return matrices
