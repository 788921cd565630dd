"""The fit: what the simulated robot leaves of the measurement, by parameters, frame and clock.

Gauss and Newton's method on the slow part of the residual of the forward simulation, with weights by
Cauchy's law and a prior; first with the derivatives of `coupling.learn.effect`, then with those of
`coupling.learn.secant`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from coupling.learn.aside import Held, steps_aside
from coupling.learn.parameters import changed
from coupling.learn.passes import Simulated
from coupling.learn.problem import Columns, Problem
from coupling.learn.residual import Residual, noise_of
from coupling.learn.secant import Secant
from coupling.learn.smoothing import CUT_OFF, SlowPart

# Smallest scale of the residual's slow part [m]: below it lies what the model itself is not worth.
_FLOOR = 1e-6
_MOST_PASSES, _FRAME_PASSES, _FITTED = 12, 3, 2
# Damping of a step, as part of the diagonal, one after the other until it makes the fit better.
_DAMPINGS = (0.0, 0.1, 0.5, 2.0, 10.0, 50.0)
# A step that explains less ends the fit; noise explains 1 for every unknown.
_SETTLED = 0.3
# Where a fit ends in a hollow beside the valley it leaves more than noise, and is tried again from
# beside it, so many times at most; from so many gears' best sides if the first of them lead no further.
_TRIES, _NEAR_NOISE, _SIDES = 4, 1.2, 3
# Cauchy's scale, by the median of the residual.
_SCALE = 1.5
# Median length of a row of noise of size 1, by the number of its coordinates.
_LENGTHS = {count: float(np.sqrt(chi2.median(count))) for count in (3, 6)}


@dataclass(frozen=True)
class Fit:
    """A fit.

    Attributes:
        z: Log factors of the parameters, then frame and clock of every pass.
        residuals: Measured less simulated positions of every pass [m], (n, 3); where orientations were
            measured with these in three more coordinates, as in `coupling.learn.residual`.
        slow: Their slow parts [m], (k, 3) or (k, 6).
        covariance: Of all unknowns, as if residuals were noise and the derivatives right.
        converged: Whether the last step explained next to nothing.
    """

    z: np.ndarray
    residuals: tuple[np.ndarray, ...]
    slow: tuple[np.ndarray, ...]
    covariance: np.ndarray
    converged: bool


@dataclass(frozen=True)
class _At:
    """The residual at some unknowns, and its robust cost."""

    z: np.ndarray
    simulated: tuple[Simulated, ...]
    residuals: tuple[np.ndarray, ...]
    slow: tuple[np.ndarray, ...]
    scale: float
    cost: float


def size_of(parts: Sequence[np.ndarray]) -> float:
    """Return the rms length of the positions in rows of several passes [m]."""
    squares = [np.sum(rows[:, :3] ** 2, axis=1) for rows in parts]
    return float(np.sqrt(np.mean(np.concatenate(squares))))


class Fitter:
    """Fits one problem, also to other measurements at the same times.

    Args:
        problem: The problem.
        cut_off: Frequency up to which residuals are looked at [Hz].
    """

    def __init__(self, problem: Problem, cut_off: float = CUT_OFF) -> None:
        self.problem = problem
        self._residuals = tuple(map(Residual, problem.passes))
        self._slow = tuple(SlowPart.of(one.seen.time, cut_off) for one in problem.passes)

    def fit(self, start: np.ndarray) -> Fit:
        """Return the most likely parameters.

        Args:
            start: Log factors to begin at, (P,).
        """
        problem = self.problem
        z = np.zeros(problem.size)
        z[: len(start)] = start
        now, _ = self._descend(self._at(z), problem.effects)
        secants = problem.secants()
        now, converged = self._descend(now, secants)
        sides = self._sides(now, secants)
        for _ in range(_TRIES):
            beside = None if self._is_noise(now) else next(sides, None)
            if beside is None:
                break
            other, settled = self._descend(beside, secants)
            if self._costed(other.z, other.slow, now.scale)[1] < now.cost - _SETTLED:
                now, converged = other, settled
                sides = self._sides(now, secants)
        matrix, _ = self._equations(now, secants)
        covariance = np.linalg.inv(matrix)
        return Fit(now.z, now.residuals, now.slow, covariance, converged)

    def noise(self, residuals: Sequence[np.ndarray]) -> float:
        """Return what the slow parts of residuals would be of their noise alone [m], rms."""
        noise = noise_of([rest[:, :3] for rest in residuals])
        return noise * float(np.sqrt(3.0 * np.mean([mean.of_noise for mean in self._slow])))

    def _descend(self, now: _At, effects: Sequence[Columns]) -> tuple[_At, bool]:
        """Return the best that derivatives lead to, and whether they lead no further."""
        for _ in range(_MOST_PASSES):
            after = self._along(now, *self._equations(now, effects))
            gained = 0.0 if after is None else now.cost - after.cost
            if after is not None:
                scale, cost = self._costed(after.z, after.slow)
                now = replace(after, scale=scale, cost=cost)
            if gained < _SETTLED:
                return now, True
        return now, False

    def _is_noise(self, now: _At) -> bool:
        """Whether hardly more is left than noise."""
        return size_of(now.slow) <= _NEAR_NOISE * self.noise(now.residuals)

    def _sides(self, now: _At, secants: Sequence[Secant]) -> Iterator[_At]:
        """Yield where to try again: beside what was found, in backlash and damping of one gear each.

        All else is fitted to these with derivatives that are known, which tells a gear's best side.
        """
        held = self._held(now, secants)
        shown = {int(k) for own in secants for k in own.shown}
        found = []
        for steps in steps_aside(self.problem.parameters, shown):
            tried = [self._fitted_beside(now, held, step) for step in steps]
            found.append(min(tried, key=lambda own: own.cost))
        yield from sorted(found, key=lambda own: own.cost)[:_SIDES]

    def _held(self, now: _At, effects: Sequence[Columns]) -> list[Held]:
        """Return the derivatives at some unknowns, to be taken for those of others."""
        problem, count = self.problem, len(self.problem.parameters)
        times = [one.seen.time + problem.own(now.z, k)[6] for k, one in enumerate(problem.passes)]
        x = now.z[:count]
        return [Held(own.columns(x, time)) for own, time in zip(effects, times, strict=True)]

    def _fitted_beside(self, now: _At, held: Sequence[Columns], step: np.ndarray) -> _At:
        """Return what a step comes to with all that it does not change fitted to it."""
        z = now.z.copy()
        z[: len(step)] += step
        after = self._at(z, now.scale)
        free = np.setdiff1d(np.arange(len(z)), np.flatnonzero(step))
        for _ in range(_FITTED):
            matrix, right = self._equations(after, held)
            z = after.z.copy()
            z[free] += np.linalg.solve(matrix[np.ix_(free, free)], right[free])
            further = self._at(z, now.scale)
            if further.cost >= after.cost:
                break
            after = further
        return after

    def without(self, x: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the slow parts of what given parameters leave, behind the frame that fits them best.

        Args:
            x: Log factors, (P,).
        """
        count = len(x)
        now = self._at(np.concatenate([x, np.zeros(self.problem.size - count)]))
        for _ in range(_FRAME_PASSES):
            matrix, right = self._equations(now, self.problem.effects)
            step = np.zeros(self.problem.size)
            step[count:] = np.linalg.solve(matrix[count:, count:], right[count:])
            now = self._at(now.z + step)
        return now.slow

    def _along(self, now: _At, matrix: np.ndarray, right: np.ndarray) -> _At | None:
        """Return what is better in the direction of a step, damped until it is, or None."""
        for damping in _DAMPINGS:
            step = np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), right)
            after = self._at(now.z + step, now.scale)
            if after.cost < now.cost:
                return after
        return None

    def _at(self, z: np.ndarray, scale: float | None = None) -> _At:
        problem = self.problem
        values = changed(problem.parameters, z[: len(problem.parameters)])
        simulated, residuals, slow = [], [], []
        for number, one in enumerate(problem.passes):
            path = one.simulated(problem.fmu, values)
            rest = self._residuals[number].rows(path, problem.own(z, number))
            simulated.append(path)
            residuals.append(rest)
            slow.append(self._slow[number](rest))
        told = self._costed(z, tuple(slow), scale)
        return _At(z, tuple(simulated), tuple(residuals), tuple(slow), *told)

    def _costed(
        self, z: np.ndarray, slow: tuple[np.ndarray, ...], scale: float | None = None
    ) -> tuple[float, float]:
        """Return the scale of the residual, unless given, and the robust cost with it."""
        sizes = [np.linalg.norm(rest, axis=1) for rest in slow]
        if scale is None:
            # Rows of more coordinates are longer for the same noise.
            alike = [
                size * _LENGTHS[3] / _LENGTHS[rest.shape[1]]
                for size, rest in zip(sizes, slow, strict=True)
            ]
            scale = max(_FLOOR, _SCALE * float(np.median(np.concatenate(alike))))
        cost = sum(
            mean.independent * float(np.sum(4.0 * np.log1p((size / (2.0 * scale)) ** 2)))
            for mean, size in zip(self._slow, sizes, strict=True)
        )
        return scale, cost + float(np.sum((z / self.problem.prior) ** 2))

    def _equations(self, now: _At, effects: Sequence[Columns]) -> tuple[np.ndarray, np.ndarray]:
        """Return matrix and right side of a step."""
        problem, count = self.problem, len(self.problem.parameters)
        matrix = np.diag(problem.prior**-2.0)
        right = -now.z / problem.prior**2
        for number, one in enumerate(problem.passes):
            mean, own = self._slow[number], problem.own(now.z, number)
            # Columns are slow: taken at the means' own times they are their own means.
            time = mean.time + own[6]
            columns = effects[number].columns(now.z[:count], one.seen.time + own[6])
            path = now.simulated[number]
            residual = self._residuals[number]
            frame = residual.by_frame(path, time, problem.frame_size)
            full = np.concatenate([mean(residual.columns(columns)), frame], axis=2)
            where = np.r_[:count, problem.rows_of(number)]
            rest, size = now.slow[number], np.linalg.norm(now.slow[number], axis=1)
            weight = mean.independent / (now.scale**2 * (1.0 + (size / (2.0 * now.scale)) ** 2))
            matrix[np.ix_(where, where)] += np.einsum(
                "k,kap,kaq->pq", weight, full, full, optimize=True
            )
            right[where] += np.einsum("k,kap,ka->p", weight, full, rest, optimize=True)
        return matrix, right
