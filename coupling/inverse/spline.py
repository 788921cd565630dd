"""Splines on evenly spaced knots, of several quantities at once, in C (`desk/spline.h`)."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from math import factorial

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, numbers


class _Spline(ctypes.Structure):
    """er_spline of desk/spline.h."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("degree", "intervals", "quantities")),
        *((name, ctypes.c_double) for name in ("start", "spacing")),
        ("coefficients", ctypes.c_void_p),
    )


@cache
def _powers(degree: int, order: int) -> np.ndarray:
    """Return the powers (rows, from 0) of the B-splines' derivatives on [0, 1] of integer knots."""
    knots = np.arange(-degree, degree + 2, dtype=float)
    unit = [BSpline(knots, row, degree) for row in np.eye(degree + 1)]
    counts = range(degree + 1 - order)
    return np.array([[b(0.0, nu=order + p) / factorial(p) for b in unit] for p in counts])


def stencil(place: np.ndarray, degree: int, order: int) -> np.ndarray:
    """Return the weights of the coefficients at places inside an interval, (k, degree + 1).

    Args:
        place: Parts of the interval, 0 to 1, (k,) or any shape before the weights'.
        degree: Degree of the spline.
        order: Order of the derivative, by the interval's length.
    """
    powers = _powers(degree, order)
    return np.asarray(place)[..., None] ** np.arange(len(powers)) @ powers


@dataclass(frozen=True)
class UniformSpline:
    """A spline with evenly spaced knots, k - 1 times continuously differentiable for degree k.

    Attributes:
        start: First time [s].
        spacing: Distance of the knots [s].
        coefficients: Coefficients of its basis, any unit, (intervals + degree, quantities).
        degree: Degree of its pieces.

    Example:
        >>> line = UniformSpline(1.0, 0.5, np.arange(6.0)[:, None], degree=3)
        >>> line.at(np.array([1.0, 2.5])).ravel(), line.at(np.array([2.0]), order=1).ravel()
        (array([1., 4.]), array([2.]))
    """

    start: float
    spacing: float
    coefficients: np.ndarray
    degree: int = 5

    @classmethod
    def through(
        cls,
        start: float,
        spacing: float,
        values: np.ndarray,
        degree: int,
        ends: tuple[Sequence[int], Sequence[int]],
    ) -> UniformSpline:
        """Return the spline through values at its knots.

        Args:
            start, spacing: First time, distance of the knots [s].
            values: Values there, any unit, (intervals + 1, quantities).
            degree: Degree of its pieces.
            ends: Orders of the derivatives that are zero at start and end, (degree - 1) / 2 each.
        """
        count, zero = len(values), np.zeros(values.shape[1])
        knots = np.arange(-degree, count + degree, dtype=float)
        begins, last = ([(order, zero) for order in orders] for orders in ends)
        found = make_interp_spline(np.arange(count), values, degree, knots, (begins, last))
        return cls(start, spacing, found.c, degree)

    @property
    def intervals(self) -> int:
        """Number of intervals between knots."""
        return len(self.coefficients) - self.degree

    @property
    def end(self) -> float:
        """Last time [s]."""
        return self.start + self.spacing * self.intervals

    @cached_property
    def nodes(self) -> np.ndarray:
        """Times of the knots from start to end [s], (intervals + 1,)."""
        return self.start + self.spacing * np.arange(self.intervals + 1)

    def place(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the number of each time's interval, and the part of it that lies before, (k,) each."""
        u = (times - self.start) / self.spacing
        first = np.clip(np.floor(u).astype(int), 0, self.intervals - 1)
        return first, u - first

    def at(self, times: np.ndarray, order: int = 0) -> np.ndarray:
        """Return values or derivatives at times (k,) [s], (k, quantities)."""
        size, quantities = self.coefficients.shape
        if size <= self.degree:
            raise ValueError(f"expected more than {self.degree} coefficients, got {size}")
        powers = np.ascontiguousarray(_powers(self.degree, order) / self.spacing**order)
        rows = numbers("coefficients", self.coefficients, (size, quantities))
        at, values = numbers("times", times, (len(times),)), np.empty((len(times), quantities))
        grid = size - self.degree, quantities, self.start, self.spacing
        loaded_library().er_spline_at(
            ctypes.byref(_Spline(self.degree, *grid, address(rows))),
            ctypes.c_int64(len(powers)),
            address(powers),
            ctypes.c_int64(len(at)),
            address(at),
            address(values),
        )
        return values
