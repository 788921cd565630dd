"""Scrambled Sobol points as SciPy has them: its statistics take half a second to import."""

from __future__ import annotations

import numpy as np

# Bits of a coordinate.
_BITS = 30
# Primitive polynomials of the second axis and those that follow, coefficients as bits, with the first
# direction numbers [JoeKuo2008].
_POLYNOMIALS = (
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
    (103, (1, 1, 1, 15, 7, 5)),
    (109, (1, 3, 1, 15, 13, 25)),
    (115, (1, 1, 5, 5, 19, 61)),
    (131, (1, 3, 7, 11, 23, 15, 103)),
    (137, (1, 3, 7, 13, 13, 15, 69)),
    (143, (1, 1, 3, 13, 7, 35, 63)),
    (145, (1, 3, 5, 9, 1, 25, 53)),
    (157, (1, 3, 1, 13, 9, 35, 107)),
    (167, (1, 3, 1, 5, 27, 61, 31)),
    (171, (1, 1, 5, 11, 19, 41, 61)),
    (185, (1, 3, 5, 3, 3, 13, 69)),
    (191, (1, 1, 7, 13, 1, 19, 1)),
    (193, (1, 3, 7, 5, 13, 19, 59)),
    (203, (1, 1, 3, 9, 25, 29, 41)),
    (211, (1, 3, 5, 13, 23, 1, 55)),
    (213, (1, 3, 7, 3, 13, 59, 17)),
)


def sobol(count: int, width: int, seed: int) -> np.ndarray:
    """Return the first points of a scrambled Sobol sequence, (count, width).

    More points of the same seed begin with these: a study can grow.

    Example:
        >>> bool(np.all(sobol(9, 2, seed=1)[:5] == sobol(5, 2, seed=1)))
        True
    """
    if width > len(_POLYNOMIALS) + 1:
        return _sobol_of_scipy(count, width, seed)
    random = np.random.default_rng(np.random.SeedSequence(seed).spawn(1)[0])
    shift = random.integers(2, size=(width, _BITS), dtype=np.uint32)
    shift = shift @ (1 << np.arange(_BITS, dtype=np.uint32))
    matrix = np.tril(random.integers(2, size=(width, _BITS, _BITS), dtype=np.uint32), -1)
    matrix += np.eye(_BITS, dtype=np.uint32)
    # Linear matrix scrambling: digits, the highest first, are mixed with those above them.
    place = _BITS - 1 - np.arange(_BITS, dtype=np.uint32)
    digits = _direction_numbers(width)[:, None] >> place[:, None] & 1
    directions = ((matrix @ digits & 1) << place[:, None]).sum(axis=1, dtype=np.uint32)
    number = np.arange(count, dtype=np.uint32)
    gray = number ^ number >> 1
    points = np.repeat(shift[None], count, axis=0)
    for digit in range(int(gray.max(initial=0)).bit_length()):
        points[gray >> digit & 1 == 1] ^= directions[:, digit]
    return points * 0.5**_BITS


def _direction_numbers(width: int) -> np.ndarray:
    """Return the direction numbers of axes as integers of so many bits, (width, bits)."""
    numbers = np.ones((width, _BITS), dtype=np.uint32)
    for row, (polynomial, first) in zip(numbers[1:], _POLYNOMIALS, strict=False):
        degree = len(first)
        row[:degree] = first
        for j in range(degree, _BITS):
            row[j] = row[j - degree]
            for k in range(1, degree + 1):
                if polynomial >> (degree - k) & 1:
                    row[j] ^= row[j - k] << k
    return numbers << (_BITS - 1 - np.arange(_BITS, dtype=np.uint32))


def _sobol_of_scipy(count: int, width: int, seed: int) -> np.ndarray:
    from scipy.stats import qmc

    power = max(int(np.ceil(np.log2(count))), 0)
    points: np.ndarray = qmc.Sobol(width, scramble=True, rng=seed).random_base2(power)
    return points[:count]
