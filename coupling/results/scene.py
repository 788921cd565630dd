"""What a page shows in space: robots that move along their paths, and how far their tools are off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from coupling.path.frame import AT_THE_ORIGIN, Frame
from coupling.results.base import Shown


@dataclass(frozen=True)
class ScenePart:
    """Surface in triangles.

    Attributes:
        points: Corners [m], (n, 3).
        triangles: Numbers of their corners, (m, 3).
        body: Body of the robot that it moves with, from 0, the base, to the number of joints.
    """

    points: np.ndarray
    triangles: np.ndarray
    body: int = 0


@dataclass(frozen=True)
class SceneTool:
    """Shape of a tool, a cylinder whose end is the TCP.

    Attributes:
        is_round: Whether its end is a half sphere.
    """

    diameter: float
    is_round: bool


@dataclass(frozen=True)
class SceneMotion:
    """Motion of a robot's joints, straight between its rows.

    Attributes:
        time: Rising [s], (n,).
        q: Joint angles [rad], (n, joints).
        torque: Torques of the gears at rest [N m], (n, joints); None where they are not known.
    """

    time: np.ndarray
    q: np.ndarray
    torque: np.ndarray | None = None


@dataclass(frozen=True)
class SceneMode:
    """A mode of vibration in the posture of the first row of the motion.

    Attributes:
        frequency: Its frequency [Hz].
        amplitude: Amplitude of every joint, of any scale, without a unit, (joints,).
    """

    frequency: float
    amplitude: np.ndarray


@dataclass(frozen=True)
class SceneRobot:
    """A robot as a chain of bodies whose frames are parallel to its base at zero angles.

    Attributes:
        world_from_base: Frame of its base.
        origins: Origin of each joint in the body before it [m], (joints, 3).
        axes: Axes of the joints, unit vectors, (joints, 3).
        body_from_tool: Frame of the TCP in the last body.
        flanks: Times from which the gear of a joint is at its upper flank, 1, its lower one, -1, or
            in its backlash, 0, by the number of the joint from 0: pairs, (k, 2).
        tool: Shape of its tool; None where it is not known.
        meshes: Surfaces of its bodies; none where links are drawn.
    """

    name: str
    world_from_base: Frame
    origins: np.ndarray
    axes: np.ndarray
    body_from_tool: Frame
    motion: SceneMotion
    flanks: Mapping[int, np.ndarray]
    tool: SceneTool | None = None
    meshes: Sequence[ScenePart] = ()
    modes: Sequence[SceneMode] = ()


@dataclass(frozen=True)
class SceneTrack:
    """Path of a tool beside the desired one, straight between its rows.

    Attributes:
        name: Name of the track; those of several tools share it.
        time: Rising [s], (n,).
        desired: Desired positions, world frame [m], (n, 3).
        deviation: Actual minus desired positions, world axes [m], (n, 3).
        signed: Deviation normal to the part, along the feed and across both [m], (n, 3).
        robot: Name of the robot among several.
    """

    name: str
    time: np.ndarray
    desired: np.ndarray
    deviation: np.ndarray
    signed: np.ndarray
    robot: str = ""


@dataclass(frozen=True)
class SceneLine:
    """A line in space.

    Attributes:
        name, color: Its entry in the legend.
        points: Its points [m], (n, 3); a row that is not finite is a gap.
    """

    name: str
    color: str
    points: np.ndarray


@dataclass(frozen=True)
class SceneSurface:
    """A workpiece at rest, coloured by the deviation of the tool that shaped it or by one of its fields.

    Attributes:
        name: Name of the workpiece, that of the track that belongs to it; empty for all tracks.
        points: Corners [m], (n, 3).
        triangles: Numbers of their corners, (m, 3).
        fields: Values by label with unit, of the corners, (n,), or of the triangles, (m,); NaN where
            there is none.
        time: Time at which the tool shaped each corner [s], NaN where it did not, (n,); None: not known.
    """

    name: str
    points: np.ndarray
    triangles: np.ndarray
    fields: Mapping[str, np.ndarray] = field(default_factory=dict)
    time: np.ndarray | None = None


@dataclass(frozen=True)
class Scene(Shown):
    """What a page shows in space, world frame.

    Attributes:
        tolerance: Deviation that the part allows [m]; None where it is not stated.
    """

    robots: Sequence[SceneRobot] = ()
    tracks: Sequence[SceneTrack] = ()
    lines: Sequence[SceneLine] = ()
    surfaces: Sequence[SceneSurface] = ()
    world_from_part: Frame = AT_THE_ORIGIN
    tolerance: float | None = None
