"""Frames of a program: part and tool as the robot's controller sees them."""

from __future__ import annotations

from dataclasses import replace

from coupling.case.case import PlacedRobot
from coupling.files.controller_axes import ControllerAxes
from coupling.path.frame import AT_THE_ORIGIN, Frame
from elastic_robot.description import Robot


def part_frame(world_from_part: Frame, robot: PlacedRobot, axes: ControllerAxes) -> Frame:
    """Return the part's frame in that of the robot's controller: the base frame of its program.

    A robot that was touched off has it as its controller shows it.
    """
    if robot.touch_off is not None:
        world_from_part = robot.touch_off.real_from_shown.inverse() @ world_from_part
    return controller_from_base(axes) @ robot.world_from_base.inverse() @ world_from_part


def controller_from_base(axes: ControllerAxes) -> Frame:
    """Return controller_from_base, of the robot file's base."""
    return Frame(-axes.base_position, AT_THE_ORIGIN.rotation)


def tool_frame(robot: Robot, axes: ControllerAxes) -> Frame:
    """Return the TCP's frame in that of the maker's flange."""
    return _last_from_flange(axes).inverse() @ Frame.of_rpy(robot.tcp_position, robot.tcp_rpy)


def _last_from_flange(axes: ControllerAxes) -> Frame:
    return Frame(axes.flange_position, axes.last_from_flange)


def with_tool(robot: Robot, flange_from_tool: Frame, axes: ControllerAxes) -> Robot:
    """Return a robot that carries a tool as a program states it."""
    tcp = _last_from_flange(axes) @ flange_from_tool
    rpy = tcp.rotation.as_euler("xyz").tolist()
    return replace(robot, tcp_position=tuple(tcp.position.tolist()), tcp_rpy=tuple(rpy))
