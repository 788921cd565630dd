"""Frames of a program: part and tool as the robot's controller sees them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.case import PlacedRobot
from coupling.files.controller_axes import ControllerAxes
from coupling.path.histories import ToolPath, poses
from coupling.programs.program import Pose
from coupling.toolpaths.part import Part
from elastic_robot.description import Robot


@dataclass(frozen=True)
class Placed:
    """A frame in another one.

    Attributes:
        position: Its origin [m], (3,).
        rotation: From its axes to the other's.

    Example:
        >>> up = Placed(np.array([0.0, 0.0, 1.0]), Rotation.from_euler("z", 90.0, degrees=True))
        >>> path = ToolPath(np.array([0.0, 1.0]), np.tile([1.0, 0, 0, 0, 0, 0, 1.0], (2, 1)))
        >>> up.outside(path).position[0, 0].round(9).tolist()
        [0.0, 1.0, 1.0]
    """

    position: np.ndarray
    rotation: Rotation

    @classmethod
    def of(cls, pose: Pose) -> Placed:
        """Return the frame of a pose."""
        return cls(np.array(pose[:3]), Rotation.from_quat(pose[3:]))

    @property
    def pose(self) -> Pose:
        """The frame as a pose."""
        return tuple(poses(self.position[None], Rotation.concatenate([self.rotation]))[0].tolist())

    def inside(self, path: ToolPath) -> ToolPath:
        """Return a path given in the other frame in this one."""
        back = self.rotation.inv()
        position = back.apply(path.position[0] - self.position)
        return ToolPath(path.time, poses(position, back * path.rotations[0]))

    def outside(self, path: ToolPath) -> ToolPath:
        """Return a path given in this frame in the other one."""
        position = self.position + self.rotation.apply(path.position[0])
        return ToolPath(path.time, poses(position, self.rotation * path.rotations[0]))


def part_frame(part: Part, robot: PlacedRobot, axes: ControllerAxes) -> Placed:
    """Return the part's frame in that of the robot's controller: the base frame of its program.

    A robot that was touched off has it as its controller shows it.
    """
    origin, rotation, own = part.position, part.rotation, robot.touch_off
    if own is not None:
        origin, rotation = own.shown(origin), own.rotation.inv() * rotation
    base_from_world = robot.placement.rotation.inv()
    position = base_from_world.apply(origin - robot.placement.position)
    return Placed(position - axes.base_position, base_from_world * rotation)


def tool_frame(robot: Robot, axes: ControllerAxes) -> Placed:
    """Return the TCP's frame in that of the maker's flange."""
    flange_from_last = axes.last_from_flange.inv()
    position = flange_from_last.apply(np.array(robot.tcp_position) - axes.flange_position)
    return Placed(position, flange_from_last * Rotation.from_euler("xyz", robot.tcp_rpy))


def with_tool(robot: Robot, tool: Placed, axes: ControllerAxes) -> Robot:
    """Return a robot that carries a tool as a program states it."""
    position = axes.flange_position + axes.last_from_flange.apply(tool.position)
    rpy = (axes.last_from_flange * tool.rotation).as_euler("xyz")
    return replace(robot, tcp_position=tuple(position.tolist()), tcp_rpy=tuple(rpy.tolist()))
