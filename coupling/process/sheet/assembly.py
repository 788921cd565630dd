"""Elements and contact summed into a band matrix over a box of control points."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from coupling.process.sheet.compiled import compiled
from coupling.process.sheet.contact import Sphere, pressure
from coupling.process.sheet.element import Shell, element
from coupling.process.sheet.mesh import Basis

# The compiled element loop lets go of Python's lock.
_THREADS = os.cpu_count() or 1


class Box(NamedTuple):
    """Control points [first, last) in x and y whose equilibrium is asked for; others stay."""

    first_x: int
    last_x: int
    first_y: int
    last_y: int


class Surface(NamedTuple):
    """Where contact is integrated.

    Attributes:
        basis: At the contact points of an element.
        half_thickness: Distance of the touched face from the midsurface [m].
        supported: Whether a backing plate is below a contact point, (nx, ny, points).
        support: Pressure per penetration of the backing plate [Pa/m].
        smoothing: Of that pressure [m].
    """

    basis: Basis
    half_thickness: float
    supported: np.ndarray
    support: float
    smoothing: float


@compiled
def _elements(
    shell: Shell,
    first: tuple[int, int],
    width: int,
    part: tuple[int, int],
    points: np.ndarray,
    plastic: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
    new_plastic: np.ndarray,
    new_stretch: np.ndarray,
) -> None:
    """Compute elements part[0] .. part[1] of the rows of `width` that begin at `first`."""
    local = np.empty((9, 3))
    for e in range(part[0], part[1]):
        i, j = first[0] + e // width, first[1] + e % width
        for A in range(9):
            local[A] = points[i + A // 3, j + A % 3]
        element(
            shell,
            local,
            plastic[i, j],
            force[e],
            stiffness[e],
            new_plastic[i, j],
            new_stretch[i, j],
        )


@compiled
def _place(
    box: Box,
    free: np.ndarray,
    first: tuple[int, int],
    count: tuple[int, int],
    force: np.ndarray,
    stiffness: np.ndarray,
    residual: np.ndarray,
    band: np.ndarray,
) -> None:
    """Add element forces and stiffness to the box's residual and band matrix."""
    width = box.last_y - box.first_y
    index = np.empty((9, 3), dtype=np.int64)
    for e in range(count[0] * count[1]):
        i, j = first[0] + e // count[1], first[1] + e % count[1]
        for A in range(9):
            x, y = i + A // 3, j + A % 3
            inside = box.first_x <= x < box.last_x and box.first_y <= y < box.last_y
            for k in range(3):
                index[A, k] = -1
                if inside and free[x, y, k]:
                    index[A, k] = 3 * ((x - box.first_x) * width + y - box.first_y) + k
        for A in range(9):
            for k in range(3):
                row = index[A, k]
                if row < 0:
                    continue
                residual[row] += force[e, 3 * A + k]
                for C in range(A, 9):
                    for m in range(3):
                        column = index[C, m]
                        if column >= row:
                            band[row, column - row] += stiffness[e, 3 * A + k, 3 * C + m]


@compiled
def _press(
    surface: Surface,
    sphere: Sphere,
    first: tuple[int, int],
    count: tuple[int, int],
    points: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
    on_tool: np.ndarray,
) -> None:
    """Add the contact with a sphere to the elements; `on_tool` gets its force on the sphere, (3,)."""
    basis = surface.basis
    reach = sphere.radius + surface.half_thickness
    margin = 2.0 * np.sqrt(np.sum(basis.area))
    apart = np.empty(3)
    for e in range(count[0] * count[1]):
        i, j = first[0] + e // count[1], first[1] + e % count[1]
        # The patch of control points encloses the element: farther ones cannot touch.
        near = False
        for A in range(9):
            distance = 0.0
            for k in range(3):
                distance += (points[i + A // 3, j + A % 3, k] - sphere.center[k]) ** 2
            if distance < (reach + margin) ** 2:
                near = True
        if not near:
            continue
        for g in range(basis.area.shape[0]):
            N = basis.value[g]
            apart[:] = sphere.center
            for A in range(9):
                for k in range(3):
                    apart[k] -= N[A] * points[i + A // 3, j + A % 3, k]
            distance = np.sqrt(apart[0] ** 2 + apart[1] ** 2 + apart[2] ** 2)
            size, slope = pressure(reach - distance, sphere.stiffness, sphere.smoothing)
            if slope == 0.0:
                continue
            size *= basis.area[g]
            slope *= basis.area[g]
            for k in range(3):
                apart[k] /= distance
                on_tool[k] += size * apart[k]
            for k in range(3):
                for A in range(9):
                    force[e, 3 * A + k] += N[A] * size * apart[k]
                for m in range(3):
                    block = (slope + size / distance) * apart[k] * apart[m]
                    if k == m:
                        block -= size / distance
                    for A in range(9):
                        for C in range(9):
                            stiffness[e, 3 * A + k, 3 * C + m] += N[A] * N[C] * block


@compiled
def _bear(
    surface: Surface,
    first: tuple[int, int],
    count: tuple[int, int],
    points: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
) -> None:
    """Add the backing plate, on which the flat sheet lies, to the elements."""
    basis = surface.basis
    for e in range(count[0] * count[1]):
        i, j = first[0] + e // count[1], first[1] + e % count[1]
        for g in range(basis.area.shape[0]):
            if not surface.supported[i, j, g]:
                continue
            N = basis.value[g]
            height = 0.0
            for A in range(9):
                height += N[A] * points[i + A // 3, j + A % 3, 2]
            size, slope = pressure(-height, surface.support, surface.smoothing)
            for A in range(9):
                force[e, 3 * A + 2] -= N[A] * size * basis.area[g]
                for C in range(9):
                    stiffness[e, 3 * A + 2, 3 * C + 2] += N[A] * N[C] * slope * basis.area[g]


class Assembler:
    """Residual and stiffness of a box, with the arrays they need.

    Args:
        shell: Elements.
        surface: Contact points.
        elements: Of the sheet, in x and y.
        free: Which control points may move, (nx + 2, ny + 2, 3).
    """

    def __init__(
        self, shell: Shell, surface: Surface, elements: tuple[int, int], free: np.ndarray
    ) -> None:
        self._shell = shell
        self._surface = surface
        self._elements = elements
        self._free = free
        total = elements[0] * elements[1]
        self._force = np.empty((total, 27))
        self._stiffness = np.empty((total, 27, 27))
        self._threads = ThreadPoolExecutor(_THREADS)
        self._bears = bool(surface.supported.any())

    @property
    def everywhere(self) -> Box:
        """The box of all control points."""
        return Box(0, self._elements[0] + 2, 0, self._elements[1] + 2)

    def elements_of(self, box: Box) -> tuple[slice, slice]:
        """Return the elements that the control points of a box shape."""
        return (
            slice(max(box.first_x - 2, 0), min(box.last_x, self._elements[0])),
            slice(max(box.first_y - 2, 0), min(box.last_y, self._elements[1])),
        )

    def __call__(
        self,
        box: Box,
        points: np.ndarray,
        plastic: np.ndarray,
        spheres: tuple[Sphere, ...],
        new_plastic: np.ndarray,
        new_stretch: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return residual, stiffness and the forces on the spheres.

        Args:
            box: Control points that may move.
            points: Control points [m], (nx + 2, ny + 2, 3).
            plastic: Of every layer before, (nx, ny, points, layers, 4).
            spheres: That press on the sheet.
            new_plastic: Written for the box's elements.
            new_stretch: Written for the box's elements, (nx, ny, points).

        Returns:
            Unbalanced forces [N], (3 n,), zero where fixed; stiffness [N/m], the lower band by
            columns, (3 n, 1 + bandwidth); forces on the spheres [N], (spheres, 3).
        """
        x, y = self.elements_of(box)
        first, count = (x.start, y.start), (x.stop - x.start, y.stop - y.start)
        size = count[0] * count[1]
        force, stiffness = self._force[:size], self._stiffness[:size]
        parts = pairwise(size * k // _THREADS for k in range(_THREADS + 1))
        results = (points, plastic, force, stiffness, new_plastic, new_stretch)
        jobs = [
            self._threads.submit(_elements, self._shell, first, count[1], part, *results)
            for part in parts
        ]
        for job in jobs:
            job.result()
        forces = np.zeros((len(spheres), 3))
        for sphere, on_tool in zip(spheres, forces, strict=True):
            _press(self._surface, sphere, first, count, points, force, stiffness, on_tool)
        if self._bears:
            _bear(self._surface, first, count, points, force, stiffness)
        width = box.last_y - box.first_y
        unknowns = 3 * (box.last_x - box.first_x) * width
        residual = np.zeros(unknowns)
        band = np.zeros((unknowns, 3 * (2 * width + 2) + 3))
        _place(box, self._free, first, count, force, stiffness, residual, band)
        free = self._free[box.first_x : box.last_x, box.first_y : box.last_y].ravel()
        band[~free, 0] = 1.0
        return residual, band, forces
