"""The robot in motion under its drives and a load: its equations, integrated by SciPy.

    M theta'' + h - J^T w + S(x) + H(s) + d x' = 0        rows of x

is solved for x'' at every instant, beside the equations of motors that move by themselves
(`motors.py`), and handed to `solve_ivp` (DOP853, order 8).  A piece ends where the drives' third
derivative jumps, where a gear reaches an edge of its backlash, where a contact is touched or left, where
an element of hysteresis or a motor's friction begins or ends to slip, and where a servo reaches or
leaves its torque limit, so that what is integrated is smooth.  The native core has an integrator of its
own (docs/model.md): the two share the equations, not their solution.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import OptimizeResult

from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import IntegrationError, ParameterError
from elastic_robot.hysteresis import Hysteresis
from elastic_robot.motors import NO_INSTANT, NO_MOTORS, MotorInstant, Motors, MotorState
from elastic_robot.residual import free_acceleration
from elastic_robot.settings import SETTINGS
from elastic_robot.slipping import SlipPiece
from elastic_robot.tool_load import Load, ToolLoad
from elastic_robot.torque_curves import TorqueCurve
from elastic_robot.trajectory import Drives

# Part of the local error allowed that DOP853 has to keep, for it is to judge other integrators; the
# least that doubles can [rad], and the deflection [rad] that its relative tolerance refers to.
_ACCURACY, _LEAST, _USUAL_DEFLECTION = 1e-2, 1e-13, 1e-3
# First step [s], as long as an oscillation of 200 Hz allows: it costs less to fail than to be found.
# And the most steps that are taken before a motion is given up: these, and those for each second in it.
_FIRST_STEP, _MOST_STEPS, _STEPS_PER_SECOND = 1.2e-3, 500, 1500
# Longest step [s] where there is an edge, which is looked for at the ends of steps: a touch that lasts
# longer is seen.
_LONGEST_STEP = 4e-3
# On which side of an edge a state is, it is asked so much later [s]: on an edge rounding decides.
_LATER = 1e-9
_EVALUATIONS = 12  # of x'' in a step of DOP853
_Event = Callable[[float, np.ndarray], float]


@dataclass(frozen=True)
class State:
    """Elastic coordinates and motors at a time.

    Attributes:
        time: Time [s].
        x, v: Elastic coordinates and their rates [rad, rad/s], (m,).
        elongation: Elongations s of the elements of hysteresis [rad], (e,).
        motors: The motors that move by themselves.
    """

    time: float
    x: np.ndarray
    v: np.ndarray
    elongation: np.ndarray
    motors: MotorState = NO_MOTORS


@dataclass(frozen=True)
class _Instant:
    """What acts on the elastic coordinates at an instant, and what the motors do.

    Attributes:
        drives: Motion of the drives at their gears' outputs [rad, rad/s, rad/s^2], (3, n).
        acting: Loads on the tool.
        gear_torque: S + H + d x' [N m], (m,).
        motors: The motors that move by themselves.
    """

    drives: np.ndarray
    acting: ToolLoad
    gear_torque: np.ndarray
    motors: MotorInstant


def _turn(place: int) -> _Event:
    """Return the event function of the zeros of one rate, at a place of what is integrated."""
    return lambda _, y: float(y[place])


def _fall(ways: Callable[[float, bytes], np.ndarray], k: int) -> _Event:
    """Return the event function of one of some ways that falls through zero, which ends a piece."""

    def way(time: float, y: np.ndarray) -> float:
        return float(ways(float(time), y.tobytes())[k])

    way.terminal, way.direction = True, -1.0  # type: ignore[attr-defined]
    return way


def _overshot(
    solved: OptimizeResult, turns: range, ways: Callable[[np.ndarray], np.ndarray]
) -> float | None:
    """Return when a gear or motor first turns with an element beyond its slip angle; None if none does.

    `solve_ivp` sees only what lasts to a step's end.

    Args:
        turns: Places of the zeros of rates among its events.
        ways: How far the elements are from the end of their piece [rad], (e,).
    """
    times = [
        float(time)
        for k in turns
        for time, y in zip(solved.t_events[k], solved.y_events[k], strict=True)
        if ways(y).min() < 0.0
    ]
    return min(times, default=None)


class DrivenMotion:
    """The equations of motion along given commands.

    Args:
        dynamics: Forces of the robot.
        curve: Torque curve S.
        damping: d [N m s/rad], (m,).
        law: Law of the elements of the gears, then of the motors' friction.
        motors: The motors that move by themselves.
        local_error: Error of x allowed in a step [rad].
    """

    def __init__(
        self,
        dynamics: Dynamics,
        curve: TorqueCurve,
        damping: np.ndarray,
        law: Hysteresis,
        motors: Motors,
        local_error: float,
    ) -> None:
        self._dynamics, self._curve, self._damping = dynamics, curve, damping
        self._law, self._motors, self._local_error = law, motors, local_error
        self._m, self._e = len(damping), dynamics.chain.elements.count

    def advance(
        self, state: State, end: float, drives: Drives, load: Load, torque: np.ndarray
    ) -> State:
        """Integrate to a time.

        Args:
            state: State at the start.
            end: Time to end at [s].
            drives: Commanded motion of the drives.
            load: Loads on the tool from the start on.
            torque: Torques of motors without servo [N m], (d,).

        Raises:
            ParameterError: If the time is too far away.
            IntegrationError: If a coordinate grows beyond all bounds, or the motion needs too short or
                too many steps; the sentence says which, and lacks why.
        """
        start, length = state.time, end - state.time
        if not length <= SETTINGS.most_step:
            raise ParameterError(
                f"step size: expected at most {SETTINGS.most_step:g} s at a time, got {length:.9g} s"
            )
        elements = self._law.elements.count if self._law.acts else 0
        steps = (1 + elements) * (_MOST_STEPS + _STEPS_PER_SECOND * length)
        remaining, most = int(_EVALUATIONS * steps), SETTINGS.most_deflection

        def given_up(time: float, what: str) -> IntegrationError:
            return IntegrationError(
                f"the motion, {time - start:.3g} s into a step of {length:.6g} s, {what}"
            )

        def instant(time: float, y: np.ndarray) -> _Instant:
            commands = drives.at(np.array([time]))[:, 0]
            return self._instant(y, state, slipping, commands, load.at(time - start), torque)

        def rate(time: float, y: np.ndarray) -> np.ndarray:
            nonlocal remaining
            remaining -= 1
            if remaining < 0:
                raise given_up(time, f"needs more than {steps:.0f} steps")
            now, (coordinates, rates, _) = instant(time, y), self._split(y)
            x, v = coordinates[: self._m], rates[: self._m]
            of_x = free_acceleration(self._dynamics, now.drives, x, v, now.acting, now.gear_torque)
            if not self._motors.drives:
                return np.concatenate([v, of_x])
            growth = self._motors.growth(now.motors, modes)
            return np.concatenate([rates, of_x, now.motors.acceleration, growth])

        def bends(_: float, y: np.ndarray) -> float:
            return most - float(np.abs(y[: self._m]).max())

        def ways(y: np.ndarray) -> np.ndarray:
            return slipping.ways(*self._split(y)[:2])

        def slips(_: float, y: np.ndarray) -> float:
            return float(ways(y).min())

        def solve(
            piece: tuple[float, float], y: np.ndarray, events: list[_Event]
        ) -> OptimizeResult:
            return solve_ivp(
                rate,
                piece,
                y,
                "DOP853",
                rtol=accuracy / _USUAL_DEFLECTION,
                atol=accuracy * self._sizes(),
                first_step=min(piece[1] - piece[0], _FIRST_STEP),
                max_step=_LONGEST_STEP if edges else np.inf,
                events=events,
            )

        bends.terminal = slips.terminal = True  # type: ignore[attr-defined]
        slips.direction = -1.0  # type: ignore[attr-defined]
        accuracy = max(_ACCURACY * self._local_error, _LEAST)
        jump, time = SETTINGS.jump(self._local_error), start
        resting: set[int] = set()
        y = self._join_state(state)
        coordinates, rates, _ = self._split(y)
        turns = [_turn(len(coordinates) + k) for k in self._law.elements.gears]
        of_elements: list[_Event] = [slips, *turns] if elements else []
        elongation = np.append(state.elongation, state.motors.presliding)
        slipping = SlipPiece.starting(self._law, coordinates, rates, elongation)
        while end - time > max(1e-11, 8.0 * float(np.spacing(abs(end)))):
            piece = (time, min(end, drives.next_kink(time, jump)))
            modes = self._motors.modes(instant(time, y).motors)
            edges = dict(enumerate(self._edges(time, y, instant, modes)))
            watched = [k for k in edges if k not in resting]
            events = [bends, *of_elements, *(edges[k] for k in watched)]
            solved = solve(piece, y, events)
            overshot = _overshot(solved, range(2, 1 + len(of_elements)), ways)
            if overshot is not None:
                solved = solve((time, overshot), y, events)
            time, y = float(solved.t[-1]), solved.y[:, -1]
            if solved.status < 0:
                raise given_up(time, f"needs steps below {10.0 * np.spacing(time):.1g} s")
            if not bends(time, y) > 1e-9:
                most_bent = np.abs(y[: self._m]).argmax()
                raise given_up(time, f"bends deflection[{most_bent + 1}] beyond {most:.3g} rad")
            changes = elements > 0 and len(solved.t_events[1]) > 0
            if changes:
                slipping = slipping.after(*self._split(y)[:2])
            # Who grazes an edge, or rests on it, is not asked again where it stands.
            fell = zip(watched, solved.t_events[1 + len(of_elements) :], strict=True)
            at_once = not changes and time - piece[0] <= _LATER
            resting = resting | {k for k, times in fell if len(times)} if at_once else set()
        return self._state(end, y, state, slipping)

    def _split(self, y: np.ndarray) -> list[np.ndarray]:
        """Return x with the ways of the motors, their rates, and z, of what is integrated."""
        count = self._m + len(self._motors.drives)
        return [y[:count], y[count : 2 * count], y[2 * count :]]

    def _join_state(self, state: State) -> np.ndarray:
        """Return what is integrated; motors' angles count from the start, as doubles have digits."""
        motors = state.motors
        parts = state.x, 0.0 * motors.angle, state.v, motors.rate, motors.integral
        return np.concatenate(parts)

    def _sizes(self) -> np.ndarray:
        """Return what of each part of it is as much as 1 rad of x."""
        count = 2 * (self._m + len(self._motors.drives))
        return np.append(np.ones(count), self._motors.stiffness)

    def _state(self, time: float, y: np.ndarray, start: State, slipping: SlipPiece) -> State:
        (x, way), (v, rate) = (np.split(part, [self._m]) for part in self._split(y)[:2])
        elongation, presliding = np.split(slipping.end(self._split(y)[0]), [self._e])
        motors = MotorState(start.motors.angle + way, rate, self._split(y)[2], presliding)
        return State(time, x, v, elongation, motors)

    def _instant(
        self,
        y: np.ndarray,
        start: State,
        slipping: SlipPiece,
        commands: np.ndarray,
        acting: ToolLoad,
        torque: np.ndarray,
    ) -> _Instant:
        """Return what acts, and what the motors do."""
        coordinates, rates, integral = self._split(y)
        m, errors = self._m, self._dynamics.chain.kinematic_errors
        gear_torque = self._curve.torque(coordinates[:m]) + self._damping * rates[:m]
        if self._law.acts or self._motors.drives:
            elongation = slipping.elongation_at(coordinates)
        if self._law.acts:
            gear_torque = gear_torque + self._law.torque(elongation)[:m]
        if not self._motors.drives:
            return _Instant(errors.at_output(commands), acting, gear_torque, NO_INSTANT)
        angle, rate = start.motors.angle + coordinates[m:], rates[m:]
        motors = MotorState(angle, rate, integral, elongation[self._e :])
        now = self._motors.at(commands, motors, gear_torque, torque)
        motor_motion = self._motors.joined(commands, np.array([angle, rate, now.acceleration]))
        return _Instant(errors.at_output(motor_motion), acting, gear_torque, now)

    def _edges(
        self,
        now: float,
        y: np.ndarray,
        instant: Callable[[float, np.ndarray], _Instant],
        modes: np.ndarray,
    ) -> list[_Event]:
        """Return event functions, one for each edge of backlash, a contact's plane and a torque limit.

        One for all, their least, would miss what falls through zero while another stands there.
        """
        width, begin = self._curve.half_width, instant(now, y)
        gears = np.flatnonzero(np.isfinite(width))
        holds = begin.acting.contact.holds
        limits = bool(self._motors.drives) and (
            len(self._motors.ways(begin.motors, modes, begin.motors)) > 0
        )
        if not (len(gears) or holds or limits):
            return []

        def distances_to_edges(time: float, y: np.ndarray) -> np.ndarray:
            """Return distances of gears from backlash [rad] and of the contact from its plane [m]."""
            ways = np.abs(y[gears]) - width[gears]
            if holds:
                at = instant(time, y)
                motion = np.array([part[: self._m] for part in self._split(y)[:2]])
                theta, rate = self._dynamics.chain.theta(at.drives[:2], motion)
                depth, *_ = self._dynamics.contact_state(theta, rate, at.acting)
                ways = np.append(ways, depth)
            return ways

        later = y.copy()
        later[: self._m] += _LATER * self._split(y)[1][: self._m]
        side = np.sign(distances_to_edges(now + _LATER, later))

        @lru_cache(maxsize=1)  # which every event asks
        def ways(time: float, bytes_of_y: bytes) -> np.ndarray:
            y = np.frombuffer(bytes_of_y)
            ways = side * distances_to_edges(time, y)
            if not limits:
                return ways
            at = self._motors.ways(instant(time, y).motors, modes, begin.motors)
            return np.append(ways, at)

        return [_fall(ways, k) for k in range(len(ways(now, y.tobytes())))]
