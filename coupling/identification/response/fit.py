"""The fit to frequency responses: start, restarts over a common factor, noise, intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.identification.estimate import Estimate, estimate
from coupling.identification.response.experiment import (
    PostureResponse,
    ResponseExperiment,
    ResponseLinearisation,
)

# Common factors of all stiffnesses that the fit may start from.
_FACTORS = (0.5, 0.63, 0.8, 1.0, 1.25, 1.6, 2.0)
# Standard deviation of the residual before it is estimated, and the least: peaks that are elsewhere;
# and what no linearisation of a robot is better than [1].
_FIRST, _LEAST = 0.5, 0.01
# Times that it is estimated, steps of each fit at most, and predicted gain that ends it.
_ROUNDS, _MOST_STEPS, _SETTLED = 3, 60, 1e-4
# Logs of factors at most [1].
_FARTHEST = 4.0
# Median of |r| of normal r, in standard deviations.
_MEDIAN = 0.6745
# Residuals within a band so wide [octaves] are taken for one another's.
_BAND = 1.0 / 3.0


@dataclass(frozen=True)
class ResponseFit:
    """Fitted parameters.

    Attributes:
        estimate: The estimate.
        deviation: Standard deviations of the parameters, their units, (P,).
    """

    estimate: Estimate[ResponseLinearisation]
    deviation: np.ndarray

    @property
    def x(self) -> np.ndarray:
        """Values of the parameters, their units, (P,)."""
        return self.estimate.x


def fit_responses(
    experiment: ResponseExperiment, fixed: np.ndarray, start: ResponseFit | None = None
) -> ResponseFit:
    """Fit a robot to its frequency responses.

    Args:
        experiment: The experiment.
        fixed: Values that are known, NaN for those that are fitted, units of the parameters, (P,).
        start: A fit to begin with; None: restarts over a common factor of all stiffnesses.
    """
    is_free = np.isnan(fixed)
    count = len(experiment.stiffness)
    if start is None:
        starts = []
        for factor in _FACTORS:
            x = np.where(is_free, 0.0, fixed)
            x[:count] = np.where(is_free[:count], np.log(factor), x[:count])
            starts.append(replace(experiment, deviation=_FIRST).at(x))
        estimated = _estimate(min(starts, key=lambda point: point.robust_cost), is_free)
    else:
        estimated = start.estimate
    for _ in range(_ROUNDS):
        residual = estimated.linearisation.residual
        size = np.median(np.abs([residual.real, residual.imag])) / _MEDIAN
        experiment = replace(experiment, deviation=max(float(size), _LEAST))
        x = np.where(is_free, estimated.x, fixed)
        estimated = _estimate(experiment.at(x), is_free)
    return ResponseFit(estimated, _deviations(estimated.linearisation, is_free))


def _estimate(start: ResponseLinearisation, is_free: np.ndarray) -> Estimate[ResponseLinearisation]:
    low = np.where(is_free, -_FARTHEST, start.x)
    high = np.where(is_free, _FARTHEST, start.x)
    return estimate(start, (low, high), _MOST_STEPS, _SETTLED)


def _deviations(point: ResponseLinearisation, is_free: np.ndarray) -> np.ndarray:
    """Return the standard deviations of the parameters, their units, (P,); 0 for those that are fixed.

    The larger of two: by independent residuals, and by residuals that within a band of a response are
    one another's (clusters, Liang and Zeger 1986,
    docs/references.md), as errors of a model are.
    """
    matrix, residual = point.rows
    matrix = matrix[:, is_free]
    inverse = np.linalg.pinv(matrix.T @ matrix)
    scores = matrix * residual[:, None]
    count = len(point.residual)
    bands = np.concatenate(_bands(point.experiment.postures))
    sums = np.zeros((bands.max() + 1, matrix.shape[1]))
    for part in (scores[:count], scores[count : 2 * count]):
        np.add.at(sums, bands, part)
    clustered = inverse @ sums.T @ sums @ inverse
    deviation = np.zeros(len(is_free))
    deviation[is_free] = np.sqrt(np.maximum(np.diag(inverse), np.diag(clustered)))
    return deviation


def _bands(postures: Sequence[PostureResponse]) -> list[np.ndarray]:
    """Return the number of the band of each residual, counted over all responses, (n,) each."""
    bands, before = [], 0
    for posture in postures:
        for response in posture.in_order:
            octaves = np.log2(response.frequency / response.frequency[0])
            _, numbers = np.unique((octaves / _BAND).astype(int), return_inverse=True)
            bands.append(before + numbers)
            before += int(numbers.max()) + 1
    return bands
