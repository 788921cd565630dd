"""The sheet under tools that move: one equilibrium after the other."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import ProcessError
from coupling.sheet_fem.assembly import Assembler
from coupling.sheet_fem.box import Box
from coupling.sheet_fem.contact import Sphere, Surface
from coupling.sheet_fem.equilibrium import (
    Equilibrium,
    NewtonSettings,
    find_equilibrium,
)
from coupling.sheet_fem.mesh import SheetMesh, basis, gauss, midpoints
from coupling.sheet_fem.return_mapping import Metal
from coupling.sheet_fem.section import CrossSection
from coupling.sheet_fem.shell import Shell
from coupling.sheet_fem.state import SheetState
from coupling.sheet_fem.travel import Increment

# Integration points of an element in each direction: the splines are C1, more would only stiffen.
_POINTS = 2
# Contact points of an element in each direction.
_CONTACT_POINTS = 8
# Pressure per penetration, over that of the sheet squeezed through its thickness (E / t).
_PENALTY = 0.3
# Penetration over which the penalty sets in, over the thickness.
_SMOOTHING = 0.003
# Elastic slip at which the sheet slides along a tool, over the thickness.
_SLIP = 0.01
# Newton's method: unbalanced force over yield stress times thickness squared ...
_TOLERANCE = 1e-3
# ... and largest displacement of an iteration over the element's size.
_LARGEST_STEP = 0.5
# Bending of a coarse element away from the tools up to which it may be linear, over the thickness ...
_LINEAR_BENDING = 0.2
# ... and up to which it is not evaluated anew in every equilibrium: the error goes with its square.
_KEPT_BENDING = 0.05
# How much larger than the window a box is when it follows the tools, over the window.
_BOX_MARGIN = 0.3
# A load step is halved at most so many times.
_MAX_CUTS = 6


@dataclass(frozen=True)
class SheetSettings:
    """Fineness of a sheet's computation.

    Attributes:
        layers: Gauss points over the thickness.
        window: Half side of the square about a tool in which control points may move [m].
        opening_radius: Radius of the hole in the backing plate under the sheet [m]; None: no plate.
        edge_radius: Roundness of that hole's edge [m]: the plate is plane from the sum of both on.
        friction: Coefficient between tools and sheet; the plate is frictionless.
    """

    layers: int = 5
    window: float = 0.03
    opening_radius: float | None = None
    edge_radius: float = 0.0
    friction: float = 0.0


class SheetModel:
    """A clamped sheet, ready to be formed; holds no state of it.

    Args:
        mesh: Grid of the sheet.
        material: Sheet metal.
        settings: Fineness and support.
        free: Mask of control points that may move, (nx + 2, ny + 2, 3); all edges clamped unless given.
    """

    def __init__(
        self,
        mesh: SheetMesh,
        material: Metal,
        settings: SheetSettings | None = None,
        free: np.ndarray | None = None,
    ) -> None:
        self.mesh = mesh
        self.settings = settings or SheetSettings()
        self._layers = self.settings.layers
        thickness, size = mesh.thickness, mesh.element_size
        rule = np.polynomial.legendre.leggauss(self._layers)
        self._penalty = _PENALTY * material.youngs_modulus / thickness
        self._smoothing = _SMOOTHING * thickness
        self._slip = _SLIP * thickness
        contact_basis = basis(midpoints(_CONTACT_POINTS), size)
        self._start = mesh.control_points()
        self.assemble = Assembler(
            Shell(CrossSection(material, thickness, np.array(rule)), basis(gauss(_POINTS), size)),
            Surface(
                contact_basis,
                thickness,
                self._plate_mask(contact_basis.value),
                self._plane,
                self.settings.edge_radius,
                self._penalty,
                self._smoothing,
            ),
            mesh.elements,
            mesh.clamped() if free is None else free,
        )
        yield_force = material.strength * material.prestrain**material.exponent * thickness**2
        self._newton = NewtonSettings(
            _TOLERANCE * yield_force,
            _LARGEST_STEP * min(size),
            _KEPT_BENDING * thickness,
            _LINEAR_BENDING * thickness,
        )

    def flat(self) -> SheetState:
        """Return the sheet as it comes: flat, without stress."""
        points = (*self.mesh.elements, _POINTS**2)
        return SheetState(self._start.copy(), np.zeros((*points, self._layers, 4)), np.ones(points))

    def sphere(self, center: np.ndarray, radius: float) -> Sphere:
        """Return a tool at rest with this model's contact; center in the sheet's frame [m], (3,)."""
        return Sphere(
            np.asarray(center, dtype=float),
            radius,
            self._penalty,
            self._smoothing,
            self.settings.friction,
            self._slip,
            np.zeros(3),
        )

    def window(self, center: np.ndarray, margin: float = 0.0) -> Box:
        """Return the box of control points about a place [m], (2,) or more, `beyond` the window [m]."""
        bounds = []
        middles = self.mesh.control_point(center[:2])
        for count, size, middle in zip(
            self.mesh.elements, self.mesh.element_size, middles, strict=True
        ):
            reach = (self.settings.window + margin) / size
            bounds += [
                max(int(np.floor(middle - reach)), 0),
                min(int(np.ceil(middle + reach)) + 1, count + 2),
            ]
        return Box(*bounds)

    def near(self, last: Box | None, centers: np.ndarray) -> Box:
        """Return a box that contains the windows of all tools.

        The last one remains while it does; one that is new is larger, so that it remains for a while.

        Args:
            last: Box at the position before; None at the first.
            centers: Places of the tools [m], (tools, 2) or more.
        """
        if last is not None and all(last.contains(self.window(center)) for center in centers):
            return last
        room = _BOX_MARGIN * self.settings.window
        return Box.over([self.window(center, room) for center in centers])

    def clear_of(self, state: SheetState, sphere: Sphere) -> bool:
        """Return whether a sphere is farther from all control points than it could touch."""
        patches = state.points
        distance = np.min(np.linalg.norm(patches - sphere.center, axis=-1))
        margin = max(self.mesh.element_size)
        return bool(distance > sphere.radius + 0.5 * self.mesh.thickness + margin)

    def everywhere(self) -> Box:
        """Return the box of all control points."""
        return self.assemble.everywhere

    def equilibrium(
        self,
        state: SheetState,
        before: tuple[Sphere, ...],
        after: tuple[Sphere, ...],
        box: Box,
    ) -> Equilibrium:
        """Return the equilibrium after the tools moved in a straight line; cut into parts if needed.

        Args:
            state: State before; not changed.
            before: Tools where `state` is in equilibrium.
            after: Tools where they go; as many.
            box: Control points that may move.

        Raises:
            ProcessError: If no equilibrium is found even in the smallest parts.
        """
        if len(state.slip) != len(before):
            state = replace(state, slip=tuple(self.assemble.no_slip(tool) for tool in before))
        guess = self._guess(state, after, box)
        fraction, part, cuts = 0.0, 1.0, 0
        while True:
            target = min(fraction + part, 1.0)
            tools = tuple(
                b._replace(
                    center=(1.0 - target) * a.center + target * b.center,
                    displacement=(target - fraction) * (b.center - a.center),
                )
                for a, b in zip(before, after, strict=True)
            )
            equilibrium = find_equilibrium(self.assemble, state, tools, box, self._newton, guess)
            if equilibrium is None and guess is not None:
                guess = None
                continue
            if equilibrium is None:
                part *= 0.5
                cuts += 1
                if cuts > _MAX_CUTS:
                    places = ", ".join(str(np.round(1e3 * t.center, 3).tolist()) for t in tools)
                    raise ProcessError(
                        f"sheet-fem finds no equilibrium with the tool's centre at {places} mm in the"
                        " sheet's frame: use smaller elements or a smaller position_m"
                    )
                continue
            moves = equilibrium.state.points - state.points
            guess, state, fraction = None, equilibrium.state, target
            if fraction >= 1.0:
                return replace(equilibrium, state=replace(state, travel=Increment.of(tools, moves)))

    def reaction(self, equilibrium: Equilibrium) -> np.ndarray:
        """Return the stiffness of the spheres in an equilibrium [N/m], (3 spheres, 3 spheres)."""
        return tool_stiffness(self.assemble, equilibrium)

    def _guess(self, state: SheetState, tools: tuple[Sphere, ...], box: Box) -> np.ndarray | None:
        """Return the expected moves of the control points [m], (nx + 2, ny + 2, 3)."""
        if state.travel is None:
            return None
        visible_box = box.grown(2, state.points.shape)  # with what the box's elements see
        return state.travel.predict_moves(self.mesh, tools, visible_box)

    @property
    def _plane(self) -> float:
        """Radius from which the backing plate is plane [m]; infinite without a plate."""
        opening = self.settings.opening_radius
        return np.inf if opening is None else opening + self.settings.edge_radius

    def _plate_mask(self, value: np.ndarray) -> np.ndarray:
        """Return the mask of contact points on the backing plate, (nx, ny, points)."""
        nx, ny = self.mesh.elements
        if np.isinf(self._plane):
            return np.zeros((nx, ny, len(value)), dtype=bool)
        x = np.stack(
            [self._start[i : i + nx, j : j + ny, :2] for i in range(3) for j in range(3)], axis=2
        )
        place = np.einsum("ga,xyak->xygk", value, x)
        is_supported: np.ndarray = np.linalg.norm(place, axis=-1) > self._plane
        return is_supported


def tool_stiffness(assemble: Assembler, equilibrium: Equilibrium) -> np.ndarray:
    """Return K = -dF/dc of all spheres [N/m], (3 spheres, 3 spheres), one after the other.

    F are the forces on the spheres with their centres at c, the history before the move given.  A
    contact depends on the sheet's place relative to the sphere, so that with the
    residual r(p, c) of the control points p

        dF/dc = -T + C dp/dc,  S dp/dc = -dr/dc = B,  K = T - C S^-1 B.

    T are the contacts' tangents summed, C = dF/dp, and S = dr/dp the sheet's stiffness at the
    equilibrium.  Friction makes K unsymmetric, and a sheet that gives way under the tool negative: of
    what a sphere feels of its own move is returned the symmetric part without what is negative of it.
    """
    count = len(equilibrium.spheres)
    stiffness = np.zeros((count, 3, count, 3))
    tangents = {
        k: tangent
        for k, sphere in enumerate(equilibrium.spheres)
        if np.any(equilibrium.forces[k])
        and (
            tangent := assemble.contact_tangents(
                equilibrium.box, sphere, equilibrium.before, equilibrium.state, k
            )
        )
    }
    if not tangents:
        return stiffness.reshape(3 * count, 3 * count)
    pushed = np.hstack([tangent.on_sheet for tangent in tangents.values()])
    at_interface = np.zeros((equilibrium.tangent.size - len(pushed), pushed.shape[1]))
    follows = equilibrium.tangent.solve(np.vstack([pushed, at_interface]))[: len(pushed)]
    for column, j in enumerate(tangents):
        for i, tangent in tangents.items():
            stiffness[i, :, j] = -tangent.by_sheet.T @ follows[:, 3 * column : 3 * column + 3]
        stiffness[j, :, j] = _not_negative(tangents[j].by_center + stiffness[j, :, j])
    return stiffness.reshape(3 * count, 3 * count)


def _not_negative(matrix: np.ndarray) -> np.ndarray:
    """Return the symmetric matrix nearest to a given one that is not negative, (3, 3)."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    nearest: np.ndarray = (vectors * np.maximum(values, 0.0)) @ vectors.T
    return nearest
