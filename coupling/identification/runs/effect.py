"""What the parameters do to the tool, with the torque that the links need held, or by simulations.

Through the simulation itself small changes grow without bound while a gear is unloaded in its backlash;
through the gear's own equation, d e' + S(e) = T(t), two answers never part (`coupling.inverse.gears`).
The tool moves by J_i de_i/dp.  That leads near the solution but not into it, since the torques that are
held are not quite those of the robot that moves.  Friction moves a motor under its servo.  Near the
solution finite changes of some per cent, whose effect is looked at slowly, lead the rest of the way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.identification.runs.measurement import MeasuredPath
from coupling.identification.runs.parameters import prior_of
from coupling.inverse.inversion import MovingRobot
from coupling.inverse.links import solve_links
from coupling.inverse.servo import presliding
from coupling.inverse.spline import UniformSpline
from coupling.robot.parameters import RobotParameter, apply_values, scaled_values
from coupling.robot.robot_fmu import RobotFmu
from elastic_robot.description import Robot
from elastic_robot.drive import Drive
from elastic_robot.parameters import Parameters

# Relative change of a parameter for a difference.
_CHANGE = 0.02
# Times between two at which the Jacobian is taken.
_SELDOM = 4
# Parameters whose standard deviation before moves the tool by less [m], and turns it by less where that
# is measured [rad], are left to the gears' equation.
_NEGLIGIBLE, _NEGLIGIBLE_TURN = 3e-7, 1e-6
# Those that change what motors do by less than this part of its deviation are left to it, too.
_NEGLIGIBLE_PART = 0.05

T = TypeVar("T")


class ParameterEffect:
    """Derivatives of the tool's pose by log factors of the parameters, along one measured run.

    Args:
        robot: The robot.
        torque_curve: Name of its gears' torque curve.
        parameters: Parameters that are learned.
        run: The measured run.

    Attributes:
        parameters: The same.
    """

    def __init__(
        self,
        robot: Robot,
        torque_curve: str,
        parameters: tuple[RobotParameter, ...],
        run: MeasuredPath,
    ) -> None:
        self._robot, self._torque_curve, self.parameters = robot, torque_curve, parameters
        self._run = run
        moving = MovingRobot(robot, torque_curve)
        task = moving.task(run.desired_motion)
        self.theta: UniformSpline = solve_links(moving.model, task).theta
        self._time = self.theta.nodes
        self._torque = moving.torque(self.theta, self._time, task.wrench)
        at = self.theta.at(self.theta.nodes[::_SELDOM])
        at_rest = np.zeros_like(at)
        linear = moving.model.desk.linearised(at, at_rest, at_rest, np.zeros((len(at), 6)))
        self._jacobian = CubicSpline(self.theta.nodes[::_SELDOM], linear.jacobian)
        self._model = moving.model
        none = np.zeros(len(parameters))
        self._known = {none.tobytes(): self._wind_ups(none, len(self._time))}

    def robot(self, x: np.ndarray) -> Robot:
        """Return the robot with log factors x [1], (P,)."""
        return apply_values(self._robot, scaled_values(self.parameters, x))

    def __call__(self, x: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Return displacement [m] and turn [rad] of the tool by log factors, base axes, (n, 6 + c, P).

        Behind them is what these do to angles [rad] and torques [N m] of motors that were recorded.

        Args:
            x: Log factors around which [1], (P,).
            time: Times [s], (n,).
        """
        model = self._model
        inside = np.clip(time, self.theta.start, self.theta.end)
        jacobian = self._jacobian(inside)
        theta = self.theta.at(inside)
        # A gear's wind-up does not know what comes later.
        count = min(int(np.searchsorted(self._time, inside.max())) + 2, len(self._time))
        wind_ups = self._known.get(x.tobytes())
        if wind_ups is None or len(wind_ups[""]) < count:
            # Those of the robot of the file, which every part of a run asks for, and the last ones.
            of_file = dict(list(self._known.items())[:1])
            wind_ups = self._wind_ups(x, count)
            self._known = of_file | {x.tobytes(): wind_ups}
        rate = self.theta.at(inside, order=1)
        numbers = Parameters.of(self.robot(x))
        settling = numbers.damping / numbers.stiffness  # [s]
        motors = () if self._run.measured.motors is None else self._run.measured.motors.columns
        columns = np.zeros((len(time), 6 + len(motors), len(x)))
        for k, parameter in enumerate(self.parameters):
            if parameter.gear is None:
                angle = int(model.chain.elastic[parameter.coordinate])
                behind = settling[parameter.coordinate] * rate if parameter.vibrates else theta
                motion = -behind[:, angle]
            elif parameter.row.of_motor:
                angle = int(model.gears[parameter.gear])
                joint = int(model.chain.elastic_joint[parameter.coordinate])
                moving = self._by_motor(parameter, joint, x[k])
                motion = np.interp(inside, self._time, moving["motor"])
                for c, (kind, of) in enumerate(motors):
                    if of == joint:
                        columns[:, 6 + c, k] = np.interp(inside, self._time, moving[kind])
            else:
                angle = int(model.gears[parameter.gear])
                change = wind_ups[parameter.kind] - wind_ups[""]
                own_time = self._time[: len(change)]
                motion = np.interp(inside, own_time, change[:, parameter.gear]) / np.log1p(_CHANGE)
            columns[:, :6, k] = jacobian[:, :, angle] * motion[:, None]
        return columns

    def _by_motor(self, parameter: RobotParameter, joint: int, log: float) -> dict[str, np.ndarray]:
        """Return how a motor's angle [rad] and torque [N m] follow a log factor of it, (k,)."""
        column = int(self._model.gears[parameter.gear])
        angle, rate = (self.theta.at(self._time, order)[:, column] for order in (0, 1))
        value = parameter.value * float(np.exp(log))
        drive, other = (
            apply_values(self._robot, {parameter.name: factor * value}).joints[joint].drive
            for factor in (1.0, 1.0 + _CHANGE)
        )
        assert drive is not None
        assert other is not None
        torque = (_friction(other, angle, rate) - _friction(drive, angle, rate)) / _CHANGE
        return {"motor": moved_by_load(drive, self._time, torque), "motor_torque": torque}

    def _wind_ups(self, x: np.ndarray, count: int) -> dict[str, np.ndarray]:
        """Return the gears' wind-up at the first times, and with each kind changed in all gears."""
        wind_ups, starts = {}, dict[str, np.ndarray]()
        time, torque = self._time[:count], self._torque[:count]
        for kind in dict.fromkeys(["", *(p.kind for p in self.parameters if not p.row.of_motor)]):
            change = [np.log1p(_CHANGE) * (p.kind == kind) for p in self.parameters]
            moving = MovingRobot(self.robot(x + np.array(change)), self._torque_curve)
            static = "" if kind == "damping" else kind  # dampers carry nothing at rest
            if static not in starts:
                wrench = self._run.desired_motion.wrench
                starts[static] = moving.at_rest(self.theta, time[:1], wrench)
            wind_ups[kind] = moving.wind_up_after(starts[static], time, torque).angle
        return wind_ups


class SecantEffect:
    """Derivatives of the tool's pose by log factors along one measured run, by simulation.

    Args:
        fmus: FMUs of the robot of the file, to run side by side.
        run: The measured run.
        effect: The gears' equation, for parameters without significant effect.
        change: Changes of the log factors for differences [1], (P,), or of each.

    Attributes:
        shown: Numbers of the parameters with a significant effect.
    """

    def __init__(
        self,
        fmus: Sequence[RobotFmu],
        run: MeasuredPath,
        effect: ParameterEffect,
        change: np.ndarray | float,
    ) -> None:
        self._fmus, self._effect, self._run = fmus, effect, run
        prior = prior_of(effect.parameters)
        self._change = np.broadcast_to(change, len(prior))
        # What is left to the equation is left as it is for the parameters of the file.
        self._plain = effect(np.zeros(len(prior)), run.measured.time)
        motion = self._plain - self._plain.mean(axis=0)
        shifts, turns = (
            prior * np.sqrt(np.mean(np.sum(part**2, axis=1), axis=0))
            for part in (motion[:, :3], motion[:, 3:6])
        )
        turns_significantly = turns > _NEGLIGIBLE_TURN if run.tool_rotation is not None else False
        vibrates = np.array([parameter.vibrates for parameter in effect.parameters])
        in_motors = np.zeros(len(prior), dtype=bool)
        if run.measured.motors is not None:
            by_motors = prior * np.sqrt(np.mean(motion[:, 6:] ** 2, axis=0))
            least = _NEGLIGIBLE_PART * run.measured.motors.deviation[:, None]
            in_motors = (by_motors > least).any(axis=0)
        self.shown = np.flatnonzero(
            (shifts > _NEGLIGIBLE) | turns_significantly | vibrates | in_motors
        )

    def __call__(self, x: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Return what log factors do to tool and motors, as the gears' equation does, (n, 6 + c, P).

        Args:
            x: Log factors around which [1], (P,).
            time: Times of the measurement, but for its clock [s], (n,).
        """
        columns = self._plain.copy()
        # Towards what was known before, where the robot is better known.
        change = np.where(x > 0.0, -self._change, self._change)
        here, *aside = self._poses([x, *(x + np.diag(change)[self.shown])], time)
        for k, there in zip(self.shown, aside, strict=True):
            columns[:, :, k] = (there - here) / change[k]
        return columns

    def _poses(self, points: Sequence[np.ndarray], time: np.ndarray) -> list[np.ndarray]:
        """Return how the tool stands, and what motors do, for several log factors."""

        def pose(fmu: RobotFmu, x: np.ndarray) -> np.ndarray:
            return self._run.simulated(fmu, self._effect.robot(x)).pose(time)

        return in_parallel(self._fmus, points, pose)


def in_parallel(
    fmus: Sequence[RobotFmu],
    points: Sequence[np.ndarray],
    work: Callable[[RobotFmu, np.ndarray], T],
) -> list[T]:
    """Return what work makes of every point, in their order.

    Args:
        fmus: FMUs of one robot; none is asked for two things at a time.
        points: Log factors, or steps of them [1], (P,).
        work: Function of an FMU and a point.
    """
    count = len(fmus)

    def share(number: int) -> list[T]:
        return [work(fmus[number], point) for point in points[number::count]]

    with ThreadPoolExecutor(count) as pool:
        shares = list(pool.map(share, range(count)))
    return [shares[k % count][k // count] for k in range(len(points))]


def moved_by_load(drive: Drive, time: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """Return how a motor's angle follows a torque df that its friction has more [rad], (n,).

    The friction's element turns with the motor nearly as it does without the change, and its torque is a
    load of the servo's loop:

        (J p^3 + (Kp + b) p^2 + (Kp Kv + Ki) p + Ki Kv) dq = -p df,    p = d/dt.

    Args:
        time: Even times [s], (n,).
        torque: df [N m], (n,).

    Example:
        >>> drive = Drive(inertia=1.0, position_gain=20.0, rate_gain=100.0)
        >>> time = np.arange(0.0, 2.0, 1e-3)
        >>> moved = moved_by_load(drive, time, np.full(len(time), 40.0))
        >>> round(float(moved[-1]), 6)  # -df / (Kp Kv) without an integral
        -0.02
    """
    from scipy.signal import cont2discrete, lfilter

    kp, ki, kv = drive.rate_gain, drive.integral_gain, drive.position_gain
    loop = [drive.inertia, kp + drive.viscous, kp * kv + ki, ki * kv]
    # Without an integral both sides have a factor p.
    by = ([-1.0], loop[:3]) if ki == 0.0 else ([-1.0, 0.0], loop)
    numerator, denominator, _ = cont2discrete(by, float(time[1] - time[0]), "foh")
    response: np.ndarray = lfilter(np.ravel(numerator), denominator, torque)
    return response


def _friction(drive: Drive, angle: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Return a motor's friction without what grows with the load [N m], (n,)."""
    part = presliding(angle, drive.slip_angle)
    torque: np.ndarray = drive.friction_torque(drive.friction, part, rate, np.zeros(1))
    return torque
