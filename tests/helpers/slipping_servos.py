"""A robot with motors that rub, servos, and hysteresis in its gears."""

from dataclasses import replace

import numpy as np

from elastic_robot.description import Joint, Robot
from elastic_robot.drive import Drive
from elastic_robot.gear_parts import StopElement

INERTIA = (400.0, 400.0, 300.0, 40.0, 40.0)
FRICTION = (300.0, 300.0, 200.0, 60.0, 50.0)
SLIP_TORQUE = (120.0, 120.0, 90.0, 25.0, 20.0)


def slipping(robot: Robot) -> Robot:
    """The robot with motors, friction and three elements of hysteresis in every elastic gear."""

    def joint(own: Joint, inertia: float, friction: float, torque: float) -> Joint:
        gain = 2.0 * np.pi * 30.0 * inertia
        drive = Drive(inertia, 20.0, gain, gain / 0.02, friction=friction, viscous=friction)
        stops = tuple(StopElement(torque / 3.0, angle) for angle in (2e-5, 6e-5, 1.5e-4))
        return replace(own, drive=drive, hysteresis=stops)

    own = list(robot.joints)
    for number, values in enumerate(zip(INERTIA, FRICTION, SLIP_TORQUE, strict=True)):
        own[number] = joint(own[number], *values)
    return replace(robot, joints=tuple(own))
