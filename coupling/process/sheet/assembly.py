"""Elements and contact summed into a band matrix over a box of control points."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from coupling.process.sheet.band import GeneralBand, SymmetricBand
from coupling.process.sheet.compiled import compiled
from coupling.process.sheet.contact import Sphere, pressure
from coupling.process.sheet.element import Shell, element
from coupling.process.sheet.friction import elastic_slip
from coupling.process.sheet.mesh import Basis
from coupling.process.sheet.state import SheetState

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
def _unknowns(
    box: Box,
    free: np.ndarray,
    first: tuple[int, int],
    count: tuple[int, int],
    force: np.ndarray,
    index: np.ndarray,
    residual: np.ndarray,
) -> None:
    """Number the elements' unknowns in the box, -1 for what is held, and sum their forces."""
    width = box.last_y - box.first_y
    for e in range(count[0] * count[1]):
        i, j = first[0] + e // count[1], first[1] + e % count[1]
        for A in range(9):
            x, y = i + A // 3, j + A % 3
            inside = box.first_x <= x < box.last_x and box.first_y <= y < box.last_y
            for k in range(3):
                index[e, 3 * A + k] = -1
                if inside and free[x, y, k]:
                    row = 3 * ((x - box.first_x) * width + y - box.first_y) + k
                    index[e, 3 * A + k] = row
                    residual[row] += force[e, 3 * A + k]


@compiled
def _press(
    surface: Surface,
    sphere: Sphere,
    first: tuple[int, int],
    count: tuple[int, int],
    before: np.ndarray,
    points: np.ndarray,
    slip: np.ndarray,
    new_slip: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
    on_tool: np.ndarray,
) -> None:
    """Add the contact with a sphere to the elements.

    `on_tool` gets the force on the sphere and the moment about its centre, (6,).  Friction acts on
    the sphere's surface, but on the sheet's midsurface: its moment on the sheet is left out.
    """
    basis = surface.basis
    reach = sphere.radius + surface.half_thickness
    margin = 2.0 * np.sqrt(np.sum(basis.area))
    apart = np.empty(3)
    drift = np.empty(3)
    drag = np.empty(3)
    turn = np.empty((3, 3))
    for e in range(count[0] * count[1]):
        i, j = first[0] + e // count[1], first[1] + e % count[1]
        if sphere.friction > 0.0:
            new_slip[i, j] = 0.0
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
            if sphere.friction == 0.0:
                continue
            for k in range(3):
                drift[k] = slip[i, j, g, k] - sphere.moved[k]
                for A in range(9):
                    x, y = i + A // 3, j + A % 3
                    drift[k] += N[A] * (points[x, y, k] - before[x, y, k])
            elastic_slip(drift, apart, distance, sphere.slip_length, new_slip[i, j, g], turn)
            ratio = sphere.friction / sphere.slip_length
            for k in range(3):
                drag[k] = ratio * size * new_slip[i, j, g, k]
                on_tool[k] += drag[k]
            for k in range(3):
                a, b = (k + 1) % 3, (k + 2) % 3
                on_tool[3 + k] -= sphere.radius * (apart[a] * drag[b] - apart[b] * drag[a])
                for A in range(9):
                    force[e, 3 * A + k] += N[A] * drag[k]
                for m in range(3):
                    block = ratio * (slope * new_slip[i, j, g, k] * apart[m] + size * turn[k, m])
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


class Assembled(NamedTuple):
    """What acts on a sheet.

    Attributes:
        residual: Unbalanced forces [N], (3 n,), zero where held.
        stiffness: Its derivative by the control points of the box [N/m].
        wrenches: Force on each sphere [N] and moment about its centre [N m], (spheres, 6).
    """

    residual: np.ndarray
    stiffness: SymmetricBand | GeneralBand
    wrenches: np.ndarray


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
        self._index = np.empty((total, 27), dtype=np.int64)
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

    def no_slip(self, sphere: Sphere) -> np.ndarray:
        """Return the elastic slip of a tool that has not touched the sheet."""
        count = len(self._surface.basis.area) if sphere.friction > 0.0 else 0
        return np.zeros((*self._elements, count, 3))

    def __call__(
        self, box: Box, before: SheetState, spheres: tuple[Sphere, ...], after: SheetState
    ) -> Assembled:
        """Return what acts on a sheet that has moved.

        Args:
            box: Control points that may move.
            before: The last equilibrium; its slip is that of the same spheres.
            spheres: That press on the sheet.
            after: With its control points; the history of the box's elements is written.
        """
        x, y = self.elements_of(box)
        first, count = (x.start, y.start), (x.stop - x.start, y.stop - y.start)
        size = count[0] * count[1]
        force, stiffness, index = self._force[:size], self._stiffness[:size], self._index[:size]
        parts = pairwise(size * k // _THREADS for k in range(_THREADS + 1))
        results = (after.points, before.plastic, force, stiffness, after.plastic, after.stretch)
        jobs = [
            self._threads.submit(_elements, self._shell, first, count[1], part, *results)
            for part in parts
        ]
        for job in jobs:
            job.result()
        wrenches = np.zeros((len(spheres), 6))
        for k, sphere in enumerate(spheres):
            moves = (before.points, after.points, before.slip[k], after.slip[k])
            _press(self._surface, sphere, first, count, *moves, force, stiffness, wrenches[k])
        if self._bears:
            _bear(self._surface, first, count, after.points, force, stiffness)
        width = box.last_y - box.first_y
        unknowns = 3 * (box.last_x - box.first_x) * width
        residual = np.zeros(unknowns)
        _unknowns(box, self._free, first, count, force, index, residual)
        rubs = any(sphere.friction > 0.0 for sphere in spheres)
        band = GeneralBand if rubs else SymmetricBand
        matrix = band.of(index, stiffness, unknowns, 3 * (2 * width + 2) + 2)
        return Assembled(residual, matrix, wrenches)
