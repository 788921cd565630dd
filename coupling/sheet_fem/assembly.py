"""Elements and contact summed into a band matrix over a box of control points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.banded import GeneralBanded, SymmetricBanded
from coupling.sheet_fem.border import Bordered
from coupling.sheet_fem.box import Box
from coupling.sheet_fem.coarse import CoarseSplines
from coupling.sheet_fem.compiled import compile_function
from coupling.sheet_fem.contact import Sphere, Surface, add_contact
from coupling.sheet_fem.edge_elements import add_edge
from coupling.sheet_fem.element import fill_elements
from coupling.sheet_fem.far_field import CondensedFarField
from coupling.sheet_fem.interface import Interface
from coupling.sheet_fem.macro_elements import MacroElements, fill_cells
from coupling.sheet_fem.shell import Shell
from coupling.sheet_fem.state import SheetState
from coupling.sheet_fem.threads import in_threads


@compile_function
def _unknowns(
    box: Box,
    free: np.ndarray,
    places: np.ndarray,
    force: np.ndarray,
    index: np.ndarray,
    residual: np.ndarray,
) -> None:
    """Number the elements' unknowns in the box, -1 for what is held, and sum their forces."""
    width = box.last_y - box.first_y
    for e in range(len(places)):
        i, j = places[e, 0], places[e, 1]
        for A in range(9):
            x, y = i + A // 3, j + A % 3
            inside = box.first_x <= x < box.last_x and box.first_y <= y < box.last_y
            for k in range(3):
                index[e, 3 * A + k] = -1
                if inside and free[x, y, k]:
                    row = 3 * ((x - box.first_x) * width + y - box.first_y) + k
                    index[e, 3 * A + k] = row
                    residual[row] += force[e, 3 * A + k]


class BoxForces(NamedTuple):
    """Forces and stiffness of elements and contact in a box.

    Attributes:
        unknowns: Numbers of the elements' unknowns in the box, -1 for what is held, (e, 27).
        force: Their forces [N], (e, 27); overwritten when a box is looked at again.
        stiffness: Derivatives of those [N/m], (e, 27, 27); overwritten as well.
        residual: Unbalanced forces at the box's control points [N], (3 n,), zero where held.
        tangent: Derivative of the residual [N/m], (3 n, 3 n).
        wrenches: Wrench on each sphere about its centre [N, N m], (spheres, 6).
    """

    unknowns: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    residual: np.ndarray
    tangent: SymmetricBanded | GeneralBanded
    wrenches: np.ndarray


class Assembled(NamedTuple):
    """Residual and stiffness of a sheet.

    Attributes:
        residual: Unbalanced forces [N] at the control points of the box, (3 n,), zero where held, and
            at the m unknowns of its interface, if the state has a far field.
        stiffness: Derivative of the residual by both [N/m], (3 n + m, 3 n + m).
        wrenches: Force on each sphere [N] and moment about its centre [N m], (spheres, 6).
    """

    residual: np.ndarray
    stiffness: Bordered
    wrenches: np.ndarray


class ContactTangents(NamedTuple):
    """Tangents of a sphere's contact with a sheet.

    Attributes:
        by_center: Derivative of the force on the sphere by the sheet under it, which moves as a whole
            [N/m], (3, 3).
        by_sheet: Derivative of that force by the control points of a box, transposed [N/m], (3 n, 3).
        on_sheet: Derivative of the residual there by the sphere's centre, negative [N/m], (3 n, 3).
    """

    by_center: np.ndarray
    by_sheet: np.ndarray
    on_sheet: np.ndarray


class Assembler:
    """Residual and stiffness of a box, with the arrays they need.

    Args:
        shell: Elements.
        surface: Contact points.
        elements: Numbers of elements in x and y.
        free: Mask of the control points that may move, (nx + 2, ny + 2, 3).

    Attributes:
        free: The same.
    """

    def __init__(
        self, shell: Shell, surface: Surface, elements: tuple[int, int], free: np.ndarray
    ) -> None:
        self._shell = shell
        self._surface = surface
        self._elements = elements
        self.free = free
        total = elements[0] * elements[1]
        self._inside = np.empty((total, 27)), np.empty((total, 27, 27))
        self._splines = CoarseSplines.of(elements)

    @property
    def everywhere(self) -> Box:
        """The box of all control points."""
        return Box(0, self._elements[0] + 2, 0, self._elements[1] + 2)

    def no_slip(self, sphere: Sphere) -> np.ndarray:
        """Return the elastic slip of an untouched sheet [m], (nx, ny, contact points, 3)."""
        count = len(self._surface.basis.area) if sphere.friction > 0.0 else 0
        return np.zeros((*self._elements, count, 3))

    def __call__(
        self, box: Box, before: SheetState, spheres: tuple[Sphere, ...], after: SheetState
    ) -> Assembled:
        """Return residual and stiffness of a sheet that has moved; arguments as of `inside`."""
        return self.joined(self.inside(box, before, spheres, after), after)

    def inside(
        self, box: Box, before: SheetState, spheres: tuple[Sphere, ...], after: SheetState
    ) -> BoxForces:
        """Return forces and stiffness in a box that has moved.

        Args:
            box: Control points that may move.
            before: The last equilibrium; its slip is that of the same spheres.
            spheres: Tools that press on the sheet.
            after: State with the new control points; the history of the box's elements is written.
        """
        places = box.elements(self.free.shape)
        force, stiffness = (values[: len(places)] for values in self._inside)
        on_tools = np.empty((len(spheres), len(places), 6))

        elements = self._shell, self._surface
        history = after.plastic, after.stretch

        def act(share: slice) -> None:
            some, results = places[share], (force[share], stiffness[share])
            fill_elements(*elements, some, after.points, before.plastic, *results, *history)
            for k, sphere in enumerate(spheres):
                moves = (before.points, after.points, before.slip[k], after.slip[k])
                add_contact(self._surface, sphere, some, *moves, *results, on_tools[k, share])

        in_threads(act, len(places))
        width = box.last_y - box.first_y
        unknowns = 3 * (box.last_x - box.first_x) * width
        index, residual = np.empty((len(places), 27), dtype=np.int64), np.zeros(unknowns)
        _unknowns(box, self.free, places, force, index, residual)
        rubs = any(sphere.friction > 0.0 for sphere in spheres)
        band = GeneralBanded if rubs else SymmetricBanded
        tangent = band.of(index, stiffness, unknowns, 3 * (2 * width + 2) + 2)
        return BoxForces(index, force, stiffness, residual, tangent, on_tools.sum(axis=1))

    def joined(self, inside: BoxForces, state: SheetState) -> Assembled:
        """Return residual and stiffness of a box and, if the state has a far field, its interface."""
        unknowns = len(inside.residual)
        if state.far_field is None:
            matrix = Bordered(inside.tangent, np.zeros((unknowns, 0)), np.zeros((0, 0)))
            return Assembled(inside.residual, matrix, inside.wrenches)
        at_interface, across, among = self._interface(state, inside)
        residual = np.concatenate([inside.residual, at_interface])
        return Assembled(residual, Bordered(inside.tangent, across, among), inside.wrenches)

    def interface(self, box: Box) -> Interface | None:
        """Return the interface of a box; None for the box of all control points."""
        return None if box == self.everywhere else Interface.of(self._splines, box, self.free)

    def linear(
        self, interface: Interface, before: SheetState, after: SheetState, limit: float
    ) -> CondensedFarField:
        """Return the far field of a box, linearised at a state.

        What the state's own far field knows, and what has hardly bent since, is taken from them.

        Args:
            interface: Interface of the box.
            before: The last equilibrium.
            after: State with the new control points; the history of the elements is written.
            limit: Bending up to which a cell counts as linear [m].
        """
        factor = self._splines.factor
        outside = np.ones(self._elements, dtype=bool)
        near = interface.box.elements(self.free.shape)
        outside[near[:, 0], near[:, 1]] = False
        nx, ny = self._splines.elements
        whole = outside.reshape(nx, factor, ny, factor).all(axis=(1, 3))
        cells = MacroElements.none(nx * ny)
        if after.far_field is not None:
            last_cells = after.far_field.cells_at(after.at_interface)
            # About another box other elements of a cell lie outside of it.
            same = after.far_field.interface.box == interface.box or (
                whole.ravel() & after.far_field.whole
            )
            keep = same & (last_cells.bent() <= limit)
            cells = last_cells.only(keep)
            outside &= ~np.repeat(np.repeat(keep.reshape(nx, ny), factor, axis=0), factor, axis=1)
        places = np.argwhere(outside.reshape(nx, factor, ny, factor).any(axis=(1, 3)))
        geometry = self._shell, self._surface, self._splines.blend, outside
        cell_state = after.points, before.plastic, cells.force, cells.stiffness

        def act(share: slice) -> None:
            fill_cells(*geometry, places[share], *cell_state, after.plastic, after.stretch)

        in_threads(act, len(places))
        return CondensedFarField.of(interface, after.points.copy(), cells, whole.ravel())

    def _interface(
        self, state: SheetState, inside: BoxForces
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the residual at the interface and its border of the stiffness."""
        far_field = state.far_field
        assert far_field is not None
        at_interface = far_field.force + far_field.stiffness @ state.at_interface
        across, among = (
            np.zeros((len(inside.residual), len(at_interface))),
            far_field.stiffness.copy(),
        )
        acting = inside.unknowns, inside.force, inside.stiffness
        add_edge(far_field.interface.edge_elements, *acting, at_interface, across, among)
        return at_interface, across, among

    def contact_tangents(
        self, box: Box, sphere: Sphere, before: SheetState, after: SheetState, tool: int
    ) -> ContactTangents | None:
        """Return the tangents of a sphere's contact; None where it is far from the sheet.

        The contact depends on the place of the sheet relative to the sphere.  The splines sum to one:
        so the contact's element matrices, summed over one of their sides, are its derivatives by the
        sphere, and those summed over both the one by both.

        Args:
            box: Control points that may move.
            sphere: Tool.
            before: State before its move.
            after: State to look at.
            tool: Place of the tool's slip in both.
        """
        places = self._places_near(box, sphere, after.points)
        if not len(places):
            return None
        force, index = np.zeros((len(places), 27)), np.empty((len(places), 27), dtype=np.int64)
        stiffness = np.zeros((len(places), 27, 27))
        moves = (before.points, after.points, before.slip[tool], after.slip[tool].copy())
        add_contact(
            self._surface, sphere, places, *moves, force, stiffness, np.empty((len(places), 6))
        )
        unknowns = 3 * (box.last_x - box.first_x) * (box.last_y - box.first_y)
        _unknowns(box, self.free, places, force, index, np.zeros(unknowns))
        moving = index >= 0
        by_sheet, on_sheet = np.zeros((unknowns, 3)), np.zeros((unknowns, 3))
        of_points = stiffness.reshape(-1, 9, 3, 27).sum(axis=1).swapaxes(1, 2)
        np.add.at(by_sheet, index[moving], of_points[moving])
        np.add.at(on_sheet, index[moving], stiffness.reshape(-1, 27, 9, 3).sum(axis=2)[moving])
        return ContactTangents(
            of_points.reshape(-1, 9, 3, 3).sum(axis=(0, 1)).T, by_sheet, on_sheet
        )

    def _places_near(self, box: Box, sphere: Sphere, points: np.ndarray) -> np.ndarray:
        """Return the places of the elements of a box about those that a sphere may touch, (n, 2)."""
        apart = np.linalg.norm(points - sphere.center, axis=-1)
        margin = 2.0 * np.sqrt(np.sum(self._surface.basis.area))
        x, y = np.nonzero(apart < sphere.radius + self._surface.thickness + margin)
        if not len(x):
            return np.empty((0, 2), dtype=np.int64)
        near = Box(
            max(box.first_x, int(x.min())),
            min(box.last_x, int(x.max()) + 1),
            max(box.first_y, int(y.min())),
            min(box.last_y, int(y.max()) + 1),
        )
        return near.elements(self.free.shape)
