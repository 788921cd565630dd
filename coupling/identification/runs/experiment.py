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
from coupling.identification.runs.problem import FLOOR, FitProblem, PoseDerivatives
from coupling.identification.runs.whitening import UnmodelledSpectrum
from coupling.robot.robot_fmu import RobotFmu

_FRAME_ITERATIONS = 3
# Cauchy's scale, by the median of the residual.
_SCALE = 1.5


@dataclass(frozen=True)
class RunExperiment:
    """Measured runs around values of the unknowns; `of` makes one, without derivatives.

    Attributes:
        problem: The problem.
        x: Log factors of the parameters [1], then frame, clocks and probe of every measured run, as in
            `FramePrior` [m, rad, s]: all U unknowns, (U,).
        simulated: Path of the simulated tool in every measured run.
        residuals: Measured less simulated positions of every run [m], (n, 3); where orientations were
            measured with these in three more coordinates, as in `Residual`.
        slow: Their slow parts [m], (k, 3) or (k, 6), + c of motors.
        whitened: The same, whitened [m], (k, 3) or (k, 6), + c of motors.
        scale: Cauchy's scale [m].
        slopes: Derivatives of the slow rows of every run by log factors [m], (k, c, P).
        derivatives: Derivatives of the poses of every run by log factors, from which those are computed.
        reach: Changes of the log factors over which they hold [1], (P,).
        exact_at: Log factors where slopes were computed [1], (P,); None: nowhere.
    """

    problem: FitProblem
    x: np.ndarray
    simulated: tuple[SimulatedPath, ...]
    residuals: tuple[np.ndarray, ...]
    slow: tuple[np.ndarray, ...]
    whitened: tuple[np.ndarray, ...]
    scale: float
    slopes: Sequence[np.ndarray] = ()
    derivatives: Sequence[PoseDerivatives] = ()
    reach: np.ndarray | None = None
    exact_at: np.ndarray | None = None

    @classmethod
    def of(cls, problem: FitProblem, x: np.ndarray, fmu: RobotFmu | None = None) -> RunExperiment:
        """Return the runs around some unknowns, with Cauchy's scale by the residual.

        Args:
            x: Unknowns [1, m, rad, s], (U,).
            fmu: FMU that simulates; None: the problem's first.

        Raises:
            SimulationError: If the robot gives way under its own weight.
        """
        robot = problem.robot_at(x[: len(problem.parameters)])
        simulated = tuple(run.simulated(fmu or problem.fmu, robot) for run in problem.runs)
        residuals = tuple(
            residual.rows(path, problem.frame_values(x, number))
            for number, (residual, path) in enumerate(
                zip(problem.residuals, simulated, strict=True)
            )
        )
        slow = tuple(mean(rows) for mean, rows in zip(problem.slow, residuals, strict=True))
        rows = _whiten(problem, slow)
        return cls(problem, x, simulated, residuals, slow, rows, _scale_of(rows))

    @classmethod
    def behind_frame(cls, problem: FitProblem, log_factors: np.ndarray) -> RunExperiment:
        """Return what given parameters leave behind the frame that fits them best.

        Args:
            log_factors: Log factors [1], (P,).
        """
        count = len(log_factors)
        now = cls.of(problem, np.concatenate([log_factors, np.zeros(problem.size - count)]))
        still = [np.zeros((*rows.shape, count)) for rows in now.slow]
        for _ in range(_FRAME_ITERATIONS):
            matrix, right = replace(now, slopes=still).equations
            step = np.zeros(problem.size)
            step[count:] = np.linalg.solve(matrix[count:, count:], right[count:])
            now = cls.of(problem, now.x + step)
        return now

    def weighted(
        self, spectrum: UnmodelledSpectrum, variance: float | None = None
    ) -> RunExperiment:
        """Return the same with rows weighted by another spectrum and variance, as of the problem."""
        problem = replace(self.problem, spectrum=spectrum, variance=variance)
        rows = _whiten(problem, self.slow)
        return replace(self, problem=problem, whitened=rows, scale=_scale_of(rows))

    @property
    def over_noise(self) -> float:
        """What is left by what noise alone would leave."""
        return size_of(self.whitened) / max(self.problem.noise(self.residuals), 1e-12)

    def slopes_by(self, derivatives: Sequence[PoseDerivatives]) -> list[np.ndarray]:
        """Return slow parts of poses by log factors, in the unit of rows, (k, c, P) of every run."""
        problem, slopes = self.problem, []
        log_factors = self.x[: len(problem.parameters)]
        for number, run in enumerate(problem.runs):
            # Columns are slow: taken at the means' own times they are their own means.
            time = run.measured.time + problem.frame_values(self.x, number)[6]
            columns = problem.residuals[number].columns(derivatives[number](log_factors, time))
            slopes.append(problem.slow[number](columns))
        return slopes

    def columns(self, number: int) -> np.ndarray:
        """Return by how much a run's slow rows fall with its unknowns [m], (k, c, P + its frame's).

        Args:
            number: Number of the run, from 0.
        """
        problem = self.problem
        time = problem.slow[number].time + problem.frame_values(self.x, number)[6]
        frame = problem.residuals[number].by_frame(self.simulated[number], time, problem.frame_size)
        return np.concatenate([self.slopes[number], frame], axis=2)

    def likeliest_spectrum(self, spectra: Sequence[UnmodelledSpectrum]) -> UnmodelledSpectrum:
        """Return the spectrum of what the model does not describe with the highest marginal likelihood.

        Whittle's likelihood, unknowns integrated out.

        Args:
            spectra: Spectra to choose from.
        """
        problem, parts = self.problem, []
        for number, run in enumerate(problem.runs):
            poses, whitening = run.coordinates, problem.whitening[number]
            rows = self.slow[number][:, :poses]
            columns = np.zeros((*rows.shape, problem.size))
            columns[:, :, problem.unknowns_of(number)] = self.columns(number)[:, :poses]
            parts.append((whitening, whitening.transformed(rows), whitening.transformed(columns)))

        def misfit(spectrum: UnmodelledSpectrum) -> float:
            matrix, right, value = np.diag(problem.prior**-2.0), -self.x / problem.prior**2, 0.0
            for whitening, rows, columns in parts:
                excess = whitening.excess(spectrum)[: len(rows)]
                weighted = columns / excess[:, None, None]
                matrix = matrix + np.tensordot(weighted, columns, axes=([0, 1], [0, 1]))
                right = right + np.tensordot(weighted, rows, axes=([0, 1], [0, 1]))
                value += float(np.sum(rows**2 / excess[:, None]))
                value += rows.shape[1] * float(np.sum(np.log(excess)))
            explained = float(right @ np.linalg.solve(matrix, right))
            return value - explained + float(np.linalg.slogdet(matrix)[1])

        return min(spectra, key=misfit)

    @cached_property
    def equations(self) -> tuple[np.ndarray, np.ndarray]:
        """Matrix, (U, U), and right side, (U,), of a step, by units of the unknowns."""
        problem, scale = self.problem, self.scale
        matrix = np.diag(problem.prior**-2.0)
        right = -self.x / problem.prior**2
        for number, mean in enumerate(problem.slow):
            columns = problem.whiten(number, self.columns(number))
            rows = self.whitened[number]
            size = np.linalg.norm(rows, axis=1)
            weight = mean.independent / (scale**2 * (1.0 + (size / (2.0 * scale)) ** 2))
            weight *= problem.weight(scale)
            weighted = columns * weight[:, None, None]
            where = problem.unknowns_of(number)
            matrix[np.ix_(where, where)] += np.tensordot(weighted, columns, ([0, 1], [0, 1]))
            right[where] += np.tensordot(weighted, rows, ([0, 1], [0, 1]))
        return matrix, right

    @cached_property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Jacobian, (U, U), and residual [1], (U,), of all rows and the prior, reduced to U rows."""
        matrix, right = self.equations
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

    def cost(self, weighted: RunExperiment) -> float:
        """Return half the squares of residuals and prior [1], by the scale around other values."""
        problem, scale = self.problem, weighted.scale
        sizes = [np.linalg.norm(rows, axis=1) for rows in self.whitened]
        squares = problem.weight(scale) * sum(
            mean.independent * float(np.sum(4.0 * np.log1p((size / (2.0 * scale)) ** 2)))
            for mean, size in zip(problem.slow, sizes, strict=True)
        )
        return 0.5 * (squares + float(np.sum((self.x / problem.prior) ** 2)))

    def at(self, x: np.ndarray) -> RunExperiment | None:
        """Return the runs around other values [1, m, rad, s], (U,); None of a robot that gives way.

        Their derivatives explain the step [Broyden1965].
        """
        try:
            there = RunExperiment.of(self.problem, x)
        except SimulationError:
            return None
        count = len(self.problem.parameters)
        slopes = []
        for number, before in enumerate(self.slopes):
            step = (x - self.x)[self.problem.unknowns_of(number)]
            unexplained = self.slow[number] - there.slow[number] - self.columns(number) @ step
            size = np.linalg.norm(before, axis=(0, 1))
            share = size**2 * step[:count]
            length = float(share @ step[:count])
            share = share / length if length > 0.0 else 0.0 * share
            slopes.append(before + unexplained[:, :, None] * share)
        return replace(
            there,
            slopes=slopes,
            derivatives=self.derivatives,
            reach=self.reach,
            exact_at=self.exact_at,
        )

    def recompute(self) -> RunExperiment:
        """Return the same with derivatives computed there."""
        count = len(self.problem.parameters)
        slopes = self.slopes_by(self.derivatives)
        return replace(self, slopes=slopes, exact_at=self.x[:count])


def size_of(parts: Sequence[np.ndarray]) -> float:
    """Return the rms length of the positions in rows of measured runs [m], (k, 3 or more)."""
    squares = [np.sum(rows[:, :3] ** 2, axis=1) for rows in parts]
    return float(np.sqrt(np.mean(np.concatenate(squares))))


def _whiten(problem: FitProblem, slow: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
    return tuple(problem.whiten(number, rows) for number, rows in enumerate(slow))


def _scale_of(rows: Sequence[np.ndarray]) -> float:
    """Return Cauchy's scale [m] by the sizes of whitened rows [m], (k, 3) or (k, 6), + c of motors."""
    # Rows of more coordinates are longer for the same noise.
    alike = [np.linalg.norm(part, axis=1) * _length(3) / _length(part.shape[1]) for part in rows]
    return max(FLOOR, _SCALE * float(np.median(np.concatenate(alike))))


@cache
def _length(count: int) -> float:
    """Return the median length of a row of noise of size 1, of so many coordinates."""
    return float(np.sqrt(2.0 * gammaincinv(0.5 * count, 0.5)))
