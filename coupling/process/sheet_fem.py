"""The process sheet-fem: the tools' actual paths -> wrenches on the tools and the formed sheet."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import dataclass

import numpy as np

from coupling.events import Progress, Watch, unwatched
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.workpiece import Workpiece
from coupling.process.base import ProcessResponse, WithIdentity
from coupling.sheet_fem.box import Box
from coupling.sheet_fem.compiled import with_blas_on_one_thread
from coupling.sheet_fem.contact import Sphere
from coupling.sheet_fem.forming import SheetModel
from coupling.sheet_fem.mesh import SheetMesh
from coupling.sheet_fem.schedule import Schedule
from coupling.sheet_fem.state import SheetState
from coupling.sheet_fem.threads import in_background

_WHAT = "evaluating the process"
DEFLECTION = "deflection [m]"
SPRINGBACK = "springback [m]"
THICKNESS = "thickness [m]"
PLASTIC_STRAIN = "equivalent plastic strain"


@dataclass(frozen=True)
class SheetFem(WithIdentity):
    """A sheet formed by hemispherical tools, computed from the flat sheet in every evaluation.

    One tool forms it; in a cell, a second one supports it from behind.  Both are the same to the
    sheet: spheres that press on either of its faces.

    Attributes:
        part: base_from_part; the sheet's upper face is its x-y plane.
        model: Model of the sheet.
        radii: Radii of the spheres [m]; one for each tool of the path.
        tips: Vectors from their centres to the TCPs, tool axes [m], (3,) each.
        schedule: Positions of a path where equilibrium is found.
        desired: Paths on which they were chosen, base axes.
        force_factor: Force and stiffness over those that the elements compute, see docs/sheet_fem.md.
        watch: Function called with the number of positions done.
    """

    part: Frame
    model: SheetModel
    radii: tuple[float, ...]
    tips: tuple[np.ndarray, ...]
    schedule: Schedule
    desired: ToolPath
    force_factor: float = 1.0
    watch: Watch = unwatched

    @with_blas_on_one_thread
    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return wrenches and stiffness along the actual paths, and the formed sheet.

        Raises:
            ProcessError: If no equilibrium is found.
        """
        centers = self._centers(path)
        places = centers.swapaxes(0, 1)[self.schedule.positions]
        boxes = self._boxes()
        moves = [self._spheres(place) for place in places]
        forces, moments = np.zeros(places.shape), np.zeros(places.shape)
        stiffness = np.zeros((len(places), places[0].size, places[0].size))
        loaded = state = self.model.flat()
        before, touching = moves[0], False
        # The next equilibrium does not wait for the stiffness at a position, but only one is under way:
        # it holds the whole sheet.
        answer: tuple[int, Future[np.ndarray]] | None = None
        for k, after in enumerate(moves):
            self.watch(Progress(_WHAT, k, len(moves)))
            if touching or not all(self.model.clear_of(state, sphere) for sphere in after):
                equilibrium = self.model.equilibrium(state, before, after, boxes[k])
                state, forces[k], moments[k] = (
                    equilibrium.state,
                    equilibrium.forces,
                    equilibrium.moments,
                )
                touching = bool(np.any(forces[k]))
                if touching:
                    loaded = state
                    _take(answer, stiffness)
                    answer = k, in_background(self.model.reaction, equilibrium)
            before = after
        _take(answer, stiffness)
        if touching:
            state = self.model.equilibrium(state, (), (), boxes[-1]).state
        self.watch(Progress(_WHAT, len(moves), len(moves)))
        felt = self._stiffness_at_samples(stiffness)
        wrenches = []
        for k, (tool, center) in enumerate(zip(path.tools, centers, strict=True)):
            away = tool.position[0] - self.desired.position[k]
            axes = slice(3 * k, 3 * k + 3)
            force = self._along(forces[:, k], felt[:, axes, axes], away)
            felt[~np.any(force, axis=1), axes] = 0.0
            wrenches.append(self._wrench(tool, center, force, moments[:, k]))
        formed = formed_sheet(self.model.mesh, loaded, state)
        return ProcessResponse(WrenchHistory.of_tools(wrenches), formed, stiffness=felt)

    def _boxes(self) -> list[Box]:
        """Return the boxes about the tools at all positions.

        They are those of the desired paths, so that evaluations differ by their path alone.
        """
        boxes: list[Box] = []
        for place in self._centers(self.desired).swapaxes(0, 1)[self.schedule.positions]:
            boxes.append(self.model.near(boxes[-1] if boxes else None, place))
        return boxes

    def _stiffness_at_samples(self, stiffness: np.ndarray) -> np.ndarray:
        """Return the stiffness at all samples, base axes, (n, 3 tools, 3 tools)."""
        size = stiffness.shape[-1]
        axes = np.kron(np.eye(size // 3), self.part.rotation.as_matrix())
        along = self.schedule.interpolated(stiffness.reshape(-1, size**2)).reshape(-1, size, size)
        felt: np.ndarray = self.force_factor * axes @ along @ axes.T
        return felt

    def _along(self, forces: np.ndarray, felt: np.ndarray, away: np.ndarray) -> np.ndarray:
        """Return a tool's force at all samples, base axes, (n, 3).

        It is interpolated between the positions.  There the tool is held as it is at the positions:
        against what it is away from the desired path beyond what is interpolated of that, the force is
        that of the stiffness that it feels, (n, 3, 3).  One that would pull is none.
        """
        between = self.force_factor * self.schedule.interpolated(forces)
        between = self.part.rotate(between)
        offset = away - self.schedule.interpolated(away[self.schedule.positions])
        force = between - np.einsum("nij,nj->ni", felt, offset)
        holds = np.sum(force * between, axis=1) > 0.0
        return np.where(holds[:, None], force, 0.0)

    def _wrench(
        self, path: ToolPath, centers: np.ndarray, force: np.ndarray, moments: np.ndarray
    ) -> WrenchHistory:
        """Return the wrench at a TCP of the force along the path and moments at the positions."""
        contact_moment = self.part.rotate(self.force_factor * self.schedule.interpolated(moments))
        center = self.part.points(centers)
        moment = contact_moment + np.cross(center - path.position[0], force)
        return WrenchHistory(path.time, np.hstack([force, moment]))

    def _centers(self, path: ToolPath) -> np.ndarray:
        """Return the spheres' centres in the part frame, (tools, n, 3)."""
        tip_vectors = [
            rotation.apply(tip) for rotation, tip in zip(path.rotations, self.tips, strict=True)
        ]
        return self.part.coordinates(path.position - np.stack(tip_vectors))

    def _spheres(self, centers: np.ndarray) -> tuple[Sphere, ...]:
        """Return tools in the sheet's frame, whose origin is half a thickness below the part's."""
        lift = np.array([0.0, 0.0, 0.5 * self.model.mesh.thickness])
        return tuple(
            self.model.sphere(center + lift, radius)
            for center, radius in zip(centers, self.radii, strict=True)
        )


def _take(answer: tuple[int, Future[np.ndarray]] | None, stiffness: np.ndarray) -> None:
    """Write what has been computed for a position, if anything, to its row."""
    if answer is not None:
        k, computed = answer
        stiffness[k] = computed.result()


def formed_sheet(mesh: SheetMesh, loaded: SheetState, unloaded: SheetState) -> Workpiece:
    """Return the midsurface of the unloaded sheet at the elements' corners, part frame.

    Deflection is the height over the flat midsurface; springback how much higher a point is without
    the tool than with it at its last contact.  Cells carry thickness and the largest plastic strain
    over it.

    Args:
        mesh: Grid of the sheet.
        loaded: State with the tool at its last contact.
        unloaded: State after it.
    """
    corners, before = _corners(unloaded.points), _corners(loaded.points)
    nx, ny = mesh.elements
    index = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    cells = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1)
    below = np.array([0.0, 0.0, -0.5 * mesh.thickness])  # the part's plane is the upper face
    return Workpiece(
        points=corners.reshape(-1, 3) + below,
        cells=cells.reshape(-1, 4),
        point_fields={
            DEFLECTION: corners[..., 2].ravel(),
            SPRINGBACK: (corners - before)[..., 2].ravel(),
        },
        cell_fields={
            THICKNESS: mesh.thickness * unloaded.stretch.mean(axis=2).ravel(),
            PLASTIC_STRAIN: unloaded.plastic[..., 3].max(axis=(2, 3)).ravel(),
        },
    )


def _corners(points: np.ndarray) -> np.ndarray:
    """Return the surface at the elements' corners: the mean of four control points each."""
    corners: np.ndarray = 0.25 * (
        points[:-1, :-1] + points[1:, :-1] + points[:-1, 1:] + points[1:, 1:]
    )
    return corners
