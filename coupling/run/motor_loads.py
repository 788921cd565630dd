"""What a command asks of the motors of a robot: torques over time, reversals against friction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.case.case import PlacedRobot
from coupling.inverse.servo import presliding
from coupling.path.histories import WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.path.motor_history import MotorHistory
from coupling.results.run_result import DriveMotion, MotorLoad
from coupling.robot.parameters import with_joints
from coupling.robot.robot import LimitWarning
from coupling.robot.simulated_model import SimulatedModel
from elastic_robot.description import Robot
from elastic_robot.gear_parts import Drive

# Longest distance of the times at which motors are looked at [s]: where a gear comes to a flank, a
# torque is at its largest for a few milliseconds.
_WATCHED = 1e-3
# A friction whose stop element is so near to its end slips [1].
_SLIPS = 1.0 - 1e-6


@dataclass(frozen=True)
class MotorLoads:
    """What a command asks of the motors of one robot.

    Attributes:
        history: Their motion and the torques that they would need for it.
        loads: Figures of these, by joint, from 0.
    """

    history: MotorHistory
    loads: dict[int, MotorLoad]

    def beside(self, drives: Sequence[DriveMotion]) -> tuple[DriveMotion, ...]:
        """Return what the command asks of the drives with what it asks of their motors."""
        return tuple(
            drive.model_copy(update={"motor": self.loads.get(drive.joint - 1)}) for drive in drives
        )

    def exceeded(self, robot: str) -> Iterator[LimitWarning]:
        """Yield a warning for each motor whose torque limit is exceeded.

        Args:
            robot: Name of the robot in a cell of several, else empty.
        """
        for joint, load in self.loads.items():
            if load.limit is not None and load.torque > load.limit:
                at = load.torque_time, joint + 1, robot
                yield LimitWarning("motor-torque", load.torque, load.limit, *at)


def motor_warnings(
    robots: Sequence[PlacedRobot], motors: Sequence[MotorLoads | None]
) -> tuple[LimitWarning, ...]:
    """Return a warning for each motor of a case's robots whose torque limit is exceeded."""
    pairs = zip(robots, motors, strict=True)
    return tuple(
        warning
        for placed, loads in pairs
        if loads is not None
        for warning in loads.exceeded(placed.name if len(robots) > 1 else "")
    )


def motor_loads(
    model: SimulatedModel, command: JointPath, wrench: WrenchHistory
) -> MotorLoads | None:
    """Return what a command asks of a robot's motors, whose limits of torque are left out for it.

    So a torque beyond its limit is that which the servo asks for, and what a motor within its limit
    gives is reported.

    Args:
        command: Motion of its drives, or of the commands of its servos.
        wrench: Wrench on its tool, axes of its base.

    Returns:
        None where no joint has a motor.

    Raises:
        SimulationError: If the robot cannot be simulated.
    """
    robot = model.robot
    joints = [i for i, joint in enumerate(robot.joints) if joint.drive is not None]
    if not joints:
        return None
    strong = without_limits(robot)
    instants = wrench.instants
    parts = max(1, int(np.ceil(np.diff(instants).max(initial=0.0) / _WATCHED - 1e-9)))
    rows = np.arange(parts * (len(instants) - 1) + 1) / parts
    time = np.interp(rows, np.arange(len(instants)), instants)
    _, motion = model.fmu.with_motors(command, wrench.refined(time), joints, strong)
    drives = {i: drive for i in joints if (drive := robot.joints[i].drive) is not None}
    loads = {i: motor_load(drives[i], motion.of(k)) for k, i in enumerate(joints)}
    return MotorLoads(motion.every(parts), loads)


def without_limits(robot: Robot) -> Robot:
    """Return a robot whose motors have no torque limit.

    Example:
        >>> from coupling.files.robot_file import find_robot, load_robot
        >>> robot = load_robot(find_robot("icme2008"))
        >>> without_limits(robot) == robot
        True
    """
    motors = [(i, joint, joint.drive) for i, joint in enumerate(robot.joints) if joint.drive]
    unlimited = {
        i: replace(motor_joint, drive=replace(drive, torque_limit=None))
        for i, motor_joint, drive in motors
    }
    return with_joints(robot, unlimited)


def motor_load(drive: Drive, motion: MotorHistory) -> MotorLoad:
    """Return what the motion of one motor comes to.

    Args:
        motion: Its motion, (n, 1) each.

    Example:
        >>> drive = Drive(inertia=1.0, position_gain=1.0, rate_gain=1.0, slip_angle=0.1)
        >>> angle = np.array([0.0, 0.1, 1.0, 0.9, 0.8, 0.0])
        >>> motion = MotorHistory((0,), np.arange(6.0), *[angle[:, None]] * 3)
        >>> found = motor_load(drive, motion)
        >>> found.torque_time, found.reversals, found.presliding
        (2.0, 1, 0.2)
    """
    time, torque, angle = motion.time, np.abs(motion.torque[:, 0]), motion.angle[:, 0]
    part = presliding(angle, drive.slip_angle)
    slips = np.sign(part) * (np.abs(part) >= _SLIPS)
    ways, worst = slips[slips != 0.0], int(torque.argmax())
    within = np.diff(time) @ (slips[1:] == 0.0)
    return MotorLoad(
        torque=float(torque[worst]),
        torque_time=float(time[worst]),
        limit=drive.torque_limit,
        reversals=int(np.sum(ways[1:] != ways[:-1])),
        presliding=float(within / (time[-1] - time[0])),
    )
