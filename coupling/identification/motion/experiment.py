"""Recordings around values of the parameters: weighed residuals and their derivatives, for `estimate`.

Gears' motion takes a simulation for every number, or two; all else follows from it without one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from coupling.errors import SimulationError
from coupling.identification.least_squares import reduced_rows
from coupling.identification.motion.driven_fmu import GearMotion
from coupling.identification.motion.normal_blocks import NormalBlocks
from coupling.identification.motion.problem import (
    MotionProblem,
    Predicted,
    SmoothedRecording,
    motor_losses,
    motor_torques,
    rms,
)
from coupling.identification.motion.sensors import column, torque_column
from coupling.robot.parameters import apply_values

# Change of a parameter for its derivative, in parts of its usual size: far above what the FMU rounds.
_CHANGE = 1e-2
# Damping of directions that are not observable, in parts of the columns' squares.
_UNOBSERVABLE = 1e-9
# A channel weighs at most so many times as much as its measured size says.
_LEAST_PART = 1e-3
# What is left of a channel counts as this at least [rad, N m]: below is rounding.
_EXACT = 1e-9


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
    def of(cls, point: MotionExperiment, near: GearSlopes) -> GearSlopes:
        """Return those at a point.

        Args:
            near: Derivatives nearby, which stay where they are known.
        """
        moving = [k for k, p in enumerate(point.problem.parameters) if p.moves_gears]
        names = tuple(point.problem.parameters[k].name for k in moving)
        indices = {name: m for m, name in enumerate(near.names)}
        by_one = []
        for r, base in enumerate(point.predicted):
            rows = np.empty((len(moving), *base.gears.rows.shape))
            for m, (k, name) in enumerate(zip(moving, names, strict=True)):
                if name in indices:
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


NO_SLOPES = GearSlopes((), ())


@dataclass(frozen=True)
class MotionExperiment:
    """Recordings around values of the parameters; `of` makes one, without derivatives.

    Attributes:
        problem: Parameters and recordings.
        x: Values as the fit counts, parts of usual sizes [1], (P,).
        predicted: Predictions of all recordings there.
        wind_up_deviation: Standard deviations of wind-ups that weigh them [rad], (j,).
        torque_deviation: Those of torques [N m], (j,).
        slopes: Derivatives of the gears' motion there; nearby, unless they are exact.
        converged: Whether a fit has converged there.
    """

    problem: MotionProblem
    x: np.ndarray
    predicted: tuple[Predicted, ...]
    wind_up_deviation: np.ndarray
    torque_deviation: np.ndarray
    slopes: GearSlopes = NO_SLOPES
    converged: bool = False

    @classmethod
    def of(cls, problem: MotionProblem, x: np.ndarray) -> MotionExperiment:
        """Return a problem at x [1], (P,), channels weighed by the rms of what is left of them.

        Raises:
            SimulationError: If the solver cannot step there.
        """
        predicted = tuple(problem.predicted(smoothed, x) for smoothed in problem.recordings)
        wind_up, torque = zip(*map(problem.residuals, problem.recordings, predicted), strict=True)
        measured = np.vstack([smoothed.recording.torque for smoothed in problem.recordings])
        least = np.maximum(_LEAST_PART * rms(measured), _EXACT)
        return cls(
            problem,
            x,
            predicted,
            np.maximum(rms(np.vstack(wind_up)), _EXACT),
            np.maximum(rms(np.vstack(torque)), least),
        )

    def residuals(self, of: MotionExperiment) -> list[np.ndarray]:
        """Return weighed residuals of all recordings [1], (n, channels) each, at other values.

        Friction, as it is loaded, and loops are those of here.
        """
        problem, rows = self.problem, []
        linked = problem.recordings[0].recording.with_link
        for smoothed, here, there in zip(
            problem.recordings, self.predicted, of.predicted, strict=True
        ):
            if there is not here:
                there = problem.predicted(smoothed, of.x, here, there)
            wind_up, torque = problem.residuals(smoothed, there)
            links = wind_up[:, linked] / self.wind_up_deviation[linked]
            rows.append(np.hstack([links, torque / self.torque_deviation]))
        return rows

    @property
    def minus_log_likelihood(self) -> float:
        """Minus the logarithm of likelihood and prior, for channels of any size."""
        problem = self.problem
        rows = sum(len(smoothed.recording.time) for smoothed in problem.recordings)
        deviation = np.concatenate([self.wind_up_deviation, self.torque_deviation])
        size = np.sum(np.log(deviation[np.isfinite(deviation)]))
        prior = 0.5 * problem.prior @ (self.x - problem.start) ** 2
        return float((rows * size + prior) / problem.correlated)

    @cached_property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives, (P, P), and residual, (P,), of all rows and the prior, reduced to P rows.

        A direction that is not observable is damped, so that it stays.
        """
        problem, x = self.problem, self.x
        products, gradient = np.diag(problem.prior), problem.prior * (x - problem.start)
        residuals = self.residuals(self)
        for channel in derivatives(self):
            numbers, columns = channel.numbers, channel.columns
            products[np.ix_(numbers, numbers)] += columns @ columns.T
            gradient[numbers] += columns @ residuals[channel.recording][:, channel.channel]
        return reduced_rows(products, gradient, _UNOBSERVABLE)

    @property
    def unit(self) -> float:
        """Number of rows that count as one."""
        return self.problem.correlated

    @property
    def is_exact(self) -> bool:
        """Whether the gears' derivatives were simulated at x."""
        return self.slopes.exact

    def cost(self, weighted: MotionExperiment) -> float:
        """Return half the squares of residuals and prior [1], with the weights around other values."""
        residuals = weighted.residuals(self)
        prior = self.problem.prior @ (self.x - self.problem.start) ** 2
        return 0.5 * float(prior + sum(np.sum(rows**2) for rows in residuals))

    def at(self, x: np.ndarray) -> MotionExperiment | None:
        """Return the recordings around other values [1], (P,); None too far for the solver.

        Derivatives are those that explain the step [Broyden1965].
        """
        try:
            there = MotionExperiment.of(self.problem, x)
        except SimulationError:
            return None
        before, after = (
            [predicted.gears.rows for predicted in recordings.predicted]
            for recordings in (self, there)
        )
        moving = np.array([p.moves_gears for p in self.problem.parameters], dtype=bool)
        effect = np.linalg.norm(self.rows[0][:, moving], axis=0)
        slopes = self.slopes.changed((x - self.x)[moving], effect, before, after)
        return replace(there, slopes=slopes)

    def recompute(self, near: GearSlopes = NO_SLOPES) -> MotionExperiment:
        """Return the same with derivatives simulated at x, but for those that are known nearby."""
        return replace(self, slopes=GearSlopes.of(self, near))

    @cached_property
    def blocks(self) -> NormalBlocks:
        """Its normal equations, block by block."""
        problem = self.problem
        jacobians = jacobian(self if self.slopes.exact else self.recompute())
        blocks = NormalBlocks.of(jacobians, self.residuals(self))
        away = problem.start - self.x
        return replace(blocks, prior=problem.prior, away=away, correlated=problem.correlated)


def _simulated(point: MotionExperiment, r: int, k: int) -> np.ndarray:
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


def derivatives(point: MotionExperiment) -> list[ChannelDerivatives]:
    """Return the derivatives of a point's residual by x, as the fit counts, (P,)."""
    channels, problem = [], point.problem
    with_link = problem.recordings[0].recording.with_link
    gears = [k for k, p in enumerate(problem.parameters) if p.moves_gears]
    for r, (smoothed, base) in enumerate(zip(problem.recordings, point.predicted, strict=True)):
        links, torques = _by_gears(smoothed, base, point.slopes.by_one[r])
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
    point: MotionExperiment, smoothed: SmoothedRecording, base: Predicted, k: int
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
    point: MotionExperiment, smoothed: SmoothedRecording, base: Predicted, k: int
) -> np.ndarray:
    """Return the change of what is left of a wind-up [rad], (n,), by a number of its encoder."""
    p = point.problem.parameters[k]
    return -p.size * smoothed.remove_fitted(
        column(p, smoothed.motion, base.dry[:, p.joint]), p.joint
    )


def jacobian(point: MotionExperiment) -> list[np.ndarray]:
    """Return `derivatives` of each recording as one matrix [1], (n, channels, P)."""
    count = len(point.x)
    matrices = [np.zeros((*rows.shape, count)) for rows in point.residuals(point)]
    for channel in derivatives(point):
        matrices[channel.recording][:, channel.channel, channel.numbers] = channel.columns.T
    return matrices
