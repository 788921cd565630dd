"""Scrambled Sobol points, those of `scipy.stats.qmc`, whose import takes longer than a simulation."""

from __future__ import annotations

import numpy as np

_BITS = 30
# Primitive polynomial, by its coefficients as bits, and first direction numbers of the dimensions behind
# the first one [JoeKuo2008].
_DIMENSIONS = (
    (3, (1,)),
    (7, (1, 3)),
    (11, (1, 3, 1)),
    (13, (1, 1, 1)),
    (19, (1, 1, 3, 3)),
    (25, (1, 3, 5, 13)),
    (37, (1, 1, 5, 5, 17)),
    (41, (1, 1, 5, 5, 5)),
    (47, (1, 1, 7, 11, 19)),
    (55, (1, 1, 5, 1, 1)),
    (59, (1, 1, 1, 3, 11)),
    (61, (1, 3, 5, 5, 31)),
    (67, (1, 3, 3, 9, 7, 49)),
    (91, (1, 1, 1, 15, 21, 21)),
    (97, (1, 3, 1, 13, 27, 49)),
)


def sobol(count: int, width: int, seed: int) -> np.ndarray:
    """Return the first points of a scrambled Sobol sequence, (count, width).

    More points of the same seed begin with these: a study can grow.

    Example:
        >>> bool(np.all(sobol(9, 2, seed=1)[:5] == sobol(5, 2, seed=1)))
        True
    """
    power = max(int(np.ceil(np.log2(count))), 0)
    if width > 1 + len(_DIMENSIONS):
        from scipy.stats import qmc

        shares: np.ndarray = qmc.Sobol(width, scramble=True, rng=seed).random_base2(power)
        return shares[:count]
    rng, places = np.random.default_rng(seed).spawn(1)[0], np.arange(_BITS)
    # A random shift, and of each dimension a random lower triangular matrix, from the highest bit on.
    points = (rng.integers(2, size=(width, _BITS), dtype=np.uint32) @ (1 << places))[None]
    matrices = np.tril(rng.integers(2, size=(width, _BITS, _BITS), dtype=np.uint32), -1)
    numbers = np.stack([_direction_numbers(k) for k in range(width)])
    bits = numbers[:, None] >> places[::-1, None] & 1
    directions = (1 << places[::-1]) @ ((matrices + np.eye(_BITS, dtype=int)) @ bits % 2)
    # In the order of Gray's code: the second half is the first one backwards, with one bit more.
    for bit in range(power):
        points = np.concatenate([points, points[::-1] ^ directions[:, bit]])
    return points[:count] / 2.0**_BITS


def _direction_numbers(dimension: int) -> np.ndarray:
    """Return the direction numbers of a dimension, from the highest bit on, (bits,)."""
    if dimension == 0:
        return 1 << np.arange(_BITS)[::-1]
    polynomial, first = _DIMENSIONS[dimension - 1]
    degree = len(first)
    numbers = list(first)
    for _ in range(degree, _BITS):
        number = numbers[-degree] ^ (numbers[-degree] << degree)
        for k in range(1, degree):
            if polynomial >> (degree - k) & 1:
                number ^= numbers[-k] << k
        numbers.append(number)
    return np.array(numbers) << np.arange(_BITS)[::-1]
