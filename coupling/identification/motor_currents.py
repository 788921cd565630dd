"""Currents of motors -> torques at their gears' outputs, by the torque constants of a robot file."""

from __future__ import annotations

from elastic_robot.description import Robot


def torque_per_current(robot: Robot, joint: int, table: object, error: type[Exception]) -> float:
    """Return the torque at the gear's output over the current of a joint's motor [N m/A].

    Args:
        joint: Number of the joint, from 0.
        table: Name of the table with the current, for the message.
        error: Exception class where the robot's file does not tell.
    """
    drive = robot.joints[joint].drive
    if drive is None or drive.torque_per_current is None:
        raise error(
            f"{table}: motor_current[{joint + 1}]: expected torque_constant_Nm_A in [joint.drive] of"
            f" joint {joint + 1} in the robot file, got none"
        )
    return drive.torque_per_current
