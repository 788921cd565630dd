"""Linear least squares with bounds, directions that the data do not see, and a robust loss.

    minimise  sum_i rho(|W_i (z_i - A_i p)|)   over p >= 0

with the rows of one measurement as a block i, whitened by W_i.  Columns are scaled to unit length
here; a direction that the rows do not see keeps p where it starts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import lsq_linear

# Singular values of the scaled columns below this part of the largest are rounding or posture's
# curvature: what the data do not see.
UNSEEN = 1e-6
# A parameter with a larger part, squared, in directions that are not observable is not observable
# itself.
_HELD = 1e-6
# A column shorter than this part of the longest one is none.
_NO_COLUMN = 1e-9
# Huber's constant [standard deviations], 95 % efficient under normal errors.
HUBER = 1.345


@dataclass(frozen=True)
class LinearProblem:
    """A weighted linear problem; `of` makes one.

    Whitened numbers are in standard deviations [1]; each parameter of p has a unit of its own.

    Attributes:
        columns: Whitened A [1 per unit of p], (k, r, P).
        target: Whitened z [1], (k, r).
        start: p where the data do not say, in its units, (P,).
        size: Usual sizes of p, in its units, by which effects are compared, (P,).
        scale: Size of a scaled parameter of 1, in p's units, 1 over the length of its column; 0 where
            that is no column beside the others, (P,).
        unseen: Directions of the scaled parameters that change nothing, (d, P).
        lowest: Lower bounds of p, in its units, 0 or minus infinity, (P,).
    """

    columns: np.ndarray
    target: np.ndarray
    start: np.ndarray
    size: np.ndarray
    scale: np.ndarray
    unseen: np.ndarray
    lowest: np.ndarray

    @classmethod
    def of(cls, columns: np.ndarray, target: np.ndarray, start: np.ndarray) -> LinearProblem:
        """Return a problem of parameters that are usually as large as at the start, and not negative.

        Args:
            columns, target: Whitened A [1 per unit of p], (k, r, P), and z [1], (k, r).
            start: p where the data do not say, in its units, (P,).
        """
        lengths = np.linalg.norm(columns.reshape(-1, columns.shape[-1]), axis=0)
        effect = lengths * start
        observable = effect > _NO_COLUMN * effect.max(initial=0.0)
        scale = np.divide(1.0, lengths, out=np.zeros_like(lengths), where=observable)
        bare = cls(columns, target, start, start, scale, np.empty((0, len(start))), 0.0 * start)
        values, directions = bare.decomposition
        return replace(bare, unseen=directions[values <= UNSEEN * values.max(initial=0.0)])

    def around(self, columns: np.ndarray, target: np.ndarray) -> LinearProblem:
        """Return the problem of the same parameters at another linearisation.

        Args:
            columns, target: Its whitened A [1 per unit of p], (k, r, P), and z [1], (k, r).
        """
        return replace(self, columns=columns, target=target)

    @cached_property
    def scaled(self) -> np.ndarray:
        """A as rows of equations, with scaled columns [1], (k r, P)."""
        return self.columns.reshape(self.target.size, len(self.start)) * self.scale

    @cached_property
    def decomposition(self) -> tuple[np.ndarray, np.ndarray]:
        """Singular values, falling, and directions in rows, of the scaled columns [1], (P,), (P, P)."""
        return _decomposed(self.scaled)

    @property
    def unobservable(self) -> np.ndarray:
        """Mask of parameters that take part in what is not observable, (P,)."""
        return (self.scale == 0.0) | (np.sum(self.unseen**2, axis=0) > _HELD)

    @property
    def rank(self) -> int:
        """Number of directions that the data see."""
        return len(self.start) - len(self.unseen)

    def without(self, row: int) -> LinearProblem:
        """Return the problem without one measurement."""
        return self.around(
            np.delete(self.columns, row, axis=0), np.delete(self.target, row, axis=0)
        )

    def only(self, chosen: np.ndarray) -> LinearProblem:
        """Return the problem with some of the parameters, by a mask, (P,), the others zero."""
        # Of what is not observable, what the others take no part in.
        combinations, values, _ = np.linalg.svd(self.unseen[:, ~chosen])
        taking_part = int(np.count_nonzero(values > UNSEEN))
        return LinearProblem(
            self.columns[:, :, chosen],
            self.target,
            self.start[chosen],
            self.size[chosen],
            self.scale[chosen],
            combinations[:, taking_part:].T @ self.unseen[:, chosen],
            self.lowest[chosen],
        )

    def also(self, column: np.ndarray, size: float, signed: bool = False) -> LinearProblem:
        """Return the problem with one more parameter, zero where it is not observable.

        Args:
            column: Its whitened column [1 per unit of it], (k, r).
            size: Its usual size.
            signed: Whether it may be negative.
        """
        length = float(np.linalg.norm(column))
        effect = np.divide(
            self.size, self.scale, out=np.zeros_like(self.size), where=self.scale > 0
        )
        observable = length * size > _NO_COLUMN * effect.max(initial=0.0)
        directions_before = np.pad(self.unseen, ((0, 0), (0, 1)))
        wider = LinearProblem(
            np.concatenate([self.columns, column[:, :, None]], axis=2),
            self.target,
            np.append(self.start, 0.0),
            np.append(self.size, size),
            np.append(self.scale, 1.0 / length if observable else 0.0),
            directions_before,
            np.append(self.lowest, -np.inf if signed else 0.0),
        )
        values, directions = _decomposed(np.vstack([wider.scaled, directions_before]))
        alike = directions[values <= UNSEEN * values.max(initial=0.0)]
        return replace(wider, unseen=np.vstack([directions_before, alike]))

    def weighted(self, weight: np.ndarray) -> LinearProblem:
        """Return the problem with the equations of each measurement multiplied by a weight, (k,)."""
        return self.around(self.columns * weight[:, None, None], self.target * weight[:, None])

    def residual(self, p: np.ndarray) -> np.ndarray:
        """Return z - A p [1], (k, r), of a p in its units, (P,)."""
        return self.target - self.columns @ p

    @cached_property
    def inverse(self) -> np.ndarray:
        """Pseudoinverse of the scaled columns, with what is not observable held [1], (P, k, r)."""
        inverse = np.linalg.pinv(np.vstack([self.scaled, self.unseen]))
        return inverse[:, : self.target.size].reshape(-1, *self.target.shape)

    @property
    def spread(self) -> np.ndarray:
        """Standard deviations of scaled parameters under residuals of 1 [1], (P,)."""
        return np.linalg.norm(self.inverse, axis=(1, 2))

    def solve(
        self, low: np.ndarray | float | None = None, high: np.ndarray | float = np.inf
    ) -> np.ndarray:
        """Return the p between two bounds that solves best, in its units, (P,).

        Args:
            low: Lower bounds in p's units, (P,) or one for all; None: `lowest`.
            high: Upper bounds in p's units, above the lower ones, (P,) or one for all.
        """
        low = self.lowest if low is None else low
        # The last rows hold what is not observable; they take part in nothing else.
        matrix = np.vstack([self.scaled, self.unseen])
        residual = np.append(-self.residual(self.start).ravel(), np.zeros(len(self.unseen)))
        scale = np.where(self.scale > 0.0, self.scale, 1.0)
        ends = (low - self.start) / scale, (high - self.start) / scale
        step, _ = bounded_step(matrix, residual, *ends)
        solution = np.where(step <= ends[0], low, self.start + self.scale * step)
        return np.clip(solution, low, high)


def _decomposed(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return all singular values, falling, and right directions in rows, of many equations."""
    _, values, directions = np.linalg.svd(np.linalg.qr(matrix, mode="r"), full_matrices=True)
    return np.pad(values, (0, len(directions) - len(values))), directions


def bounded_step(
    matrix: np.ndarray,
    residual: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    damping: float = 0.0,
) -> tuple[np.ndarray, float]:
    """Return the damped step between bounds, any units, (P,), and the predicted decrease of the cost.

    Args:
        matrix, residual: Jacobian, (n, P), and residual, (n,), any unit.
        low, high: Bounds of the step, its units, (P,) each.
        damping: Squares of the step, in parts of those of the columns.
    """
    length = np.linalg.norm(matrix, axis=0)
    scale = 1.0 / np.where(length > 0.0, length, 1.0)
    damped, target = matrix * scale, -residual
    if damping:
        damped = np.vstack([damped, np.sqrt(damping) * np.diag(length > 0.0)])
        target = np.append(target, np.zeros(len(low)))
    step = scale * np.linalg.lstsq(damped, target, rcond=None)[0]
    if np.any((step < low) | (step > high)):
        ends = low / scale, high / scale + 1e-12
        bounded = lsq_linear(damped, target, ends, method="bvls")
        step = np.clip(np.where(bounded.active_mask < 0, low, scale * bounded.x), low, high)
    after = residual + matrix @ step
    return step, float(0.5 * (residual @ residual - after @ after))


def reduced_rows(
    products: np.ndarray, gradient: np.ndarray, damping: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return R, (P, P), and r, (P,), with R^T R the products J^T J and R^T r the gradient J^T r.

    Args:
        products, gradient: Products of all rows, any units, (P, P) and (P,).
        damping: Damping of directions that are not observable, in parts of the columns' squares.
    """
    size = np.sqrt(np.diag(products))
    size[size == 0.0] = 1.0
    scaled = products / np.outer(size, size) + damping * np.eye(len(size))
    matrix = cholesky(scaled) * size
    return matrix, solve_triangular(matrix, gradient, trans="T")


def robust_weights(problem: LinearProblem, p: np.ndarray, loss: str) -> np.ndarray:
    """Return the weights of measurements that a loss gives their residuals, (k,).

    Args:
        problem: The problem, without such weights.
        p: Parameters in their units, (P,).
        loss: "squares" or "huber".
    """
    if loss == "squares":
        return np.ones(len(problem.target))
    size = np.sqrt(np.mean(problem.residual(p) ** 2, axis=1))
    # Median of the root mean square of three normal numbers: 0.888.
    scale = np.median(size) / 0.888
    if scale == 0.0:
        return np.ones(len(size))
    return np.sqrt(np.minimum(1.0, HUBER * scale / np.maximum(size, 1e-300)))


LOSSES = ("squares", "huber")
