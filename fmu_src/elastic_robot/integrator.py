"""Time stepper for second-order equations with piecewise smooth forces; it knows no robot.

Four-stage Gauss collocation in the accelerations, simplified Newton iteration, step length from
an estimate of the local error.  Each coordinate obeys one smooth law (its region) through a whole
step; where the collocation polynomial leaves a region the step is ended there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import sqrt

import numpy as np

from elastic_robot import gauss
from elastic_robot.collocation import Collocation, State, Step, System
from elastic_robot.crossings import CONTACT_SLACK, DEPTH, Boundaries, Crossing, contact_crossing
from elastic_robot.errors import IntegrationError, ParameterError
from elastic_robot.settings import SETTINGS, Settings
from elastic_robot.step_length import StepLength

Watch = Callable[[State, Step], None]


class _Unsolved(Exception):  # noqa: N818  (a signal within this file)
    """No step forward was found."""


def _given_up(elapsed: float, length: float, what: str) -> IntegrationError:
    return IntegrationError(f"the motion, {elapsed:.3g} s into a step of {length:.6g} s, {what}")


class GaussStepper:
    """Steps a system through time.

    Args:
        tolerance: Limit of the local error estimate, in the coordinates' unit.
        settings: Numbers of the stepper.
        reach: Distance of each coordinate to what it moves [m], (m,); with it a try of a step counts for
            more where the coordinates are fast. None: every try counts for one.
    """

    def __init__(
        self, tolerance: float, settings: Settings = SETTINGS, reach: np.ndarray | None = None
    ) -> None:
        self.tolerance = tolerance
        self._settings = settings
        self._length = StepLength(tolerance, settings)
        self._collocation = Collocation(settings)
        self._boundaries: Boundaries | None = None
        self._reach = np.zeros(1) if reach is None else reach
        self._tries_left, self._tries_made, self._price = 0.0, 0, 1.0

    def start(self, time: float, x: np.ndarray, v: np.ndarray, region: np.ndarray) -> State:
        """Return the state at the beginning of an integration."""
        return State(time, x, v, region, self._settings.first_step)

    def advance(
        self, system: System, state: State, end: float, watch: Watch | None = None
    ) -> State:
        """Integrate to a time.

        Args:
            system: The equations of motion.
            state: State at the start.
            end: Time to end at [s].
            watch: Told of every step taken: the state before it, and the step.

        Raises:
            ParameterError: If the time is too far away.
            IntegrationError: If a coordinate grows beyond all bounds, or the motion needs too short or
                too many steps; the sentence says which, and lacks why.
        """
        settings, start = self._settings, state.time
        length = end - start
        if not length <= settings.most_step:
            raise ParameterError(
                f"step size: expected at most {settings.most_step:g} s at a time, got {length:.9g} s"
            )
        self._tries_left, self._tries_made = self._length.most_tries(length), 0
        # What is left after a crossing just before the end may be less than any step.
        state = self._touched(system, state)
        negligible = max(self._length.shortest, 8.0 * float(np.spacing(abs(end))))
        while end - state.time > negligible:
            velocity = self._reach * state.v
            speed = sqrt(velocity.dot(velocity))
            self._price = max(1.0, speed / settings.usual_speed)
            try:
                after, step = self._step(system, state, end)
            except _Unsolved as cause:
                needs = f"needs steps below {self._length.shortest:.1g} s"
                if self._tries_left < 1.0:
                    needs = f"needs more than {self._tries_made} tries of a step at {speed:.3g} m/s"
                raise _given_up(state.time - start, length, needs) from cause
            if watch is not None:
                watch(state, step)
            state = after
            if not np.abs(state.x).max() <= settings.most_deflection:
                k = int(np.abs(state.x).argmax())
                grown = f"bends deflection[{k + 1}] beyond {settings.most_deflection:.3g} rad"
                raise _given_up(state.time - start, length, grown)
        return state if state.time == end else replace(state, time=end)

    def _step(self, system: System, state: State, end: float) -> tuple[State, Step]:
        """Take one step, at most to `end`; return the state after it and the step."""
        kink = system.next_kink(state.time)
        target = end if end <= kink else kink
        left = target - state.time
        wanted = min(state.step, self._settings.longest_step)
        length = self._length.towards(left, wanted)
        step, crossing = self._solve(system, state, length, left)
        if crossing is not None:
            return self._after_crossing(state, step, crossing), step
        if step.length == left and target == kink:
            self._tries_left += self._settings.tries_per_sample
        after = State(
            target if step.length == left else state.time + step.length,
            step.end[0],
            step.end[1],
            state.region,
            self._length.following(step, wanted if step.length == length else step.length),
            step.rows[2:],
            step.length,
            step.newton,
            state.touching,
        )
        return after, step

    def _touched(self, system: System, state: State) -> State:
        """Return the state with the contact as it is: what moved the plane since may have changed it."""
        before, after, miss = state.touching, 0, self._settings.landing * CONTACT_SLACK
        if system.contacting:
            depth = system.depths(np.array([state.time]), state.x[None], state.v[None])[0][0]
            least = {1: -miss, 0: CONTACT_SLACK + miss, -1: 0.0}[before]
            after = int(depth > least)
        if before == after:
            return state
        if before < 0:
            return replace(state, touching=after)
        step = min(self._settings.first_step, state.step)
        return replace(state, touching=after, step=step, newton=None)

    @staticmethod
    def _depths(system: System, state: State, step: Step) -> np.ndarray:
        """Return the depths of the contact at the start, the nodes and the end of a step [m]."""
        h, a = step.length, step.rows[2:]
        x = state.x + h * gauss.NODES[:, None] * state.v + h * h * gauss.A2 @ a
        v = state.v + h * gauss.A1 @ a
        times = state.time + h * np.concatenate([[0.0], gauss.NODES, [1.0]])
        return system.depths(
            times, np.vstack([state.x, x, step.end[0]]), np.vstack([state.v, v, step.end[1]])
        )[0]

    def _solve(
        self, system: System, state: State, h: float, left: float
    ) -> tuple[Step, Crossing | None]:
        """Return a step of length h [s], or a shorter one that can be solved and is accurate.

        If it leaves a region it ends there, and that crossing is returned with it; `left` is the
        time to its target [s], which may be nearer than any step is short.
        """
        boundaries = self._boundaries_of(system, state)
        guess = self._guess(state, h)
        while h >= self._length.shortest or h == left:
            accuracy = self._settings.iteration * self.tolerance
            step = self._try(system, state, h, guess, accuracy)
            if step is None:
                h = self._settings.cut_after_failure * h
                guess = self._guess(state, h)
                continue
            crossing = boundaries.first_crossing(step.rows, h)
            allowed = boundaries.landing
            if system.contacting:
                depths = self._depths(system, state, step)
                contact = contact_crossing(state.touching == 1, depths)
                if contact is not None and (
                    crossing is None or contact.fraction < crossing.fraction
                ):
                    crossing, allowed = contact, self._settings.landing * CONTACT_SLACK
            if crossing is not None:
                landed = self._land(system, state, step, crossing, allowed)
                if landed is not None and landed.error <= self.tolerance:
                    return landed, crossing
                shorter = 0.5 * crossing.fraction * h
            elif step.error <= self.tolerance:
                return step, None
            else:
                shorter = self._length.shorter(step)
            guess = gauss.interpolation(0.0, shorter / h) @ step.rows[2:]
            h = shorter
        raise _Unsolved

    def _try(
        self, system: System, state: State, h: float, guess: np.ndarray, accuracy: float
    ) -> Step | None:
        """Solve a step as one of the tries that are left."""
        if self._tries_left < 1.0:
            raise _Unsolved
        self._tries_left -= self._price
        self._tries_made += 1
        return self._collocation.solve(system, state, h, guess, accuracy)

    def _land(
        self, system: System, state: State, step: Step, crossing: Crossing, allowed: float
    ) -> Step | None:
        """Shorten the step until it ends on the boundary; None if that does not succeed."""
        h, k, start = crossing.fraction * step.length, crossing.coordinate, state
        accuracy = self._settings.landing_iteration * allowed
        for _ in range(self._settings.most_landings):
            guess = gauss.interpolation(0.0, h / step.length) @ step.rows[2:]
            landed = self._try(system, state, h, guess, accuracy)
            if landed is None:
                return None
            place, rate = landed.end[:2, k]
            if k == DEPTH:
                ends = np.array([start.time + landed.length]), landed.end[:1], landed.end[1:2]
                place, rate = (values[0] for values in system.depths(*ends))
            beyond = crossing.outward * (place - crossing.boundary)
            rate = crossing.outward * rate
            if abs(beyond) <= allowed:
                return landed
            if rate <= 0.0:
                return None
            step, state = landed, replace(state, newton=landed.newton)
            h -= float(np.clip(beyond / rate, -h, 0.5 * h))
        return None

    def _after_crossing(self, state: State, step: Step, crossing: Crossing) -> State:
        region, touching = state.region, state.touching
        if crossing.coordinate == DEPTH:
            touching = crossing.region
        else:
            region = region.copy()
            region[crossing.coordinate] = crossing.region
        return State(
            state.time + step.length,
            step.end[0],
            step.end[1],
            region,
            min(self._settings.first_step, state.step),
            # The acceleration is continuous across the boundary, its derivative is not.
            np.repeat(step.end[2:], gauss.STAGES, axis=0),
            step.length,
            touching=touching,
        )

    def _boundaries_of(self, system: System, state: State) -> Boundaries:
        known = self._boundaries
        if (
            known is None
            or known.region is not state.region
            or known.half_width is not system.half_width
        ):
            known = Boundaries(system.half_width, state.region, self.tolerance, self._settings)
            self._boundaries = known
        return known

    def _guess(self, state: State, h: float) -> np.ndarray:
        """Return stage accelerations to start from: the last step's polynomial, continued."""
        if state.predictor is None:
            return np.zeros((gauss.STAGES, len(state.x)))
        return gauss.interpolation(1.0, h / state.predictor_step).dot(state.predictor)
