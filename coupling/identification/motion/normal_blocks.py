"""Normal equations of a fit, block of time by block, and the intervals that they give.

Residuals are correlated over time and between channels, those of one block and of the next hardly:
blocks are many times as long as the correlation [Kunsch1989].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.identification.intervals import quantile

# Length of a block over the correlation time, and how many there are at least and at most.
_TIMES, _FEWEST, _MOST = 12.0, 12, 60
# A direction of which all other blocks have less than this part of the information is a block's alone.
_ALONE = 1e-2
# Eigenvalues of scaled normal matrices below this part of the largest are not observable.
_UNOBSERVABLE = 1e-11


def correlation_time(residual: np.ndarray) -> float:
    """Return the integrated correlation time of the slowest channel [rows]: 1 of white noise.

    Args:
        residual: Residuals, any unit, (n, channels).
    """
    from scipy.signal import correlate

    longest = 1.0
    for channel in residual.T:
        centred = channel - channel.mean()
        covariance = correlate(centred, centred, method="fft")[len(centred) - 1 :]
        if covariance[0] <= 0.0:
            continue
        correlation = covariance / covariance[0]
        ends = np.flatnonzero(correlation <= 0.0)
        last = int(ends[0]) if len(ends) else len(correlation)
        longest = max(longest, float(1.0 + 2.0 * np.sum(correlation[1:last])))
    return longest


@dataclass(frozen=True)
class NormalBlocks:
    """Normal equations of least squares, block of time by block: sums over g are the whole problem.

    Attributes:
        matrices: J^T J of each block [1], (g, P, P).
        vectors: -J^T r of each block [1], (g, P).
        prior: Weights of squares of departures from what is known before [1], (P,).
        away: Difference of the values from what is known before [1], (P,).
        correlated: Number of rows that count as one beside the prior.
    """

    matrices: np.ndarray
    vectors: np.ndarray
    prior: np.ndarray
    away: np.ndarray
    correlated: float = 1.0

    @classmethod
    def of(cls, jacobians: Sequence[np.ndarray], residuals: Sequence[np.ndarray]) -> NormalBlocks:
        """Return the blocks of a linearised problem without what is known before.

        Args:
            jacobians: Derivatives of each recording's residual [1], (n, channels, P).
            residuals: The weighed residuals [1], (n, channels).
        """
        length = _TIMES * max(correlation_time(rows) for rows in residuals)
        rows_in_all = sum(map(len, residuals))
        total = int(np.clip(rows_in_all / length, _FEWEST, _MOST))
        matrices, vectors = [], []
        for rows, columns in zip(residuals, jacobians, strict=True):
            count = max(1, round(total * len(rows) / rows_in_all))
            for r, a in zip(
                np.array_split(rows, count), np.array_split(columns, count), strict=True
            ):
                flat = a.reshape(-1, a.shape[2])
                matrices.append(flat.T @ flat)
                vectors.append(-flat.T @ r.ravel())
        none = np.zeros(jacobians[0].shape[2])
        return cls(np.array(matrices), np.array(vectors), none, none)

    def only(self, chosen: np.ndarray, others: np.ndarray) -> NormalBlocks:
        """Return the problem of some parameters with the others moved.

        Args:
            chosen: Mask of those that stay, (P,).
            others: Change of the others [1], (P,); what stands at those chosen does not count.
        """
        shift = self.matrices[:, :, ~chosen] @ others[~chosen]
        return NormalBlocks(
            self.matrices[:, chosen][:, :, chosen],
            (self.vectors - shift)[:, chosen],
            self.prior[chosen],
            self.away[chosen],
            self.correlated,
        )

    @cached_property
    def _matrix(self) -> np.ndarray:
        return self.matrices.sum(axis=0) + np.diag(self.prior)

    @cached_property
    def _root(self) -> np.ndarray:
        return _root_of_inverse(self._matrix)

    @cached_property
    def _inverse(self) -> np.ndarray:
        """Inverse of the whole problem's matrix, zero along what it does not see."""
        return self._root @ self._root.T

    @cached_property
    def step(self) -> np.ndarray:
        """Solution of the whole problem [1], (P,)."""
        return self._inverse @ (self.vectors.sum(axis=0) + self.prior * self.away)

    @property
    def spread(self) -> np.ndarray:
        """Variances of the solution, were so many rows one and of size 1 [1], (P,)."""
        return self.correlated * np.diag(self._inverse)

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviations of the solution by its blocks and by the prior [1], (P,).

        A block's part of the gradient counts by the root of the information that all others have
        [BellMcCaffrey2002].  A fit without the block, the jackknife, counts it by that information
        itself: too much, where a few blocks carry what tells a parameter.
        """
        solution, root = self.step, self._root
        variance = self.correlated * self._inverse**2 @ self.prior
        for matrix, vector in zip(self.matrices, self.vectors, strict=True):
            share, axes = np.linalg.eigh(root.T @ matrix @ root)
            rotated = root @ axes
            others = np.maximum(1.0 - share, _ALONE)
            shift = rotated @ (rotated.T @ (vector - matrix @ solution) / np.sqrt(others))
            variance += shift**2
        return np.where(np.diag(self._matrix) > 0.0, np.sqrt(variance), np.inf)

    @property
    def half(self) -> np.ndarray:
        """Half of 95 % intervals over the standard deviations [1], (P,).

        Student's, with the number of blocks that carry the information on a parameter, which may be few.
        """
        information = np.sum((self._inverse @ self.matrices) * self._inverse, axis=2)
        whole = np.maximum(np.sum(information**2, axis=0), 1e-300)
        count = np.maximum(np.sum(information, axis=0) ** 2 / whole, 2.0)
        return np.array([quantile(blocks - 1.0) for blocks in count.tolist()])


def _root_of_inverse(matrix: np.ndarray) -> np.ndarray:
    """Return R with R R^T the inverse of normal equations, zero along what they do not see."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    scale[scale == 0.0] = np.inf
    values, axes = np.linalg.eigh(matrix / np.outer(scale, scale))
    observable = values > _UNOBSERVABLE * values.max(initial=0.0)
    part = np.divide(1.0, np.sqrt(np.abs(values)), out=np.zeros_like(values), where=observable)
    return axes * part / scale[:, None]
