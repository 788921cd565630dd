"""Level of the noise of a sampled history, whatever its smooth course."""

from __future__ import annotations

import numpy as np

# A difference of third order: what a parabola through three neighbours leaves of the fourth.
_ORDER = 3
# Median of the magnitude of a normal variable over its standard deviation.
_MEDIAN = 0.6744897501960817


def noise_level(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the standard deviation of white noise in a history.

    A divided difference of third order, d = sum_j w_j y_j over four neighbours with
    w_j = 1 / prod_(i != j) (t_j - t_i), is zero for every parabola, whatever the steps.  With the w_j of
    a row scaled to sum_j w_j^2 = 1 it has the standard deviation of the noise, which is estimated from
    the median of its magnitude, sigma = median |d| / 0.6745: jumps and corners in some rows do not
    count.  Variance from differences of neighbours is that of [VonNeumann1941], scaled ones for uneven
    steps, there of second order, are those of [Gasser1986].

    Noise that is filtered shows less, a history that is constant for more than half of its samples
    none.

    Args:
        time: Rising times [s], (n,).
        values: (n,) or (n, k), in any unit.

    Returns:
        The standard deviation of each column, in the unit of `values`, (k,) or (); 0 of fewer than four
        samples, of which nothing can be said.

    Example:
        >>> time = np.linspace(0.0, 10.0, 2001)
        >>> noise = np.random.default_rng(1).normal(0.0, 15.0, time.shape)
        >>> bool(14.0 < noise_level(time, 300.0 * np.sin(time) + noise) < 16.0)
        True
    """
    values = np.asarray(values, dtype=float)
    if len(time) <= _ORDER:
        return np.zeros(values.shape[1:])
    rows = np.arange(len(time) - _ORDER)[:, None] + np.arange(_ORDER + 1)
    apart = time[rows][:, :, None] - time[rows][:, None, :]
    # Over the mean step, so that no product of short ones gets out of range.
    apart /= np.ptp(time[rows], axis=1)[:, None, None] / _ORDER
    apart[:, np.arange(_ORDER + 1), np.arange(_ORDER + 1)] = 1.0
    weights = 1.0 / apart.prod(axis=2)
    weights /= np.linalg.norm(weights, axis=1)[:, None]
    difference = np.einsum("nj,nj...->n...", weights, values[rows])
    return np.median(np.abs(difference), axis=0) / _MEDIAN
