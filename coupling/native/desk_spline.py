"""Splines on evenly spaced knots at many times, in C (`desk/spline.h`)."""

from __future__ import annotations

import ctypes

import numpy as np

from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, numbers


class _Spline(ctypes.Structure):
    """er_spline of desk/spline.h."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("degree", "intervals", "quantities")),
        *((name, ctypes.c_double) for name in ("start", "spacing")),
        ("coefficients", ctypes.c_void_p),
    )


def spline_values(
    start: float, spacing: float, coefficients: np.ndarray, powers: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """Return values or derivatives of a spline, any unit, (k, quantities).

    Args:
        start, spacing: First time, distance of the knots [s].
        coefficients: Coefficients of its basis, any unit, (intervals + degree, quantities).
        powers: Weights of an interval's coefficients in the powers of the part of it that lies before,
            from 0 on, (terms, degree + 1).
        times: Times [s], (k,); the outermost pieces go on beyond the ends.

    Raises:
        ValueError: If there are too few coefficients, or an array has another shape.
    """
    terms, degree = powers.shape[0], powers.shape[1] - 1
    size, quantities = coefficients.shape
    if size <= degree:
        raise ValueError(f"expected more than {degree} coefficients, got {size}")
    rows = numbers("coefficients", coefficients, (size, quantities))
    weights = numbers("powers", powers, (terms, degree + 1))
    at = numbers("times", times, (len(times),))
    values = np.empty((len(at), quantities))
    spline = _Spline(degree, size - degree, quantities, start, spacing, address(rows))
    loaded_library().er_spline_at(
        ctypes.byref(spline),
        ctypes.c_int64(terms),
        address(weights),
        ctypes.c_int64(len(at)),
        address(at),
        address(values),
    )
    return values
