"""The sheet as a regular grid of C1 quadratic B-splines.

Element (i, j) is shaped by the 3 x 3 control points (i..i+2, j..j+2).  The splines are uniform up to
the edge: a row of control points lies half an element outside of it, and an edge is clamped (no
displacement, no rotation) by holding the two outer rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

# Excess of the force over its limit where the element is the tool's radius and that the thickness:
# fitted to what docs/sheet_fem.md shows under "How fine".
_FORCE_EXCESS = 0.35
# Size of the coarsest elements that were looked at, over the tool's radius.
_MAX_SIZE_RATIO = 0.8


class Basis(NamedTuple):
    """The nine splines of an element and their derivatives at points in it.

    Spline 3 i + j belongs to the control point (i, j) of the element's patch.

    Attributes:
        value: Weights of the control points, (points, 9).
        d1, d2: Slopes along x and y [1/m], (points, 9).
        d11, d22, d12: Second derivatives [1/m2], (points, 9).
        area: Area that a point stands for [m2], (points,).
    """

    value: np.ndarray
    d1: np.ndarray
    d2: np.ndarray
    d11: np.ndarray
    d22: np.ndarray
    d12: np.ndarray
    area: np.ndarray


def basis(rule: tuple[np.ndarray, np.ndarray], size: tuple[float, float]) -> Basis:
    """Return the splines at the points of a product rule.

    Args:
        rule: Points 0..1 and weights of one direction, (points,) each; the same in both.
        size: Sides of an element in x and y [m].

    Example:
        >>> basis(gauss(1), (1.0, 1.0)).value[0, :3]
        array([0.015625, 0.09375 , 0.015625])
    """
    u, weight = rule
    value = np.column_stack([0.5 * (1.0 - u) ** 2, 0.5 + u - u**2, 0.5 * u**2])
    slope = np.column_stack([u - 1.0, 1.0 - 2.0 * u, u])
    curvature = np.tile([1.0, -2.0, 1.0], (len(u), 1))
    hx, hy = size

    def product(along_x: np.ndarray, along_y: np.ndarray) -> np.ndarray:
        table = np.einsum("pi,qj->pqij", along_x, along_y)
        return np.ascontiguousarray(table.reshape(len(u) ** 2, 9))

    return Basis(
        value=product(value, value),
        d1=product(slope, value) / hx,
        d2=product(value, slope) / hy,
        d11=product(curvature, value) / hx**2,
        d22=product(value, curvature) / hy**2,
        d12=product(slope, slope) / (hx * hy),
        area=np.outer(weight, weight).ravel() * hx * hy,
    )


def gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return Gauss points on 0..1 and their weights, (count,) each."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (points + 1.0), 0.5 * weights


def midpoints(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the middles of equal parts of 0..1 and their weights, (count,) each."""
    return (np.arange(count) + 0.5) / count, np.full(count, 1.0 / count)


@dataclass(frozen=True)
class SheetMesh:
    """Grid over a rectangle about the origin of the part's x-y plane.

    Attributes:
        size: Sides of the sheet in x and y [m].
        elements: Numbers of elements in x and y.
        thickness: First thickness [m].

    Example:
        >>> mesh = SheetMesh((0.1, 0.1), (10, 10), 1e-3)
        >>> mesh.control_points().shape
        (12, 12, 3)
    """

    size: tuple[float, float]
    elements: tuple[int, int]
    thickness: float

    @property
    def element_size(self) -> tuple[float, float]:
        """Sides of an element [m]."""
        return self.size[0] / self.elements[0], self.size[1] / self.elements[1]

    def control_points(self) -> np.ndarray:
        """Return the control points of the flat sheet [m], (nx + 2, ny + 2, 3)."""
        numbers = np.meshgrid(*(np.arange(count + 2) for count in self.elements), indexing="ij")
        place = self.place(np.stack(numbers, axis=-1))
        return np.concatenate([place, np.zeros((*place.shape[:2], 1))], axis=-1)

    def place(self, number: np.ndarray) -> np.ndarray:
        """Return the positions of control points of given numbers in the flat sheet [m], (..., 2)."""
        place: np.ndarray = (number - 0.5) * self.element_size - 0.5 * np.array(self.size)
        return place

    def control_point(self, place: np.ndarray) -> np.ndarray:
        """Return the numbers, with fractions, of control points at places [m], (..., 2)."""
        number: np.ndarray = (place + 0.5 * np.array(self.size)) / self.element_size + 0.5
        return number

    def clamped(self) -> np.ndarray:
        """Return the mask of free control points, all four edges clamped, (nx + 2, ny + 2, 3)."""
        free = np.zeros((self.elements[0] + 2, self.elements[1] + 2, 3), dtype=bool)
        free[2:-2, 2:-2] = True
        return free


def limit_of_force(element: float, radius: float, thickness: float) -> float:
    """Return the force of ever smaller elements over that of elements of a size.

    The bend about a tool is sharper than its elements can follow, so that they are too stiff: by
    0.35 (h/R)^2 (R/t)^(1/4), as the error of splines of second degree in a shell that bends
    falls with the square of their size h.  The factor 0.35 and the fourth root are fitted.  From
    elements larger than 0.8 R as much is taken off as from those.

    Args:
        element: Side of an element [m].
        radius: Radius of the tool's sphere [m].
        thickness: First thickness of the sheet [m].

    Example:
        >>> round(limit_of_force(2.5e-3, 5e-3, 1e-3), 3)
        0.884
    """
    size = min(element / radius, _MAX_SIZE_RATIO)
    return 1.0 / (1.0 + _FORCE_EXCESS * size**2 * (radius / thickness) ** 0.25)
