"""Measured less simulated poses of a run, and what of them is more than noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.identification.runs.measurement import MeasuredPath, SimulatedPath
from coupling.identification.runs.motors import MeasuredMotors
from coupling.identification.runs.slow_part import SlowPart

# Least noise of a coordinate [m] and of an orientation [rad] that is believed.
_LEAST, _LEAST_TURN = 1e-7, 1e-7
# What chance leaves is no discrepancy up to so many standard deviations of it.
_CHANCE = 1.0
# Turns of the search for the number of parameters, which depends on how much rows count.
_TURNS = 6


def noise_of(residuals: list[np.ndarray] | tuple[np.ndarray, ...]) -> float:
    """Return the standard deviation of noise: of what is fast in residuals, in their unit, (n, c)."""
    # Second differences of white noise have six times its variance; a motion hardly has any.
    bends = np.concatenate([np.diff(values, 2, axis=0).ravel() for values in residuals])
    return float(1.4826 * np.median(np.abs(bends)) / np.sqrt(6.0))


@dataclass(frozen=True)
class Residual:
    """What one measured run leaves, by where the simulated tool is and by frame, clock and probe.

    Rows have three coordinates, and where orientations were measured three more: rotation vectors times
    a lever by which their noise is that of a coordinate.  Behind them are angles and torques of motors,
    less their means, in units of their deviations times that noise.

    Attributes:
        run: The measured run.
    """

    run: MeasuredPath

    @cached_property
    def noise(self) -> tuple[float, float]:
        """Standard deviations of a coordinate [m] and of an orientation [rad], 0 if not measured."""
        measured, path = self.run.measured, SimulatedPath(self.run.desired)
        position_noise = noise_of([measured.position - path.position(measured.time)])
        if self.run.tool_rotation is None:
            return position_noise, 0.0
        return position_noise, noise_of([self._turn_from_path(measured.time)])

    @cached_property
    def lever(self) -> float:
        """What a radian counts as [m]."""
        position_noise, turn_noise = self.noise
        return max(position_noise, _LEAST) / max(turn_noise, _LEAST_TURN)

    @cached_property
    def _unit(self) -> np.ndarray:
        """What a unit of each column of motors counts as [m/rad], [m/N m], (c,)."""
        assert self.run.measured.motors is not None
        unit: np.ndarray = max(self.noise[0], _LEAST) / self.run.measured.motors.deviation
        return unit

    def rows(self, path: SimulatedPath, frame_values: np.ndarray) -> np.ndarray:
        """Return the residual at the times of the measurement [m], (n, 3) or (n, 6), + c of motors.

        Args:
            path: Path of the simulated tool.
            frame_values: Frame, clock and, with orientations, probe [m, rad, s], (7,) or (10,); with
                motors' clock (11,).
        """
        measured = self.run.measured
        time = measured.time + frame_values[6]
        position = path.position(time)
        arm = position - measured.position.mean(axis=0)
        position_rows = (
            measured.position - position - frame_values[:3] - np.cross(frame_values[3:6], arm)
        )
        parts = [position_rows]
        if self.run.tool_rotation is not None:
            turn_rows = self._turn_from_path(time) - path.turn(time) - frame_values[3:6]
            turn_rows = turn_rows - self.run.tool_rotation(self._inside(time)).apply(
                frame_values[7:10]
            )
            parts.append(self.lever * turn_rows)
        if measured.motors is not None:
            off = measured.motors.values - path.motors(time + frame_values[10])
            parts.append(self._unit * (off - off.mean(axis=0)))
        return np.hstack(parts)

    def columns(self, columns: np.ndarray) -> np.ndarray:
        """Return derivatives of poses and motors, (n, 6 + c, p), in the unit of rows."""
        parts = [columns[:, :3]]
        if self.run.tool_rotation is not None:
            parts.append(self.lever * columns[:, 3:6])
        if self.run.measured.motors is not None:
            of_motors = columns[:, 6:]
            parts.append(self._unit[:, None] * (of_motors - of_motors.mean(axis=0)))
        return np.concatenate(parts, axis=1)

    def by_frame(self, path: SimulatedPath, time: np.ndarray, size: int) -> np.ndarray:
        """Return derivatives of rows [m] by frame, clocks and probe, (k, 3 or 6 + c, size).

        Args:
            path: Path of the simulated tool.
            time: Times on the command's clock [s], (k,).
            size: Number of these unknowns, 7, 10 or 11.
        """
        measured = self.run.measured
        of_motors = path.motors(time, 1)
        frame = np.zeros((len(time), 6 + of_motors.shape[1], size))
        arm = path.position(time) - measured.position.mean(axis=0)
        for axis in range(3):
            frame[:, axis, axis] = frame[:, 3 + axis, 3 + axis] = 1.0
            frame[:, :3, 3 + axis] = np.cross(np.eye(3)[axis], arm)
        frame[:, :3, 6] = path.position(time, 1)
        if self.run.tool_rotation is not None:
            rotation = self.run.tool_rotation(self._inside(time))
            frame[:, 3:6, 6] = rotation.apply(self.run.tool_rotation(self._inside(time), 1))
            frame[:, 3:6, 7:10] = rotation.as_matrix()
        if measured.motors is not None:
            frame[:, 6:, 6] = frame[:, 6:, 10] = of_motors
        return self.columns(frame)

    def _turn_from_path(self, time: np.ndarray) -> np.ndarray:
        """Return measured orientations from those that the path asks for at times [rad], (n, 3)."""
        assert self.run.tool_rotation is not None
        assert self.run.measured.rotation is not None
        rotation: Rotation = self.run.tool_rotation(self._inside(time))
        return (self.run.measured.rotation * rotation.inv()).as_rotvec()

    def _inside(self, time: np.ndarray) -> np.ndarray:
        times = self.run.desired.time
        return np.clip(time, times[0], times[-1])


@dataclass(frozen=True)
class UnexplainedPart:
    """Model discrepancy: what a fit leaves beyond noise, and how much less sure it is for that.

    A fit that leaves more than noise has either ended in a local minimum beside the valley, or the
    robot does what the model does not know. With D more in the sum of squares, each over the
    variance of its noise, P parameters that are off by u_1 .. u_P standard deviations leave u_1^2 +
    .. + u_P^2 = D: in the mean u^2 is D / P. A discrepancy moves a fit by no more if it takes twice
    as many independent values along the run as there are parameters, or more. Rows therefore count
    as if their variance were 1 + D / P times that of noise: intervals become wider, and the prior
    counts more.

    Attributes:
        over: Variance of a row as it counts, by that of noise, >= 1.
        effective: Effective number of unknowns that the rows determine, P: between none and all.
    """

    over: float
    effective: float

    @property
    def widened(self) -> float:
        """By how much intervals are wider for it."""
        return float(np.sqrt(self.over))

    @classmethod
    def of(
        cls, squares: float, rows: float, data: np.ndarray, prior: np.ndarray
    ) -> UnexplainedPart:
        """Return it for a fit.

        Args:
            squares: Sum of squares of independent rows, by the variance of their noise.
            rows: Their number.
            data: Normal matrix of the rows, each by its noise, for all U unknowns, (U, U).
            prior: Standard deviations of the unknowns before, in their units, (U,).

        Example:
            >>> round(UnexplainedPart.of(68.0, 50.0, 1e9 * np.eye(2), np.ones(2)).over, 6)
            6.0
        """
        over, effective, before = 1.0, 0.0, np.diag(prior**-2.0)
        for _ in range(_TURNS):
            effective = float(np.trace(np.linalg.solve(before + data / over, data / over)))
            # Noise leaves as many squares as there are rows beyond what they tell, by chance more.
            noise = rows - effective + _CHANCE * np.sqrt(2.0 * rows)
            more = max(0.0, squares - noise)
            over = 1.0 + more / max(effective, 1.0)
        return cls(float(over), effective)


def weigh_motors(
    motors: MeasuredMotors, time: np.ndarray, predicted: np.ndarray, columns: np.ndarray
) -> MeasuredMotors:
    """Return columns of motors with deviations by what no parameter explains, at least by their noise.

    What is left of a slow part, gear errors and ripple of torque among it, counts as noise that leaves
    as much.

    Args:
        motors: The columns, c of them.
        time: Times [s], (n,).
        predicted: Angles [rad] and torques [N m] of a model, (n, c).
        columns: Derivatives of these by log factors [rad, N m] and clock [rad/s, N m/s], (n, c, P + 1).
    """
    slow, residual = SlowPart.of(time), motors.values - predicted
    slow_residual, by = slow(residual - residual.mean(axis=0)), slow(columns - columns.mean(axis=0))
    deviation = motors.least
    for k in range(len(deviation)):
        explained = by[:, k] @ np.linalg.lstsq(by[:, k], slow_residual[:, k], rcond=1e-9)[0]
        unmodelled = np.std(slow_residual[:, k] - explained) / np.sqrt(slow.of_noise)
        deviation[k] = max(deviation[k], noise_of([residual[:, [k]]]), unmodelled)
    return replace(motors, deviation=deviation)
