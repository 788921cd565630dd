"""Measured runs around values of the unknowns: robust residuals and their Jacobian, for `estimate`.

Rows are whitened slow parts of measured less simulated poses, with Cauchy's weights and a prior;
derivatives are those of the gears' equation or differences of simulations (`effect`), with Broyden's
updates after a step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from scipy.special import gammaincinv

from coupling.errors import SimulationError
from coupling.identification.least_squares import reduced_rows
from coupling.identification.runs.measurement import SimulatedPath
from coupling.identification.runs.problem import FitProblem, PoseDerivatives
from coupling.identification.runs.residual import Residual, noise_of
from coupling.identification.runs.slow_part import SlowPart
from coupling.identification.runs.whitening import UnmodelledSpectrum, Whitening
from coupling.robot.robot_fmu import RobotFmu

# Smallest scale of the residual's slow part [m]: below it lies what the model itself is not worth.
FLOOR = 1e-6
_FRAME_ITERATIONS = 3
# Cauchy's scale, by the median of the residual.
_SCALE = 1.5


@dataclass(frozen=True)
class FitPoint:
    """The residual at some unknowns, and its robust cost.

    Attributes:
        z: Log factors of the parameters [1], then frame, clocks and probe of every measured run, as in
            `FramePrior` [m, rad, s]: all U unknowns, (U,).
        simulated: Path of the simulated tool in every measured run.
        residuals: Measured less simulated positions of every run [m], (n, 3); where orientations were
            measured with these in three more coordinates, as in `Residual`.
        slow: Their slow parts [m], (k, 3) or (k, 6), + c of motors.
        rows: The same, whitened [m], (k, 3) or (k, 6), + c of motors.
        scale: Cauchy's scale [m].
        squares: Robust sum of squares with that, and the prior's.
    """

    z: np.ndarray
    simulated: tuple[SimulatedPath, ...]
    residuals: tuple[np.ndarray, ...]
    slow: tuple[np.ndarray, ...]
    rows: tuple[np.ndarray, ...]
    scale: float
    squares: float

    @property
    def cost(self) -> float:
        """Half the sum of squares [1]."""
        return 0.5 * self.squares


@dataclass(frozen=True)
class Restart:
    """Where a fit may begin again.

    Attributes:
        point: Unknowns of which a few were changed.
        z: The others fitted to these, by derivatives [1, m, rad, s], (U,).
        cost: Cost that is predicted there [1].
    """

    point: FitPoint
    z: np.ndarray
    cost: float


@cache
def _length(count: int) -> float:
    """Return the median length of a row of noise of size 1, of so many coordinates."""
    return float(np.sqrt(2.0 * gammaincinv(0.5 * count, 0.5)))


def size_of(parts: Sequence[np.ndarray]) -> float:
    """Return the rms length of the positions in rows of measured runs [m], (k, 3 or more)."""
    squares = [np.sum(rows[:, :3] ** 2, axis=1) for rows in parts]
    return float(np.sqrt(np.mean(np.concatenate(squares))))


class FitObjective:
    """Robust sum of squares of a problem's residuals.

    Args:
        problem: The problem.
        spectrum: Spectrum of what the model does not describe.
        variance: Variance of a coordinate of the rows [m^2]; None: by Cauchy's scale, under which the
            prior has more weight, and the sum is smoother.

    Attributes:
        problem, spectrum: The same.
        slow: Slow parts of the samples of every measured run.
        whitening: Filters of their rows.
    """

    def __init__(
        self,
        problem: FitProblem,
        spectrum: UnmodelledSpectrum,
        variance: float | None = None,
    ) -> None:
        self.problem, self.spectrum, self._variance = problem, spectrum, variance
        self.slow = tuple(SlowPart.of(run.measured.time) for run in problem.runs)
        self._residuals = tuple(map(Residual, problem.runs))
        self.whitening = tuple(
            Whitening(mean, max(residual.noise[0], FLOOR / float(np.sqrt(mean.of_noise))))
            for mean, residual in zip(self.slow, self._residuals, strict=True)
        )

    def over_noise(self, now: FitPoint) -> float:
        """Return what is left by what noise alone would leave."""
        return size_of(now.rows) / max(self.noise(now.residuals), 1e-12)

    def noise(self, residuals: Sequence[np.ndarray]) -> float:
        """Return the rms of slow parts that residuals (n, 3 or more) have by noise alone [m]."""
        noise = noise_of([rows[:, :3] for rows in residuals])
        return noise * float(np.sqrt(3.0 * np.mean([mean.of_noise for mean in self.slow])))

    def at(
        self, z: np.ndarray, scale: float | None = None, fmu: RobotFmu | None = None
    ) -> FitPoint:
        """Return what some unknowns leave, with a scale that is given or their own.

        Args:
            z: Unknowns, as in `FitPoint` [1, m, rad, s], (U,).
            scale: Cauchy's scale [m]; None: by the residual.
            fmu: FMU that simulates; None: the problem's first.

        Raises:
            SimulationError: If the robot gives way under its own weight.
        """
        problem = self.problem
        robot = problem.robot_at(z[: len(problem.parameters)])
        simulated, residuals, slow, rows = [], [], [], []
        for number, run in enumerate(problem.runs):
            path = run.simulated(fmu or problem.fmu, robot)
            residual = self._residuals[number].rows(path, problem.frame_values(z, number))
            simulated.append(path)
            residuals.append(residual)
            slow.append(self.slow[number](residual))
            rows.append(self.whitened(number, slow[-1]))
        squares = self.rescaled(z, tuple(rows), scale)
        return FitPoint(z, tuple(simulated), tuple(residuals), tuple(slow), tuple(rows), *squares)

    def whitened(self, number: int, rows: np.ndarray) -> np.ndarray:
        """Return rows of a run [m], or their columns, whitened but for motors', (k, c, ...)."""
        poses = self.problem.runs[number].coordinates
        whitened = self.whitening[number](rows[:, :poses], self.spectrum)
        return np.concatenate([whitened, rows[:, poses:]], axis=1)

    def rescaled(
        self, z: np.ndarray, rows: tuple[np.ndarray, ...], scale: float | None = None
    ) -> tuple[float, float]:
        """Return the scale of the residual [m], unless given, and the robust sum of squares with it.

        Args:
            z: Unknowns, as in `FitPoint` [1, m, rad, s], (U,).
            rows: Whitened rows [m], (k, 3) or (k, 6), + c of motors.
            scale: Cauchy's scale [m]; None: by the residual.
        """
        sizes = [np.linalg.norm(part, axis=1) for part in rows]
        if scale is None:
            # Rows of more coordinates are longer for the same noise.
            alike = [
                size * _length(3) / _length(part.shape[1])
                for size, part in zip(sizes, rows, strict=True)
            ]
            scale = max(FLOOR, _SCALE * float(np.median(np.concatenate(alike))))
        squares = self._weight(scale) * sum(
            mean.independent * float(np.sum(4.0 * np.log1p((size / (2.0 * scale)) ** 2)))
            for mean, size in zip(self.slow, sizes, strict=True)
        )
        return scale, squares + float(np.sum((z / self.problem.prior) ** 2))

    def slopes(self, z: np.ndarray, derivatives: Sequence[PoseDerivatives]) -> list[np.ndarray]:
        """Return slow parts of poses by log factors, in the unit of rows, (k, c, P) of every run."""
        count = len(self.problem.parameters)
        slopes = []
        for number, run in enumerate(self.problem.runs):
            # Columns are slow: taken at the means' own times they are their own means.
            time = run.measured.time + self.problem.frame_values(z, number)[6]
            columns = self._residuals[number].columns(derivatives[number](z[:count], time))
            slopes.append(self.slow[number](columns))
        return slopes

    def columns(self, now: FitPoint, number: int, slopes: np.ndarray) -> np.ndarray:
        """Return by how much a run's slow rows fall with its unknowns [m], (k, c, P + its frame's).

        Args:
            number: Number of the run, from 0.
            slopes: Derivatives of its slow rows by log factors [m], (k, c, P).
        """
        time = self.slow[number].time + self.problem.frame_values(now.z, number)[6]
        frame = self._residuals[number].by_frame(
            now.simulated[number], time, self.problem.frame_size
        )
        return np.concatenate([slopes, frame], axis=2)

    def unknowns_of(self, number: int) -> np.ndarray:
        """Return the numbers of the unknowns of a run, (P + its frame's,)."""
        return np.r_[: len(self.problem.parameters), self.problem.rows_of(number)]

    def equations(
        self, now: FitPoint, slopes: Sequence[np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return matrix, (U, U), and right side, (U,), of a step, by units of the unknowns."""
        matrix = np.diag(self.problem.prior**-2.0)
        right = -now.z / self.problem.prior**2
        for number, mean in enumerate(self.slow):
            columns = self.whitened(number, self.columns(now, number, slopes[number]))
            rows = now.rows[number]
            size = np.linalg.norm(rows, axis=1)
            weight = mean.independent / (now.scale**2 * (1.0 + (size / (2.0 * now.scale)) ** 2))
            weight *= self._weight(now.scale)
            weighted = columns * weight[:, None, None]
            where = self.unknowns_of(number)
            matrix[np.ix_(where, where)] += np.tensordot(weighted, columns, ([0, 1], [0, 1]))
            right[where] += np.tensordot(weighted, rows, ([0, 1], [0, 1]))
        return matrix, right

    def fit_others(
        self, now: FitPoint, slopes: Sequence[np.ndarray], step: np.ndarray, fmu: RobotFmu
    ) -> Restart:
        """Return a step, and what is predicted where all that it does not change is fitted to it.

        Args:
            now: The point it begins at.
            slopes: Derivatives of the slow rows of every measured run [m], (k, c, P).
            step: Step of the log factors [1], (P,); 0 of those that are fitted to it.
            fmu: FMU that simulates.
        """
        z = now.z.copy()
        z[: len(step)] += step
        after = self.at(z, now.scale, fmu)
        free = np.setdiff1d(np.arange(len(z)), np.flatnonzero(step))
        matrix, right = self.equations(after, slopes)
        change = np.linalg.solve(matrix[np.ix_(free, free)], right[free])
        z = after.z.copy()
        z[free] += change
        return Restart(after, z, after.cost - 0.5 * float(right[free] @ change))

    def framed(self, x: np.ndarray) -> FitPoint:
        """Return what given parameters leave behind the frame that fits them best.

        Args:
            x: Log factors [1], (P,).
        """
        count = len(x)
        now = self.at(np.concatenate([x, np.zeros(self.problem.size - count)]))
        still = [np.zeros((*rows.shape, count)) for rows in now.slow]
        for _ in range(_FRAME_ITERATIONS):
            matrix, right = self.equations(now, still)
            step = np.zeros(self.problem.size)
            step[count:] = np.linalg.solve(matrix[count:, count:], right[count:])
            now = self.at(now.z + step)
        return now

    def try_at(
        self, z: np.ndarray, scale: float | None = None, fmu: RobotFmu | None = None
    ) -> FitPoint | None:
        """Return what some unknowns leave, as `at` does; None of a robot that gives way.

        Args:
            z: Unknowns, as in `FitPoint` [1, m, rad, s], (U,).
            scale, fmu: As for `at`.
        """
        try:
            return self.at(z, scale, fmu)
        except SimulationError:
            return None

    def _weight(self, scale: float) -> float:
        """Return the weight of rows, by that of Cauchy's scale [m]."""
        return 1.0 if self._variance is None else scale**2 / self._variance


@dataclass(frozen=True)
class RunLinearisation:
    """Measured runs around values of the unknowns.

    Attributes:
        objective: Their objective.
        point: Residuals and cost there.
        derivatives: Derivatives of the poses of every run by log factors.
        reach: Changes of the log factors over which they hold [1], (P,).
        slopes: Derivatives of the slow rows of every run by log factors [m], (k, c, P).
        exact_at: Log factors where those were computed [1], (P,); None: nowhere.
    """

    objective: FitObjective
    point: FitPoint
    derivatives: Sequence[PoseDerivatives]
    reach: np.ndarray
    slopes: Sequence[np.ndarray] = ()
    exact_at: np.ndarray | None = None

    @property
    def x(self) -> np.ndarray:
        """Values of all unknowns [1, m, rad, s], (U,)."""
        return self.point.z

    @cached_property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Jacobian, (U, U), and residual [1], (U,), of all rows and the prior, reduced to U rows."""
        matrix, right = self.objective.equations(self.point, self.slopes)
        return reduced_rows(matrix, -right)

    @property
    def unit(self) -> float:
        """Decrease of the cost that makes the measurement likelier by e."""
        return 1.0

    @property
    def is_exact(self) -> bool:
        """Whether the log factors are as near those of the derivatives as these' differences reach."""
        if self.exact_at is None:
            return False
        count = len(self.exact_at)
        return bool(np.all(np.abs(self.x[:count] - self.exact_at) <= self.reach))

    def cost(self, weighted: RunLinearisation) -> float:
        """Return half the squares of residuals and prior [1], by the scale around other values."""
        point = self.point
        return 0.5 * self.objective.rescaled(point.z, point.rows, weighted.point.scale)[1]

    def at(self, x: np.ndarray) -> RunLinearisation | None:
        """Return the runs around other values [1, m, rad, s], (U,); None of a robot that gives way.

        Their derivatives explain the step [Broyden1965].
        """
        point = self.objective.try_at(x)
        if point is None:
            return None
        count = len(self.objective.problem.parameters)
        slopes = []
        for number, before in enumerate(self.slopes):
            columns = self.objective.columns(self.point, number, before)
            step = (x - self.x)[self.objective.unknowns_of(number)]
            unexplained = self.point.slow[number] - point.slow[number] - columns @ step
            size = np.linalg.norm(before, axis=(0, 1))
            share = size**2 * step[:count]
            length = float(share @ step[:count])
            share = share / length if length > 0.0 else 0.0 * share
            slopes.append(before + unexplained[:, :, None] * share)
        return replace(self, point=point, slopes=slopes)

    def recompute(self) -> RunLinearisation:
        """Return the same with derivatives computed there."""
        slopes = self.objective.slopes(self.x, self.derivatives)
        count = len(self.objective.problem.parameters)
        return replace(self, slopes=slopes, exact_at=self.x[:count])
