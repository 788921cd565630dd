"""A tool path before its tool is tilted, and the sphere that a tilted tool touches its part with."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, poses
from coupling.toolpaths.part import PART_FROM_TOOL
from coupling.toolpaths.task import Task
from coupling.toolpaths.tilt import APPROACH, ToolTilt

# Largest difference of orientations of what keeps its own along a path [rad].
_ROTATION_TOLERANCE = 1e-9


@dataclass(frozen=True)
class UntiltedPath:
    """Path of a tool that stands as its path has it.

    Attributes:
        part: base_from_part.
        path: Path of the tool's tip, in the world.
        sample_rows: Row numbers at which a process is evaluated, (k,).
        axes: Axes that lead and lean are measured in at its times, in the part, (n,); None: the part's.
    """

    part: Frame
    path: ToolPath
    sample_rows: np.ndarray
    axes: Rotation | None = None

    @property
    def along_path(self) -> Rotation:
        """Orientations of the tool in the part, (n,)."""
        return self.part.rotation.inv() * self.path.rotations[0]

    def headed(self, heading: np.ndarray) -> UntiltedPath:
        """Return the path with lead and lean measured in axes of its feed.

        x points along the feed, z out of the part, opposite to the tool's approach.

        Args:
            heading: Angles of the feed about that z axis, from the tool's z towards its y [rad], (n,).
        """
        about_z = Rotation.from_rotvec(np.outer(heading, [0.0, 0.0, 1.0]))
        return replace(self, axes=self.along_path * PART_FROM_TOOL.inv() * about_z)

    @property
    def turns(self) -> bool:
        """Whether what a tilt is measured from turns along the path."""
        return any(
            not keeps(directions)
            for directions in (self.along_path, self.axes)
            if directions is not None
        )

    def tilted(self, tilt: ToolTilt) -> ToolPath:
        """Return the path with its tool turned about its tip."""
        if tilt == ToolTilt():
            return self.path
        rotation = self.part.rotation * tilt.part_from_tool(self.along_path, self.axes)
        return ToolPath(self.path.time, poses(self.path.position[0], rotation))

    @property
    def sampled(self) -> UntiltedPath:
        """The path where a process is evaluated, alone."""
        rows = self.sample_rows
        axes = None if self.axes is None else self.axes[rows]
        return UntiltedPath(self.part, self.path.at_rows(rows), np.arange(len(rows)), axes)

    def centered(self, radius: float) -> UntiltedPath:
        """Return the path of the centre of the sphere that the tool ends in."""
        away = -radius * self.path.rotations[0].apply(APPROACH)
        pose = np.hstack([self.path.position[0] + away, self.path.pose[0, :, 3:]])
        return replace(self, path=ToolPath(self.path.time, pose))

    def on_sphere(self, task: Task, tilt: ToolTilt, radius: float) -> Task:
        """Return a task whose tilted tool has its sphere where that of the untilted one is.

        The TCP is the point of the sphere that the untilted tool's tip is at.  Where that point wanders
        over the sphere, because the tool turns along its path, the TCP is the sphere's centre.

        Args:
            task: Task along this path, its TCP being the tip.
            radius: Radius of the sphere [m].
        """
        if tilt.keeps_axis:
            return task
        rotation = tilt.part_from_tool(self.along_path, self.axes)
        contact = rotation.inv().apply(self.along_path.apply(APPROACH))
        if np.abs(contact - contact[0]).max() < _ROTATION_TOLERANCE:
            return replace(task, contact=contact[0])
        forming = self.centered(radius).tilted(tilt)
        return replace(task, forming=forming, contact=np.zeros(3), height=radius)


def keeps(orientations: Rotation) -> bool:
    """Return whether orientations along a path, (n,), are one."""
    return bool((orientations * orientations[0].inv()).magnitude().max() < _ROTATION_TOLERANCE)
