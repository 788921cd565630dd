"""Commands of a robot's servos, from the motion of its motors that keeps the tool on its path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.errors import PlanningError
from coupling.inverse.drive_limits import DriveLimits, NoCommandError
from coupling.inverse.inversion import InverseSolution, MovingRobot, fine_times
from coupling.inverse.joint_limits import JointLimits
from coupling.inverse.rows import CommandRows
from coupling.inverse.rows_fit import RowsFit, dense_times
from coupling.inverse.servo import MotorMotion, servo_motion
from coupling.inverse.spline import UniformSpline
from elastic_robot.drive import Drive

# A motor that its command's limits keep so far from its motion does not follow it at all [rad].
_LOST = 1e-3


class RobotServos:
    """Servos of a robot along its path.

    The gears' torque is that which the links need, so the motors are to be those that move these.

    Args:
        moving: The robot.
        solution: Its inverse: the links, and the motors on their rows.
        limits: Limits of the drives, which the commands keep as well.
        ends_at_rest: Whether the path is at rest at its start, and at its end.
    """

    def __init__(
        self,
        moving: MovingRobot,
        solution: InverseSolution,
        limits: JointLimits,
        ends_at_rest: tuple[bool, bool],
    ) -> None:
        self._moving, self._limits, motors = moving, limits, solution.command
        self._rows = CommandRows(
            motors.start, motors.spacing, motors.intervals, motors.degree, ends_at_rest
        )
        theta = solution.links.theta
        fine = fine_times(theta)
        needed = CubicSpline(fine, moving.torque(theta, fine, solution.wrench))
        self._gear_torque = -needed(np.minimum(dense_times(self._rows), theta.end))
        first = theta.at(fine[:1])
        zero = 0.0 * first
        static = moving.model.desk.loads(first, zero, zero, solution.wrench(fine[:1]))
        self._held = static[0, moving.model.gears]

    def command(self, motors: UniformSpline) -> UniformSpline:
        """Return the commands of servos for this motion of their motors; other joints as they are.

        Args:
            motors: Motion of the motors [rad], a column a joint, on the rows.

        Raises:
            PlanningError: If a motor needs more torque than it has, or no command moves it so within
                the limits; with joint, time, value and limit.
        """
        time, moving = dense_times(self._rows), self._moving
        motion = [motors.at(time, order) for order in range(3)]
        slope = moving.model.chain.kinematic_errors.slope(motion[0])
        coefficients = motors.coefficients.copy()
        for gear, joint in enumerate(moving.model.gear_joint):
            drive = moving.robot.joints[joint].drive
            if drive is not None:
                angle, rate, acceleration = (values[:, joint] for values in motion)
                torque, static = self._gear_torque[:, gear], float(self._held[gear])
                motor_motion = MotorMotion(
                    time, angle, rate, acceleration, torque, static, slope[:, joint]
                )
                limits = self._limits.of_joint(joint)
                coefficients[:, joint] = _column(drive, motor_motion, self._rows, limits)
        return replace(motors, coefficients=coefficients)


def _column(
    drive: Drive, motion: MotorMotion, rows: CommandRows, limits: DriveLimits
) -> np.ndarray:
    """Return the coefficients of one servo's command [rad]."""
    servo = servo_motion(drive, motion)
    _require_torque(drive, limits.joint, motion.time, servo.torque)
    begins = float(motion.angle[0]), float(motion.rate[0]), float(motion.acceleration[0])
    fit = RowsFit(
        drive, rows, servo.angle, begins, () if rows.rest[1] else (float(servo.rate[-1]),)
    )
    try:
        coefficients = fit.best(limits)
    except NoCommandError as error:
        raise _lost(limits) from error
    if np.abs(fit.missed(coefficients)).max() > _LOST:
        raise _lost(limits)
    return coefficients


def _require_torque(drive: Drive, joint: int, time: np.ndarray, torque: np.ndarray) -> None:
    """Refuse a motion for which a motor has too little torque."""
    worst = int(np.abs(torque).argmax())
    limit, needed = drive.torque_limit, float(np.abs(torque[worst]))
    if limit is not None and needed > limit:
        raise PlanningError(
            f"joint {joint}: expected at most {limit:.6g} N m of motor torque, got a path that needs"
            f" {needed:.6g} N m, {needed - limit:.3g} N m too much, at {time[worst]:.3f} s: slow down"
            " the path"
        )


def _lost(limits: DriveLimits) -> PlanningError:
    limited = [(limits.rate, "rad/s"), (limits.acceleration, "rad/s^2")]
    text = [f"{most:.6g} {unit}" for most, unit in limited if np.isfinite(most)]
    if np.isfinite([limits.lower, limits.upper]).any():
        text.insert(0, f"{limits.lower:.6g} to {limits.upper:.6g} rad")
    return PlanningError(
        f"joint {limits.joint}: expected a command of its servo within {', '.join(text)}, got none that"
        " moves its motor as the path requires: slow down the path"
    )
