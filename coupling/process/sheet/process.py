"""The process sheet-fem: the tool's actual path -> wrench on the tool and the formed sheet."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coupling.path import ToolPath, WrenchHistory
from coupling.process.base import Progress, silent
from coupling.process.sheet.contact import Sphere
from coupling.process.sheet.forming import SheetModel
from coupling.process.sheet.schedule import Schedule
from coupling.process.sheet.shape import formed_sheet
from coupling.toolpaths.part import Part


@dataclass(frozen=True)
class SheetFem:
    """A sheet formed by a hemispherical tool, computed from the flat sheet in every evaluation.

    Attributes:
        part: Placement of the part; the sheet's upper face is its x-y plane.
        model: Of the sheet.
        tool_radius: Of the sphere, whose lowest point is the TCP [m].
        schedule: Where on a path equilibrium is found.
        force_factor: Measured over computed force, see docs/sheet_fem.md.
        progress: Called with positions done and in all.
    """

    part: Part
    model: SheetModel
    tool_radius: float
    schedule: Schedule
    force_factor: float = 1.0
    progress: Progress = silent

    def watched(self, progress: Progress) -> SheetFem:
        """Return the same process, telling its progress."""
        return replace(self, progress=progress)

    def wrench(self, path: ToolPath) -> WrenchHistory:
        """Return the wrench along the actual path, with the formed sheet as its workpiece.

        Raises:
            ProcessError: If no equilibrium is found.
        """
        centers = self._centers(path)
        tools = [self._tool(center) for center in centers[self.schedule.positions]]
        forces = np.zeros((len(tools), 3))
        loaded = state = self.model.flat()
        before, touching = tools[0], False
        for k, tool in enumerate(tools):
            self.progress(k, len(tools))
            if touching or not self.model.clear_of(state, tool):
                everywhere = self.schedule.everywhere[k]
                box = self.model.everywhere() if everywhere else self.model.window(tool.center)
                found = self.model.equilibrium(state, (before,), (tool,), box)
                state, forces[k] = found.state, found.forces[0]
                touching = bool(np.any(forces[k]))
                if touching:
                    loaded = state
            before = tool
        if touching:
            state = self.model.equilibrium(state, (), (), self.model.everywhere()).state
        self.progress(len(tools), len(tools))
        formed = formed_sheet(self.model.mesh, loaded, state)
        force = self.part.rotation.apply(self.force_factor * self.schedule.interpolated(forces))
        center = self.part.position + self.part.rotation.apply(centers)
        moment = np.cross(center - path.position, force)
        return WrenchHistory(path.time, np.hstack([force, moment]), formed)

    def _centers(self, path: ToolPath) -> np.ndarray:
        """Return the sphere's centres in the part frame, above the TCP along the tool's axis."""
        approach = path.rotation.apply([1.0, 0.0, 0.0])
        center = path.position - self.tool_radius * approach
        return self.part.rotation.inv().apply(center - self.part.position)

    def _tool(self, center: np.ndarray) -> Sphere:
        """Return the tool in the sheet's frame, whose origin is half a thickness below the part's."""
        lift = np.array([0.0, 0.0, 0.5 * self.model.mesh.thickness])
        return self.model.sphere(center + lift, self.tool_radius)
