"""Torques that the motors of a simulated robot give along a command, and reversals of their friction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.case.case import PlacedRobot
from coupling.errors import SimulationError
from coupling.inverse.servo import presliding
from coupling.path.histories import WrenchHistory
from coupling.path.joint_path import JointPath, MotorHistory
from coupling.results.drive_result import DriveMotion, MotorTorque
from coupling.results.limit_warning import LimitWarning
from coupling.results.run_result import RunResult
from coupling.results.section import Note, Section, Table
from coupling.robot.parameters import with_joints
from coupling.robot.simulated_model import SimulatedModel
from coupling.run.check import Check, CheckedCommand
from elastic_robot.description import Robot
from elastic_robot.drive import Drive

# Longest distance of the times at which motors are looked at [s]: where a gear comes to a flank, a
# torque is at its largest for a few milliseconds.
_WATCHED = 1e-3
# A friction whose stop element is so near to its end slips [1].
_SLIPS = 1.0 - 1e-6


@dataclass(frozen=True)
class SimulatedMotorTorques:
    """What a command asks of the motors of one robot.

    Attributes:
        torques: Figures of these, by joint, from 0.
    """

    history: MotorHistory
    torques: dict[int, MotorTorque]

    def with_motors(self, drives: Sequence[DriveMotion]) -> tuple[DriveMotion, ...]:
        """Return what the command asks of the drives with what it asks of their motors."""
        return tuple(
            drive.model_copy(update=dict(self.torques.get(drive.joint - 1, ()))) for drive in drives
        )

    def exceeded(self, robot: str) -> Iterator[LimitWarning]:
        """Yield a warning for each motor whose torque limit is exceeded."""
        for joint, motor in self.torques.items():
            torque, limit = motor.motor_torque_Nm, motor.motor_torque_limit_Nm
            if limit is not None and torque > limit:
                at = motor.motor_torque_time_s, joint + 1, robot
                yield LimitWarning.of("motor-torque", torque, limit, *at)


def simulate_motor_torques(
    model: SimulatedModel, command: JointPath, wrench: WrenchHistory
) -> SimulatedMotorTorques | None:
    """Return what a command asks of a robot's motors, whose limits of torque are left out for it.

    So a torque beyond its limit is that which the servo asks for, and what a motor within its limit
    gives is reported.

    Args:
        command: Motion of its drives, or of the commands of its servos.
        wrench: Wrench on its tool, axes of its base.

    Returns:
        None where no joint has a motor.
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
    torques = {i: summarise_motor(drives[i], motion.of(k)) for k, i in enumerate(joints)}
    return SimulatedMotorTorques(motion.every(parts), torques)


def without_limits(robot: Robot) -> Robot:
    """Return a robot whose motors have no torque limit."""
    motors = [(i, joint, joint.drive) for i, joint in enumerate(robot.joints) if joint.drive]
    unlimited = {
        i: replace(motor_joint, drive=replace(drive, torque_limit=None))
        for i, motor_joint, drive in motors
    }
    return with_joints(robot, unlimited)


def summarise_motor(drive: Drive, motion: MotorHistory) -> MotorTorque:
    """Return what the motion of one motor comes to.

    Args:
        motion: Its motion, (n, 1) each.

    Example:
        >>> drive = Drive(inertia=1.0, position_gain=1.0, rate_gain=1.0, slip_angle=0.1)
        >>> angle = np.array([0.0, 0.1, 1.0, 0.9, 0.8, 0.0])
        >>> motion = MotorHistory((0,), np.arange(6.0), *[angle[:, None]] * 3)
        >>> motor = summarise_motor(drive, motion)
        >>> motor.motor_torque_time_s, motor.motor_reversals, motor.motor_presliding_share
        (2.0, 1, 0.2)
    """
    time, torque, angle = motion.time, np.abs(motion.torque[:, 0]), motion.angle[:, 0]
    part = presliding(angle, drive.slip_angle)
    slips = np.sign(part) * (np.abs(part) >= _SLIPS)
    ways, worst = slips[slips != 0.0], int(torque.argmax())
    within = np.diff(time) @ (slips[1:] == 0.0)
    return MotorTorque(
        motor_torque_Nm=float(torque[worst]),
        motor_torque_time_s=float(time[worst]),
        motor_torque_limit_Nm=drive.torque_limit,
        motor_reversals=int(np.sum(ways[1:] != ways[:-1])),
        motor_presliding_share=float(within / (time[-1] - time[0])),
    )


def motor_warnings(
    robots: Sequence[PlacedRobot], simulated: Sequence[SimulatedMotorTorques | None]
) -> tuple[LimitWarning, ...]:
    """Return a warning for each motor of a case's robots whose torque limit is exceeded."""
    pairs = zip(robots, simulated, strict=True)
    return tuple(
        warning
        for placed, motors in pairs
        if motors is not None
        for warning in motors.exceeded(placed.name if len(robots) > 1 else "")
    )


def _compute(command: CheckedCommand) -> tuple[SimulatedMotorTorques | None, ...]:
    """Return what a command asks of the motors of every robot; None where that is not simulated."""
    correction = command.correction
    demands: list[SimulatedMotorTorques | None] = []
    for member, model, joints, load in zip(
        command.cell.members,
        command.models,
        correction.joints.robots,
        correction.response.wrench.tools,
        strict=True,
    ):
        in_base = load.transformed(member.world_from_base.inverse())
        try:
            demands.append(simulate_motor_torques(model, joints, in_base))
        except SimulationError:
            demands.append(None)
    return tuple(demands)


def _warnings(command: CheckedCommand) -> tuple[LimitWarning, ...]:
    return motor_warnings(command.case.robots, command.finding_of(MOTOR_TORQUES))


def _sections(figures: RunResult) -> list[Section]:
    driven = [drive for drive in figures.command.drives if drive.motor_torque_Nm is not None]
    if not driven:
        return []
    several = len(figures.robots) > 1
    rows = [
        (
            f"{drive.robot} joint {drive.joint}" if several else f"joint {drive.joint}",
            f"{drive.motor_torque_Nm:.4g}",
            *motor_limit(drive.motor_torque_Nm or 0.0, drive.motor_torque_limit_Nm),
            f"{drive.motor_torque_time_s:.3f}",
            str(drive.motor_reversals),
            f"{100.0 * (drive.motor_presliding_share or 0.0):.1f}",
        )
        for drive in driven
    ]
    columns = (
        *("motor", "torque [N m]", "limit", "used", "at t = [s]", "reversals"),
        "friction sticks [% of the time]",
    )
    return [Section("Demands on the motors", (_MOTORS, Table(columns, rows)))]


def motor_limit(demand: float, limit: float | None) -> tuple[str, str]:
    """Return a motor's limit of torque and what is used of it, in words; torques in N m."""
    return ("none", "-") if limit is None else (f"{limit:.4g}", f"{100.0 * demand / limit:.0f} %")


_MOTORS = Note(
    "Torque of rotor, friction and gear at the gear's output, without the motor's limit. Friction sticks"
    " at rest and after a reversal, until the motor has turned by the presliding angle."
)

MOTOR_TORQUES = Check[tuple[SimulatedMotorTorques | None, ...]](
    "motors", _compute, (), warnings=_warnings, sections=_sections
)
