"""Robot -> the text that the C core reads (`native/core/chain/robot_data.c`): data, not code."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from functools import cache

import numpy as np
import pinocchio as pin

from coupling.files.balancer_table import MOST_POINTS
from coupling.files.gear_table import MOST_ELEMENTS, MOST_ERRORS
from elastic_robot.balancers import BalancerCurve
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot, Table
from elastic_robot.drive import Drive
from elastic_robot.errors import RobotFileError
from elastic_robot.settings import SETTINGS

VERSION = 3
# What the C core's arrays hold (ER_MAX_JOINTS and ER_MAX_KNOTS in robot_data.h).
MOST_JOINTS = 12
MOST_TABLE_POINTS = 64


def require_native(robot: Robot) -> None:
    """Refuse a robot with more joints than a native FMU holds.

    Raises:
        RobotFileError: If it has.
    """
    if len(robot.joints) > MOST_JOINTS:
        raise RobotFileError(
            f"{robot.name}: expected at most {MOST_JOINTS} joints for a native FMU, got"
            f" {len(robot.joints)}: leave out joints that stand still, or build the FMU in Python"
            ' (fmu = "python" in [robot], build --kind python)'
        )


def robot_text(robot: Robot, guid: str) -> str:
    r"""Return the robot as lines of a key and numbers with all their digits.

    Args:
        guid: GUID of the FMU; the C core compares it with the one it is instantiated with.

    Raises:
        RobotFileError: If the robot has more joints, or a table more points, than the core holds.

    Example:
        >>> link = Body(mass=10.0, com=(0.5, 0.0, 0.0), inertia=(0.1, 1.0, 1.0))
        >>> joint = Joint(origin=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), body=link, stiffness=1e5)
        >>> robot = Robot("pendulum", joints=(joint,), tcp_position=(1.0, 0.0, 0.0))
        >>> lines = robot_text(robot, "{x}").splitlines()
        >>> print(*(line for line in lines if not line.startswith("setting")), sep="\n")
        elastic-robot 3
        guid {x}
        gravity 0.0 0.0 -9.81
        tcp 1.0 0.0 0.0 1.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 1.0
        joint 0.0 0.0 0.0 0.0 1.0 0.0
        spring 100000.0 0.0 0.0
        body 10.0 0.5 0.0 0.0 0.1 1.0 1.0 0.0 0.0 0.0
        end
    """
    require_native(robot)
    rotation = pin.rpy.rpyToMatrix(*robot.tcp_rpy)
    lines = [
        f"elastic-robot {VERSION}",
        f"guid {guid}",
        _line("gravity", robot.gravity),
        _line("tcp", [*robot.tcp_position, *rotation.ravel().tolist()]),
        *_setting_lines(),
    ]
    for number, joint in enumerate(robot.joints, start=1):
        lines += _joint_lines(number, joint)
    if robot.payload is not None:
        lines.append(_body_line(robot.payload))
    return "\n".join([*lines, "end"])


@cache
def _setting_lines() -> tuple[str, ...]:
    return tuple(_line(f"setting {name}", [value]) for name, value in asdict(SETTINGS).items())


def _joint_lines(number: int, joint: Joint) -> list[str]:
    lines = [_line("joint", [*joint.origin, *joint.axis])]
    _require(number, "kinematic_error", "sines", MOST_ERRORS, len(joint.kinematic_error))
    lines += [_line("error", [e.amplitude, e.order, e.phase]) for e in joint.kinematic_error]
    if joint.stiffness is not None:
        lines.append(_line("spring", [joint.stiffness, joint.damping, joint.backlash]))
    if joint.torque_table is not None:
        points = len(joint.torque_table)
        _require(number, "torque_table", "points", MOST_TABLE_POINTS, points)
        lines.append(_line(f"table {points}", [v for row in joint.torque_table for v in row]))
    if joint.balancer is not None:
        _require(number, "balancer", "points", MOST_POINTS, len(joint.balancer))
        lines.append(_balancer_line(joint.balancer))
    _require(number, "hysteresis", "elements", MOST_ELEMENTS, len(joint.hysteresis))
    lines += [_line("stop", [stop.slip_torque, stop.slip_angle]) for stop in joint.hysteresis]
    if joint.drive is not None:
        lines.append(_motor_line(joint.drive))
    lines += [_line("tilt", [*t.axis, t.stiffness, t.damping]) for t in joint.tilt]
    return [*lines, _body_line(joint.body)]


def _require(number: int, key: str, what: str, most: int, got: int) -> None:
    if got > most:
        raise RobotFileError(
            f"joint {number}: {key}: expected at most {most} {what} for a native FMU, got {got}"
        )


@cache
def _balancer_line(table: Table) -> str:
    """Points with the slopes of their curve, whose cubics are those through value and slope."""
    points = np.array(table)
    slope = BalancerCurve.through(table).slope(points[:, 0])
    return _line(f"balancer {len(table)}", np.column_stack([points, slope]).ravel())


def _motor_line(drive: Drive) -> str:
    numbers = (
        drive.inertia,
        drive.friction,
        drive.slip_angle,
        drive.viscous,
        drive.stribeck,
        drive.stribeck_rate,
        drive.position_gain,
        drive.rate_gain,
        drive.integral_gain,
        drive.feed_forward,
        drive.torque_limit or 0.0,  # without a limit
        drive.load_friction,
    )
    return _line("motor", numbers)


def _body_line(body: Body) -> str:
    xx, yy, zz, xy, xz, yz = (*body.inertia, 0.0, 0.0, 0.0)[:6]
    return _line("body", [body.mass, *body.com, xx, yy, zz, xy, xz, yz])


def _line(key: str, values: Iterable[float]) -> str:
    # repr gives the shortest text that reads back as the same number.
    return " ".join([key, *(repr(float(value)) for value in values)])
