"""The robot in motion under prescribed drives and a load: its equation, integrated by SciPy.

    M theta'' + h - J^T w + S(x) + H(s) + d x' = 0        rows of x

is solved for x'' at every instant and handed to `solve_ivp` (DOP853, order 8).  A piece ends where the
drives' third derivative jumps, where a gear reaches an edge of its backlash, where a contact is
touched or left, and where an element of hysteresis begins or ends to slip, so that what is integrated is
smooth.  The native core has an integrator of its own
(docs/model.md): the two share the equation, not its solution.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import OptimizeResult

from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import IntegrationError, ParameterError
from elastic_robot.hysteresis import NO_HYSTERESIS, Hysteresis
from elastic_robot.kinematic_errors import KinematicErrors
from elastic_robot.residual import OperatingPoint, free_acceleration
from elastic_robot.settings import SETTINGS
from elastic_robot.slipping import SlipPiece
from elastic_robot.tool_load import Load
from elastic_robot.torque_curves import TorqueCurve

# Part of the local error allowed that DOP853 has to keep, for it is to judge other integrators; the
# least that doubles can [rad], and the deflection [rad] that its relative tolerance refers to.
_ACCURACY, _LEAST, _USUAL_DEFLECTION = 1e-2, 1e-13, 1e-3
# First step [s], which costs less to fail than to be found; and the most steps that are taken before a
# motion is given up: these, and those for each second in it.
_FIRST_STEP, _MOST_STEPS, _STEPS_PER_SECOND = 4e-3, 500, 1500
# On which side of an edge a state is, it is asked so much later [s]: on an edge rounding decides.
_LATER = 1e-9
_EVALUATIONS = 12  # of x'' in a step of DOP853
_Event = Callable[[float, np.ndarray], float]


class Drives(Protocol):
    """Motion of the drives over time."""

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return q, q', q'' [rad, rad/s, rad/s^2] at times (k,) [s], (3, k, n)."""
        ...

    def next_kink(self, time: float, jump: float) -> float:
        """Return the first time after `time` of a jump of the third derivative.

        Jumps up to `jump` [rad/s^3] do not count; infinity if there is none.
        """
        ...


@dataclass(frozen=True)
class DrivesAtOutput:
    """Motion of drives at the outputs of gears with kinematic errors, as `Drives`.

    Attributes:
        drives: Motion of the motors.
        errors: The kinematic errors, which bend it without a kink of their own.
    """

    drives: Drives
    errors: KinematicErrors

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return u, u', u'' [rad, rad/s, rad/s^2] at times (k,) [s], (3, k, n)."""
        return self.errors.at_output(self.drives.at(times))

    def next_kink(self, time: float, jump: float) -> float:
        """Return the motors' next kink."""
        return self.drives.next_kink(time, jump)


@dataclass(frozen=True)
class State:
    """Elastic coordinates at a time.

    Attributes:
        time: Time [s].
        x, v: Elastic coordinates and their rates [rad, rad/s], (m,).
        elongation: Elongations s of the elements of hysteresis [rad], (e,).
    """

    time: float
    x: np.ndarray
    v: np.ndarray
    elongation: np.ndarray


def _turn(place: int) -> _Event:
    """Return the event function of the zeros of one rate, at a place of (x, v)."""
    return lambda _, y: float(y[place])


def _overshot(solved: OptimizeResult, turns: range, slipping: SlipPiece) -> float | None:
    """Return when a gear first turns with an element beyond its slip angle; None if none does.

    `solve_ivp` sees only what lasts to a step's end.

    Args:
        solved: Its result.
        turns: Places of the zeros of rates among its events.
        slipping: The elements.
    """
    times = [
        float(time)
        for k in turns
        for time, y in zip(solved.t_events[k], solved.y_events[k], strict=True)
        if slipping.ways(*y.reshape(2, -1)).min() < 0.0
    ]
    return min(times, default=None)


class DrivenMotion:
    """The equation of motion along given drives.

    Args:
        dynamics: Forces of the robot.
        curve: Torque curve S.
        damping: d [N m s/rad], (m,).
        hysteresis: Law of the elements of the gears.
        local_error: Error of x allowed in a step [rad].
    """

    def __init__(
        self,
        dynamics: Dynamics,
        curve: TorqueCurve,
        damping: np.ndarray,
        hysteresis: Hysteresis,
        local_error: float,
    ) -> None:
        self._dynamics, self._curve, self._damping = dynamics, curve, damping
        self._hysteresis, self._local_error = hysteresis, local_error

    def advance(self, state: State, end: float, drives: Drives, load: Load) -> State:
        """Integrate to a time.

        Args:
            state: State at the start.
            end: Time to end at [s].
            drives: Motion of the drives at their gears' outputs.
            load: Loads on the tool from the start on.

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
        elements = self._hysteresis.elements.count if self._hysteresis.acts else 0
        steps = (1 + elements) * (_MOST_STEPS + _STEPS_PER_SECOND * length)
        left, most = int(_EVALUATIONS * steps), SETTINGS.most_deflection
        forces = self._dynamics, self._curve, self._damping

        def given_up(time: float, what: str) -> IntegrationError:
            return IntegrationError(
                f"the motion, {time - start:.3g} s into a step of {length:.6g} s, {what}"
            )

        def rate(time: float, y: np.ndarray) -> np.ndarray:
            nonlocal left
            left -= 1
            if left < 0:
                raise given_up(time, f"needs more than {steps:.0f} steps")
            x, v = y.reshape(2, -1)
            point = OperatingPoint(
                drives.at(np.array([time]))[:, 0],
                np.stack([x, v, np.zeros_like(x)]),
                load.at(time - start),
                self._curve.region(x),
                slipping.held(x) if elements else NO_HYSTERESIS,
            )
            return np.append(v, free_acceleration(*forces, point))

        def bends(_: float, y: np.ndarray) -> float:
            return most - float(np.abs(y[: len(state.x)]).max())

        def slips(_: float, y: np.ndarray) -> float:
            return float(slipping.ways(*y.reshape(2, -1)).min())

        def solve(
            piece: tuple[float, float], y: np.ndarray, events: list[_Event]
        ) -> OptimizeResult:
            return solve_ivp(
                rate,
                piece,
                y,
                "DOP853",
                rtol=accuracy / _USUAL_DEFLECTION,
                atol=accuracy,
                first_step=min(piece[1] - piece[0], _FIRST_STEP),
                events=events,
            )

        bends.terminal = slips.terminal = True  # type: ignore[attr-defined]
        slips.direction = -1.0  # type: ignore[attr-defined]
        turns = [_turn(len(state.x) + k) for k in self._hysteresis.elements.gears]
        of_elements: list[_Event] = [slips, *turns] if elements else []
        accuracy = max(_ACCURACY * self._local_error, _LEAST)
        jump, time, watched = SETTINGS.jump(self._local_error), start, True
        y = np.concatenate([state.x, state.v])
        slipping = SlipPiece.starting(self._hysteresis, state.x, state.v, state.elongation)
        while end - time > max(1e-11, 8.0 * float(np.spacing(abs(end)))):
            piece = (time, min(end, drives.next_kink(time, jump)))
            edge = self._edge(time, y, drives, load, start) if watched else None
            events = [bends, *of_elements, *([] if edge is None else [edge])]
            solved = solve(piece, y, events)
            overshot = _overshot(solved, range(2, 1 + len(of_elements)), slipping)
            if overshot is not None:
                solved = solve((time, overshot), y, events)
            time, y = float(solved.t[-1]), solved.y[:, -1]
            if solved.status < 0:
                raise given_up(time, f"needs steps below {10.0 * np.spacing(time):.1g} s")
            if not bends(time, y) > 1e-9:
                most_bent = np.abs(y[: len(state.x)]).argmax()
                raise given_up(time, f"bends deflection[{most_bent + 1}] beyond {most:.3g} rad")
            changes = elements > 0 and len(solved.t_events[1]) > 0
            if changes:
                slipping = slipping.after(*y.reshape(2, -1))
            # Who grazes an edge, or rests on it, is not asked again where it stands.
            watched = changes or time - piece[0] > _LATER
        x, v = y.reshape(2, -1)
        return State(end, x, v, slipping.end(x))

    def _edge(
        self, now: float, y: np.ndarray, drives: Drives, load: Load, start: float
    ) -> _Event | None:
        """Return the event function of edges of backlash and of a contact's plane; None without."""
        width = self._curve.half_width
        gears = np.flatnonzero(np.isfinite(width))
        if not (len(gears) or load.contact.holds):
            return None

        def beyond(time: float, y: np.ndarray) -> np.ndarray:
            """Return distances of gears from backlash [rad] and of the contact from its plane [m]."""
            x, v = y.reshape(2, -1)
            ways = np.abs(x[gears]) - width[gears]
            if load.contact.holds:
                q, qd, _ = drives.at(np.array([time]))[:, 0]
                theta, rate = self._dynamics.chain.theta(np.stack([q, qd]), np.stack([x, v]))
                acting = load.at(time - start)
                depth, _, _ = self._dynamics.contact_state(theta[None], rate[None], acting)
                ways = np.append(ways, depth)
            return ways

        later = y.copy()
        later[: len(y) // 2] += _LATER * y[len(y) // 2 :]
        side = np.sign(beyond(now + _LATER, later))

        def edge(time: float, y: np.ndarray) -> float:
            return float(np.min(side * beyond(time, y)))

        edge.terminal, edge.direction = True, -1.0  # type: ignore[attr-defined]
        return edge
