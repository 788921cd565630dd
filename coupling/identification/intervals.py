"""How sure fitted parameters are: 95 % intervals, and errors of rows that were left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from coupling.identification.least_squares import LinearProblem

# A direction of a row's numbers that the others predict with ten times its own noise or more, 1 - H of
# this or less, is known from that row alone: no prediction of it, no jackknife.
_ALONE = 1e-2
# A parameter rests on a row that alone identifies so large a part of its deviation.
_RESTS = 0.5


@dataclass(frozen=True)
class ConfidenceIntervals:
    """95 % intervals of parameters.

    Attributes:
        low, high: Ends in p's units, not negative; infinite where nothing bounds them, (P,).
        freedom: Numbers measured more than directions that the data see.
        scale: Root mean square of the whitened residual per degree of freedom [1]: 1 where given
            standard deviations are right.
        rests_on: Index of the row that alone identifies a parameter, -1 for none, (P,).
        against: Mask of parameters that would be negative, their whole interval: deflections go against
            their load, and they are taken for zero, (P,).
    """

    low: np.ndarray
    high: np.ndarray
    freedom: int
    scale: float
    rests_on: np.ndarray
    against: np.ndarray


def intervals(
    problem: LinearProblem, weight: np.ndarray, values: np.ndarray, is_noise_known: bool
) -> ConfidenceIntervals:
    """Return intervals around the unbounded least squares solution, as wide as the wider of two.

    One from the residual's variance (at least 1 where standard deviations were given), with all
    numbers independent; one by the jackknife over rows, which needs neither equal variances nor
    independence within a row (Bell and McCaffrey 2002, docs/references.md).

    Args:
        problem: The problem without weights of the loss.
        weight: Those weights, (k,).
        values: The bounded solution in p's units, which the interval is made to contain, (P,).
        is_noise_known: Whether the standard deviations behind the whitening were given.
    """
    weighted = problem.weighted(weight)
    chosen = np.ones(len(values), dtype=bool)
    while True:
        centre, half, freedom, scale, rests_on = _unbounded(weighted.only(chosen), is_noise_known)
        against = centre + half < 0.0
        if not against.any():
            break
        chosen[np.flatnonzero(chosen)[against]] = False
    low, high, alone = np.zeros(len(values)), values.copy(), np.full(len(values), -1)
    unseen = ~np.isfinite(half)
    low[chosen] = np.where(unseen, 0.0, np.maximum(centre - np.where(unseen, 0.0, half), 0.0))
    high[chosen] = centre + half
    alone[chosen] = rests_on
    return ConfidenceIntervals(
        np.minimum(low, values), np.maximum(high, values), freedom, scale, alone, ~chosen
    )


def _unbounded(
    weighted: LinearProblem, is_noise_known: bool
) -> tuple[np.ndarray, np.ndarray, int, float, np.ndarray]:
    """Return centre and half width of the intervals, degrees of freedom, scale and rows rested on."""
    rows, freedom = len(weighted.target), weighted.target.size - weighted.rank
    centre = weighted.solve(-np.inf)
    residual = weighted.residual(centre)
    scale = float(np.sqrt(np.sum(residual**2) / freedom)) if freedom > 0 else np.nan
    deviation = np.nanmax([scale, 1.0]) if is_noise_known else scale
    if freedom > 0:
        half = quantile(freedom) * deviation * weighted.spread
    else:
        half = (quantile(np.inf) if is_noise_known else np.inf) * weighted.spread
    shifts, rests_on = _jackknife(weighted, residual)
    if rows > 1 and freedom > 0:
        of_rows = np.sqrt((rows - 1) / rows * np.sum(shifts**2, axis=1))
        half = np.maximum(half, quantile(rows - 1) * np.where(rests_on < 0, of_rows, 0.0))
    return (
        centre,
        np.where(weighted.unobservable, np.inf, half * weighted.scale),
        freedom,
        scale,
        rests_on,
    )


def _jackknife(weighted: LinearProblem, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how scaled parameters move without each row, (P, k), and the rows that they rest on.

    p_(i) - p = -(A^T A)^-1 A_i^T (1 - H_ii)^-1 e_i with the residual e_i of row i and its block H_ii of
    the hat matrix.

    Args:
        weighted: The problem with k rows.
        residual: Its residual, (k, r).
    """
    rows, width = residual.shape
    inverse, spread = weighted.inverse, weighted.spread
    columns = weighted.scaled.reshape(rows, width, len(inverse))
    shifts, rests_on = np.zeros((len(inverse), rows)), np.full(len(inverse), -1)
    for i in range(rows):
        hat = columns[i] @ inverse[:, i]
        values, vectors = np.linalg.eigh(np.eye(width) - 0.5 * (hat + hat.T))
        alone = values < _ALONE
        part_alone = np.linalg.norm(inverse[:, i] @ vectors[:, alone], axis=1)
        rests_on[part_alone > _RESTS * np.maximum(spread, 1e-300)] = i
        rotated = vectors.T @ residual[i] / np.where(alone, np.inf, values)
        shifts[:, i] = -inverse[:, i] @ (vectors @ rotated)
    return shifts, rests_on


def left_out(problem: LinearProblem, weight: np.ndarray) -> np.ndarray:
    """Return the whitened error of each row predicted by a fit of all the others [1], (k, r).

    In closed form, but where a bound would hold.  What the row alone identifies is no error.

    Args:
        problem: The problem without weights of the loss.
        weight: Those weights, kept, (k,).
    """
    weighted = problem.weighted(weight)
    p = weighted.solve(-np.inf)
    shifts, _ = _jackknife(weighted, weighted.residual(p))
    others = p[:, None] + problem.scale[:, None] * shifts
    lowest = problem.lowest
    for i in np.flatnonzero(np.any(others < lowest[:, None], axis=0)):
        others[:, i] = weighted.without(int(i)).solve()
    return problem.target - np.einsum("krp,pk->kr", problem.columns, others)


def quantile(freedom: float) -> float:
    """Return half a 95 % interval by the standard deviation, of Student's distribution.

    Args:
        freedom: Degrees of freedom, > 0; infinite for a normal one.
    """
    return float(stdtrit(freedom, 0.975))
