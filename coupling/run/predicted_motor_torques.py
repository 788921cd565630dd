"""Torques that a path would ask of the motors of a robot, cold and warm, predicted without a run.

The torque that a motor needs is that of `coupling.inverse.servo`, eq. (1), with the tool on its path and
the tilts at rest under their loads: friction follows the motor, the link less the wind-up and the error
of its gear, the rotor is accelerated as the link is.  What a rotor needs to go through the backlash is
not in it: a run tells that.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.errors import PlanningError, SimulationError
from coupling.inverse.diagnosis import GearLoads, gear_loads, loads_along
from coupling.inverse.inversion import DesiredMotion, MovingRobot
from coupling.inverse.links import rigid_motion
from coupling.inverse.servo import MotorMotion, motor_torque
from coupling.inverse.spline import UniformSpline
from coupling.path.histories import WrenchHistory
from coupling.results.limit_warning import LimitWarning
from coupling.robot.differences import RobotDifference
from coupling.robot.parameter_table import VARIED
from coupling.run.gear_loads import at_samples, wanted_of
from coupling.store import EvaluatedProcess
from elastic_robot.fmi.interface import IDEAL

# Factors of the friction of a warm and of a cold robot, as runs vary it.
COLD, WARM = VARIED["friction"][1].replays


@dataclass(frozen=True)
class PredictedMotorTorque:
    """What a path asks of one motor, seen at its gear's output.

    Attributes:
        joint: Number, from 1.
        limit: Largest torque that it has [N m], or None.
        torque: Largest torque that it needs, to either side, by factor of its friction [N m].
        time: Instant of it, likewise [s].
    """

    joint: int
    limit: float | None
    torque: dict[float, float]
    time: dict[float, float]

    @property
    def warnings(self) -> tuple[LimitWarning, ...]:
        """Warning of a limit that is passed, or that another friction passes; none where none is."""
        endings = {} if self.limit is None else {1.0: "", WARM: "-warm", COLD: "-cold"}
        for factor, ending in endings.items():
            if self.limit is not None and self.torque[factor] > self.limit:
                at = self.time[factor], self.joint
                warning = LimitWarning.of(
                    f"motor-torque{ending}", self.torque[factor], self.limit, *at
                )
                return (warning,)
        return ()

    @property
    def exceeded(self) -> str:
        """Whether its limit is passed, in words."""
        words = {"motor-torque": "yes", "motor-torque-warm": "warm", "motor-torque-cold": "cold"}
        return "".join(words[warning.name] for warning in self.warnings) or "-"


def predict_motor_torques(
    moving: MovingRobot, links: UniformSpline, loads: GearLoads
) -> tuple[PredictedMotorTorque, ...]:
    """Return what a path asks of the motors of a robot."""
    chain, joints = moving.model.chain, moving.model.gear_joint
    wind_up = moving.wind_up_from(loads.static[0], loads.time, loads.torque)
    motion = np.stack([links.at(loads.time, order)[:, chain.drive] for order in range(3)])
    motion[0][:, joints] -= wind_up.angle
    motion[1][:, joints] -= wind_up.rate
    motors = chain.kinematic_errors.at_motor(motion)
    slope = chain.kinematic_errors.slope(motors[0])
    robots = {
        factor: RobotDifference({"friction": (factor,)}).applied(moving.robot, moving.torque_curve)
        for factor in (1.0, WARM, COLD)
    }
    demands = []
    for gear, joint in enumerate(moving.model.gear_joint.tolist()):
        drives = {factor: robot.joints[joint].drive for factor, robot in robots.items()}
        if drives[1.0] is None:
            continue
        gear_torque = -loads.carried[:, gear]
        angle, rate, acceleration = motors[:, :, joint]
        first_torque, felt = float(gear_torque[0]), slope[:, joint]
        motor_motion = MotorMotion(
            loads.time, angle, rate, acceleration, gear_torque, first_torque, felt
        )
        needed = {
            f: np.abs(motor_torque(drive, motor_motion)) for f, drive in drives.items() if drive
        }
        demands.append(
            PredictedMotorTorque(
                joint + 1,
                drives[1.0].torque_limit,
                {f: float(torque.max()) for f, torque in needed.items()},
                {f: float(loads.time[torque.argmax()]) for f, torque in needed.items()},
            )
        )
    return tuple(demands)


def require_motors_that_hold(case: Case) -> None:
    """Refuse servos whose motors do not hold their robot at rest, friction's help included.

    Raises:
        PlanningError: With joint, time, torque and limit.
    """
    none = WrenchHistory.none(case.desired.time, len(case.robots))
    for placed, motion in _limited_robots(case, none):
        moving = MovingRobot(placed.description, placed.torque_curve)
        loads = gear_loads(moving, motion)
        for gear, joint in enumerate(moving.model.gear_joint.tolist()):
            drive, static_torque = (
                placed.description.joints[joint].drive,
                np.abs(loads.static[:, gear]),
            )
            if drive is None or drive.torque_limit is None:
                continue
            most, at = float(static_torque.max()), float(loads.time[static_torque.argmax()])
            if most > drive.torque_limit + drive.friction:
                warning = LimitWarning.of("motor-torque", most, drive.torque_limit, at, joint + 1)
                raise PlanningError(
                    f"{_with_robot_name(case, placed, warning)}, at rest and without any process: the"
                    " robot would fall"
                )


@contextmanager
def explained_by_motors(case: Case, process: EvaluatedProcess) -> Iterator[None]:
    """Let robots that cannot be simulated as their motors do not hold them be an error that says so.

    A robot whose motor has less torque than its weight or the process needs falls, and nothing can be
    computed of it.

    Raises:
        PlanningError: In the place of a SimulationError, with joint, time, torque and limit.
    """
    try:
        yield
    except SimulationError as error:
        none = WrenchHistory.none(case.desired.time, len(case.robots))
        loads = [("without any process", none)]
        if process.last is not None:
            wrench = at_samples(process.last.response.wrench, process.last.path, case.desired)
            loads.append(("under the process", wrench))
        for what, wrench in loads:
            for warning in _exceeded_limits(case, wrench):
                raise PlanningError(
                    f"{warning}, {what}: slow down the path, or expect the robot to fall"
                ) from error
        raise


def _exceeded_limits(case: Case, wrench: WrenchHistory) -> Iterator[LimitWarning]:
    """Yield a warning for each motor of servos that has too little torque for the desired path."""
    for placed, motion in _limited_robots(case, wrench):
        moving = MovingRobot(placed.description, placed.torque_curve)
        task = moving.task(motion)
        links = rigid_motion(moving.model, task)
        for demand in predict_motor_torques(moving, links, loads_along(moving, links, task.wrench)):
            for warning in demand.warnings:
                if warning.name == "motor-torque":
                    yield _with_robot_name(case, placed, warning)


def _limited_robots(
    case: Case, wrench: WrenchHistory
) -> Iterator[tuple[PlacedRobot, DesiredMotion]]:
    """Yield the robots that servos move whose torque has a limit, and what is wanted of each."""
    motions = wanted_of(case.robots, case.desired, wrench)
    for placed, motion in zip(case.robots, motions, strict=True):
        drives = [joint.drive for joint in placed.description.joints]
        if placed.drive != IDEAL and any(drive and drive.torque_limit for drive in drives):
            yield placed, motion


def _with_robot_name(case: Case, placed: PlacedRobot, warning: LimitWarning) -> LimitWarning:
    return warning.of_robot(placed.name if len(case.robots) > 1 else "")
