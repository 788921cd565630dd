"""Scrambled Sobol points, those of SciPy's `qmc.Sobol`, whose package takes a second to import."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy

# Binary digits of a coordinate.
_DIGITS = 30


def sobol(count: int, width: int, seed: int) -> np.ndarray:
    """Return the first points of a scrambled Sobol sequence [Joe2008], (count, width).

    Digits are scrambled by a random lower triangular matrix and a random shift [Matousek1998]. More
    points of the same seed begin with these: a study can grow.

    Example:
        >>> bool(np.all(sobol(9, 2, seed=1)[:5] == sobol(5, 2, seed=1)))
        True
    """
    (rng,) = np.random.default_rng(seed).spawn(1)
    value = 1 << np.arange(_DIGITS)
    shift = rng.integers(2, size=(width, _DIGITS), dtype=np.uint32) @ value
    shape = (width, _DIGITS, _DIGITS)
    lower = np.tril(rng.integers(2, size=shape, dtype=np.uint32), -1) + np.eye(
        _DIGITS, dtype=np.int64
    )
    directions = value[::-1] @ (lower @ _direction_digits(width) % 2)
    number, points = np.arange(count), np.tile(shift, (count, 1))
    gray_code = number ^ number >> 1
    for k in range(max(count - 1, 0).bit_length()):
        points[gray_code >> k & 1 == 1] ^= directions[:, k]
    return points / 2.0**_DIGITS


def _direction_digits(width: int) -> np.ndarray:
    """Return the digits of the direction numbers, the first ones first, (width, digits, numbers)."""
    with np.load(Path(scipy.__file__).parent / "stats" / "_sobol_direction_numbers.npz") as table:
        polynomials, starts = table["poly"][1:width].tolist(), table["vinit"][1:width]
    numbers = np.ones((width, _DIGITS), dtype=np.int64)
    for row, polynomial, start in zip(numbers[1:], polynomials, starts, strict=True):
        degree = polynomial.bit_length() - 1
        row[:degree] = start[:degree]
        for k in range(degree, _DIGITS):
            row[k] = row[k - degree]
            for i in range(1, degree + 1):
                row[k] ^= (polynomial >> (degree - i) & 1) * row[k - i] << i
    place = np.arange(_DIGITS)[::-1]
    return (numbers << place)[:, None, :] >> place[:, None] & 1
