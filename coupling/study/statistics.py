"""Quantiles of what sampled robots leave, and significance of parameters: statistics of a table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.results.study_result import ShareResult

# Degrees of the polynomials that tell a parameter's share, the first for which there are samples enough:
# even ones see a deviation that grows to both sides, which a correlation is blind to.
_DEGREES = (4, 2)
# Samples for each coefficient of the polynomials, at least.
_SAMPLES_EACH = 4


def quantile(values: np.ndarray, share: float) -> np.ndarray:
    """Return what a further value does not exceed with a probability, in the mean over samples.

    Of n sorted values the k-th is not exceeded by a further one with probability k / (n + 1) (Weibull's
    plotting position, exact for every continuous distribution); in between it is linear.

    Args:
        values: Independent values, any unit, (n,) or (n, m) for m columns.

    Returns:
        One value, or m; the extremes of the sample where n is too small for the probability.

    Example:
        >>> float(quantile(np.arange(1.0, 20.0), 0.95))
        19.0
    """
    return np.quantile(values, share, axis=0, method="weibull")


def samples_for(coverage: float) -> int:
    """Return the number of samples at which a band of quantiles first holds a share of further ones.

    Example:
        >>> samples_for(0.9)
        19
    """
    return int(np.ceil(2.0 / (1.0 - coverage) - 1e-9)) - 1


@dataclass(frozen=True)
class DeviationBand:
    """Where the deviation of a further robot lies along the path.

    Attributes:
        coverage: Share c of further robots.
        low, median, high: Quantiles (1 - c)/2, 1/2, (1 + c)/2 of the deviation at every place [m], (m,):
            at each place by itself, a share c of further robots lies between low and high.
        everywhere: Limit below which a share c of further robots stays at all places at once [m], (m,).
    """

    coverage: float
    low: np.ndarray
    median: np.ndarray
    high: np.ndarray
    everywhere: np.ndarray

    @classmethod
    def of(cls, distance: np.ndarray, coverage: float) -> DeviationBand:
        """Return the band of sampled deviations.

        Args:
            distance: Deviation of every sample at every place [m], >= 0, (n, m), n >= 2.
        """
        tail = 0.5 * (1.0 - coverage)
        low, median, high = (quantile(distance, share) for share in (tail, 0.5, 1.0 - tail))
        return cls(coverage, low, median, high, _limit(distance, coverage))


def _limit(distance: np.ndarray, share: float) -> np.ndarray:
    """Return the limit, a multiple of the root mean square at every place, below which a share stays.

    How far a robot goes, its largest ratio to the root mean square, is one number for the whole path; to
    be as far as a further robot it is taken of the other samples alone.
    """
    count = len(distance)
    squares = distance**2
    whole = squares.sum(axis=0)
    others = np.sqrt(np.maximum(whole - squares, 0.0) / (count - 1))
    ratio = np.divide(distance, others, out=np.zeros_like(distance), where=others > 0.0)
    return quantile(ratio.max(axis=1), share) * np.sqrt(whole / count)


def influences(points: np.ndarray, figure: np.ndarray) -> tuple[ShareResult, ...] | None:
    """Return the significance of each parameter for a figure, out of samples as they are.

    The figure is fitted by a sum of a polynomial of each parameter, Legendre's to degree 4 or, with
    fewer samples, 2, which are orthogonal over uniform probabilities.  The share is the variance of a
    part over the figure's; of n independent samples, chance alone puts degree / n of it there.  What is
    left is of several parameters together, or not a polynomial.

    Args:
        points: Probabilities of the parameters' values [1], (n, k), each column uniform in 0 to 1.
        figure: Figure of every sample, any unit, (n,).

    Returns:
        One for each parameter; None where there are too few samples to tell.

    Example:
        >>> x = np.random.default_rng(1).random((200, 2))
        >>> both = influences(x, np.abs(x[:, 0] - 0.5))
        >>> [round(own.share, 1) for own in both], abs(both[0].rank_correlation) < 0.2
        ([1.0, 0.0], True)
    """
    count, width = points.shape
    enough = [d for d in _DEGREES if count >= _SAMPLES_EACH * (width * d + 1)]
    if width == 0 or not enough:
        return None
    degree = enough[0]
    from scipy.stats import spearmanr

    # Equal figures may have a variance by rounding.
    variance = float(np.var(figure))
    if np.ptp(figure) == 0.0:
        return (ShareResult(share=0.0, rank_correlation=0.0),) * width
    parts = [np.polynomial.legendre.legvander(2.0 * x - 1.0, degree)[:, 1:] for x in points.T]
    terms = np.column_stack([np.ones(count), *parts])
    weights, *_ = np.linalg.lstsq(terms, figure, rcond=None)
    # Legendre's P_k has the mean square 1 / (2 k + 1).
    squares = weights[1:].reshape(width, degree) ** 2 / (2.0 * np.arange(1, degree + 1) + 1.0)
    shares = np.clip(squares.sum(axis=1) / variance, 0.0, 1.0)
    ranks = [float(spearmanr(x, figure).statistic) for x in points.T]
    return tuple(
        ShareResult(share=share, rank_correlation=rank)
        for share, rank in zip(shares.tolist(), ranks, strict=True)
    )


def parts_of_path(time: np.ndarray, parts: int) -> np.ndarray:
    """Return the numbers of the first rows of equal parts of a path's time [s], (m,), m <= parts."""
    edges = np.searchsorted(time, np.linspace(time[0], time[-1], parts + 1)[:-1])
    return np.unique(edges)
