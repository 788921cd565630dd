"""The process sheet-fem: the tools' actual paths -> wrenches on the tools and the formed sheet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.events import Progress, Watch, unwatched
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process.base import Answer, Identified
from coupling.sheet_fem.contact import Sphere
from coupling.sheet_fem.forming import SheetModel
from coupling.sheet_fem.schedule import Schedule
from coupling.sheet_fem.shape import formed_sheet
from coupling.toolpaths.part import Part

_WHAT = "evaluating the process"


@dataclass(frozen=True)
class SheetFem(Identified):
    """A sheet formed by hemispherical tools, computed from the flat sheet in every evaluation.

    One tool forms it; in a cell, a second one supports it from behind.  Both are the same to the
    sheet: spheres that press on either of its faces.

    Attributes:
        part: Placement of the part; the sheet's upper face is its x-y plane.
        model: Model of the sheet.
        tool_radii: Radii of the spheres, whose tips are the TCPs [m]; one for each tool of the path.
        schedule: Positions of a path where equilibrium is found.
        force_factor: Measured over computed force, see docs/sheet_fem.md.
        watch: Function that is told how many positions are done.
    """

    part: Part
    model: SheetModel
    tool_radii: tuple[float, ...]
    schedule: Schedule
    force_factor: float = 1.0
    watch: Watch = unwatched

    def evaluate(self, path: ToolPath) -> Answer:
        """Return wrenches and stiffness along the actual paths, and the formed sheet.

        Raises:
            ProcessError: If no equilibrium is found.
        """
        centers = [
            self._centers(tool, radius)
            for tool, radius in zip(path.tools, self.tool_radii, strict=True)
        ]
        places = np.stack(centers, axis=1)[self.schedule.positions]
        moves = [self._spheres(place) for place in places]
        forces, moments = np.zeros(places.shape), np.zeros(places.shape)
        stiffness = np.zeros((*places.shape, 3))
        loaded = state = self.model.flat()
        before, touching = moves[0], False
        for k, after in enumerate(moves):
            self.watch(Progress(_WHAT, k, len(moves)))
            if touching or not all(self.model.clear_of(state, sphere) for sphere in after):
                whole = self.schedule.everywhere[k]
                box = self.model.everywhere() if whole else self.model.near(state, before, after)
                found = self.model.equilibrium(state, before, after, box)
                state, forces[k], moments[k] = found.state, found.forces, found.moments
                touching = bool(np.any(forces[k]))
                if touching:
                    loaded, stiffness[k] = state, self.model.reaction(found)
            before = after
        if touching:
            state = self.model.equilibrium(state, (), (), self.model.everywhere()).state
        self.watch(Progress(_WHAT, len(moves), len(moves)))
        wrenches = [
            self._wrench(tool, center, forces[:, k], moments[:, k])
            for k, (tool, center) in enumerate(zip(path.tools, centers, strict=True))
        ]
        formed = formed_sheet(self.model.mesh, loaded, state)
        reaction = np.stack([self._along(values) for values in stiffness.swapaxes(0, 1)])
        return Answer(WrenchHistory.of_tools(wrenches), formed, stiffness=reaction)

    def _along(self, stiffness: np.ndarray) -> np.ndarray:
        """Return a tool's stiffness at all samples, base axes, of that at the positions, (n, 3, 3)."""
        flat = self.schedule.interpolated(stiffness.reshape(-1, 9))
        axes = self.part.rotation.as_matrix()
        turned: np.ndarray = self.force_factor * axes @ flat.reshape(-1, 3, 3) @ axes.T
        return turned

    def _wrench(
        self, path: ToolPath, centers: np.ndarray, forces: np.ndarray, moments: np.ndarray
    ) -> WrenchHistory:
        """Return the wrench at a TCP of wrenches at the sphere's centre, given at positions."""
        force, own = (
            self.part.rotation.apply(self.force_factor * self.schedule.interpolated(values))
            for values in (forces, moments)
        )
        center = self.part.position + self.part.rotation.apply(centers)
        moment = own + np.cross(center - path.position[0], force)
        return WrenchHistory(path.time, np.hstack([force, moment]))

    def _centers(self, path: ToolPath, radius: float) -> np.ndarray:
        """Return a sphere's centres in the part frame, behind the TCP along the tool's axis."""
        approach = path.rotations[0].apply([1.0, 0.0, 0.0])
        return self.part.coordinates(path.position[0] - radius * approach)

    def _spheres(self, centers: np.ndarray) -> tuple[Sphere, ...]:
        """Return tools in the sheet's frame, whose origin is half a thickness below the part's."""
        lift = np.array([0.0, 0.0, 0.5 * self.model.mesh.thickness])
        return tuple(
            self.model.sphere(center + lift, radius)
            for center, radius in zip(centers, self.tool_radii, strict=True)
        )
