"""Gauss-Newton steps with Levenberg-Marquardt damping on the low-pass filtered residual.

Weights are Cauchy's, with a prior; derivatives are those of the gears' equation or differences of
simulations (`effect`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.special import chdtri

from coupling.errors import SimulationError
from coupling.identification.runs.effect import in_parallel
from coupling.identification.runs.measurement import SimulatedPath
from coupling.identification.runs.problem import FitProblem, PoseDerivatives
from coupling.identification.runs.residual import Residual, noise_of
from coupling.identification.runs.slow_part import SlowPart
from coupling.robot.robot_fmu import RobotFmu

# Smallest scale of the residual's slow part [m]: below it lies what the model itself is not worth.
FLOOR = 1e-6
MOST_ITERATIONS, _FRAME_ITERATIONS, _FITTED = 12, 3, 1
# Damping of the first step, as part of the diagonal; its factors after a step that reduced the cost and
# after one that did not, and how many of these end the search.  Where one stiffness compensates another
# the minimum is a long, curved valley.
_DAMPING, _AFTER_BETTER, _AFTER_WORSE, _TRIED = 1e-3, 0.2, 4.0, 8
# A step that reduces the cost by less ends the search; noise explains 1 for every unknown.
SETTLED = 0.3
# Cauchy's scale, by the median of the residual.
_SCALE = 1.5


@dataclass(frozen=True)
class DescentPoint:
    """The residual at some unknowns, and its robust cost.

    Attributes:
        z: Log factors of the parameters [1], then frame, clocks and probe of every measured run, as in
            `FramePrior` [m, rad, s]: all U unknowns, (U,).
        simulated: Path of the simulated tool in every measured run.
        residuals: Measured less simulated positions of every run [m], (n, 3); where orientations were
            measured with these in three more coordinates, as in `Residual`.
        slow: Their slow parts [m], (k, 3) or (k, 6), + c of motors.
        scale: Cauchy's scale [m].
        cost: Robust sum of squares with that, and the prior's.
    """

    z: np.ndarray
    simulated: tuple[SimulatedPath, ...]
    residuals: tuple[np.ndarray, ...]
    slow: tuple[np.ndarray, ...]
    scale: float
    cost: float


@cache
def _length(count: int) -> float:
    """Return the median length of a row of noise of size 1, of so many coordinates."""
    return float(np.sqrt(chdtri(count, 0.5)))


def size_of(parts: Sequence[np.ndarray]) -> float:
    """Return the rms length of the positions in rows of measured runs [m], (k, 3 or more)."""
    squares = [np.sum(rows[:, :3] ** 2, axis=1) for rows in parts]
    return float(np.sqrt(np.mean(np.concatenate(squares))))


class Descent:
    """Damped Gauss-Newton method for a problem.

    Args:
        problem: The problem.
        slow: Slow parts of the samples of every measured run.
        variance: Variance of a coordinate of the slow part [m^2]; None: by Cauchy's scale, under which
            the prior has more weight, and the cost is smoother.

    Attributes:
        problem: The same.
        slow: The same.
    """

    def __init__(
        self, problem: FitProblem, slow: Sequence[SlowPart], variance: float | None = None
    ) -> None:
        self.problem, self.slow, self._variance = problem, tuple(slow), variance
        self._residuals = tuple(map(Residual, problem.runs))

    def over_noise(self, now: DescentPoint) -> float:
        """Return what is left by what noise alone would leave."""
        return size_of(now.slow) / max(self.noise(now.residuals), 1e-12)

    def noise(self, residuals: Sequence[np.ndarray]) -> float:
        """Return the rms of slow parts that residuals (n, 3 or more) have by noise alone [m]."""
        noise = noise_of([rows[:, :3] for rows in residuals])
        return noise * float(np.sqrt(3.0 * np.mean([mean.of_noise for mean in self.slow])))

    def descended(
        self, now: DescentPoint, effects: Sequence[PoseDerivatives], most: int = MOST_ITERATIONS
    ) -> tuple[DescentPoint, bool]:
        """Return the best that derivatives lead to, and whether they lead no further."""
        damping = _DAMPING
        for _ in range(most):
            after, damping = self._along(now, *self.equations(now, effects), damping)
            gained = 0.0 if after is None else now.cost - after.cost
            if after is not None:
                scale, cost = self.costed(after.z, after.slow)
                now = replace(after, scale=scale, cost=cost)
            if gained < SETTLED:
                return now, True
        return now, False

    def at(
        self, z: np.ndarray, scale: float | None = None, fmu: RobotFmu | None = None
    ) -> DescentPoint:
        """Return what some unknowns leave, with a scale that is given or their own.

        Args:
            z: Unknowns, as in `DescentPoint` [1, m, rad, s], (U,).
            scale: Cauchy's scale [m]; None: by the residual.
            fmu: FMU that simulates; None: the problem's first.
        """
        problem = self.problem
        robot = problem.robot_at(z[: len(problem.parameters)])
        simulated, residuals, slow = [], [], []
        for number, run in enumerate(problem.runs):
            path = run.simulated(fmu or problem.fmu, robot)
            rows = self._residuals[number].rows(path, problem.frame_values(z, number))
            simulated.append(path)
            residuals.append(rows)
            slow.append(self.slow[number](rows))
        cost = self.costed(z, tuple(slow), scale)
        return DescentPoint(z, tuple(simulated), tuple(residuals), tuple(slow), *cost)

    def costed(
        self, z: np.ndarray, slow: tuple[np.ndarray, ...], scale: float | None = None
    ) -> tuple[float, float]:
        """Return the scale of the residual [m], unless given, and the robust cost with it.

        Args:
            z: Unknowns, as in `DescentPoint` [1, m, rad, s], (U,).
            slow: Slow parts of the residuals [m], (k, 3) or (k, 6), + c of motors.
            scale: Cauchy's scale [m]; None: by the residual.
        """
        sizes = [np.linalg.norm(rows, axis=1) for rows in slow]
        if scale is None:
            # Rows of more coordinates are longer for the same noise.
            alike = [
                size * _length(3) / _length(rows.shape[1])
                for size, rows in zip(sizes, slow, strict=True)
            ]
            scale = max(FLOOR, _SCALE * float(np.median(np.concatenate(alike))))
        cost = self._counted(scale) * sum(
            mean.independent * float(np.sum(4.0 * np.log1p((size / (2.0 * scale)) ** 2)))
            for mean, size in zip(self.slow, sizes, strict=True)
        )
        return scale, cost + float(np.sum((z / self.problem.prior) ** 2))

    def equations(
        self, now: DescentPoint, effects: Sequence[PoseDerivatives]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return matrix, (U, U), and right side, (U,), of a step, by units of the unknowns."""
        problem, count = self.problem, len(self.problem.parameters)
        matrix = np.diag(problem.prior**-2.0)
        right = -now.z / problem.prior**2
        for number, run in enumerate(problem.runs):
            mean, frame_values = self.slow[number], problem.frame_values(now.z, number)
            # Columns are slow: taken at the means' own times they are their own means.
            time = mean.time + frame_values[6]
            columns = effects[number](now.z[:count], run.measured.time + frame_values[6])
            path = now.simulated[number]
            residual = self._residuals[number]
            frame = residual.by_frame(path, time, problem.frame_size)
            full = np.concatenate([mean(residual.columns(columns)), frame], axis=2)
            where = np.r_[:count, problem.rows_of(number)]
            slow_rows, size = now.slow[number], np.linalg.norm(now.slow[number], axis=1)
            weight = mean.independent / (now.scale**2 * (1.0 + (size / (2.0 * now.scale)) ** 2))
            weight *= self._counted(now.scale)
            matrix[np.ix_(where, where)] += np.einsum(
                "k,kap,kaq->pq", weight, full, full, optimize=True
            )
            right[where] += np.einsum("k,kap,ka->p", weight, full, slow_rows, optimize=True)
        return matrix, right

    def fitted_beside(
        self,
        now: DescentPoint,
        derivatives: Sequence[PoseDerivatives],
        step: np.ndarray,
        fmu: RobotFmu,
    ) -> DescentPoint:
        """Return what a step comes to with all that it does not change fitted to it.

        Args:
            now: The point it begins at.
            derivatives: Derivatives of the pose in every measured run.
            step: Step of the log factors [1], (P,); 0 of those that are fitted to it.
            fmu: FMU that simulates.
        """
        z = now.z.copy()
        z[: len(step)] += step
        after = self.at(z, now.scale, fmu)
        free = np.setdiff1d(np.arange(len(z)), np.flatnonzero(step))
        for _ in range(_FITTED):
            matrix, right = self.equations(after, derivatives)
            z = after.z.copy()
            z[free] += np.linalg.solve(matrix[np.ix_(free, free)], right[free])
            further = self._tried(z, now.scale, fmu)
            if further is None or further.cost >= after.cost:
                break
            after = further
        return after

    def framed(self, x: np.ndarray) -> DescentPoint:
        """Return what given parameters leave behind the frame that fits them best.

        Args:
            x: Log factors [1], (P,).
        """
        count = len(x)
        now = self.at(np.concatenate([x, np.zeros(self.problem.size - count)]))
        for _ in range(_FRAME_ITERATIONS):
            matrix, right = self.equations(now, self.problem.effects)
            step = np.zeros(self.problem.size)
            step[count:] = np.linalg.solve(matrix[count:, count:], right[count:])
            now = self.at(now.z + step)
        return now

    def _counted(self, scale: float) -> float:
        """Return how much rows count, by what they do under Cauchy's scale [m]."""
        return 1.0 if self._variance is None else scale**2 / self._variance

    def _along(
        self, now: DescentPoint, matrix: np.ndarray, right: np.ndarray, damping: float
    ) -> tuple[DescentPoint | None, float]:
        """Return what is better in the direction of a step, damped until it is, and the next damping.

        Levenberg and Marquardt's rule (D. Marquardt, J. SIAM 11 (1963) 431).  None: nothing is better.
        """
        fmus, diagonal = self.problem.fmus, np.diag(np.diag(matrix))
        dampings = damping * _AFTER_WORSE ** np.arange(_TRIED)
        # Mostly the first one does; of others as many at a time as there are FMUs.
        for some in (
            dampings[:1],
            *np.split(dampings[1:], range(len(fmus), _TRIED - 1, len(fmus))),
        ):
            points = [now.z + np.linalg.solve(matrix + factor * diagonal, right) for factor in some]
            results = in_parallel(fmus, points, lambda fmu, z: self._tried(z, now.scale, fmu))
            for factor, after in zip(some.tolist(), results, strict=True):
                if after is not None and after.cost < now.cost:
                    return after, _AFTER_BETTER * factor
        return None, _AFTER_WORSE * float(dampings[-1])

    def _tried(self, z: np.ndarray, scale: float, fmu: RobotFmu) -> DescentPoint | None:
        """Return what some unknowns leave; None of a robot that gives way under its own weight."""
        try:
            return self.at(z, scale, fmu)
        except SimulationError:
            return None
