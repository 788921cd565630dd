"""The readable model with what model exchange has beside its outputs: derivatives, event indicators."""

from dataclasses import replace

import numpy as np

from elastic_robot.hysteresis import Hysteresis
from elastic_robot.motion import State
from elastic_robot.robot import ElasticRobot


class ExchangedRobot(ElasticRobot):
    """An elastic robot with the derivatives of its states, by the names of the FMU's blocks."""

    def put(self, state: State, torque: np.ndarray | None = None) -> None:
        """Go on from a state; the inputs are as before but for the motors' torques."""
        self._state = state
        if torque is not None:
            self._inputs = replace(self._inputs, torque=torque)

    def elongation_derivative(self) -> np.ndarray:
        """Return s' [rad/s], (e,); zero in quasi-static mode."""
        return self._hysteresis.rate(self._now().elongation, self._now().v)

    def slip(self) -> np.ndarray:
        """Return how far the elements are from sticking or slipping instead [rad], (e,)."""
        return self._hysteresis.ways(self._now().elongation, self._now().v)

    def deflection_derivative(self) -> np.ndarray:
        """Return x' [rad/s], (m,), as the derivative of `deflection` by time."""
        return self.deflection_rate()

    def rate_derivative(self) -> np.ndarray:
        """Return x'' of the equation of motion [rad/s^2], (m,); zero in quasi-static mode."""
        if self._quasistatic:
            return np.zeros(self.chain.elastic_count)
        return self._operating_point().motion[2]

    def bend(self) -> np.ndarray:
        """Return the distances of gears from the next bends of their curves [rad], (torsions, 2)."""
        ways = self._curve.bend_angles - self._now().x[:, None]
        below = np.where(ways < 0.0, -ways, np.inf).min(axis=1, initial=np.inf)
        above = np.where(ways >= 0.0, ways, np.inf).min(axis=1, initial=np.inf)
        nearest = np.stack([below, above], axis=1)[self.chain.torsions]
        return np.where(np.isfinite(nearest), nearest, 1.0)

    def rotor_angle_derivative(self) -> np.ndarray:
        """Return their rates [rad/s], (motors,)."""
        return self.rotor_rate()

    def rotor_rate_derivative(self) -> np.ndarray:
        """Return their accelerations [rad/s^2], (motors,)."""
        return self._of_motors(self._instant().acceleration)

    def servo_integral_derivative(self) -> np.ndarray:
        """Return the growth of their servos' integrals [N m/s], (motors,)."""
        now = self._instant()
        return self._of_motors(self._motors.growth(now, self._motors.modes(now)))

    def presliding_derivative(self) -> np.ndarray:
        """Return the rates of the elongations of their friction [rad/s], (motors,)."""
        law, elongation, rate = self._friction()
        return self._of_motors(law.rate(elongation, rate)[self.chain.elements.count :])

    def _friction(self) -> tuple[Hysteresis, np.ndarray, np.ndarray]:
        """Return the law of all elements, the motors' behind the gears', elongations and rates."""
        state = self._now()
        elongation = np.append(state.elongation, state.motors.presliding)
        return self._law, elongation, np.append(state.v, state.motors.rate)

    def contact_gap(self) -> np.ndarray:
        """Return the way from the sphere at the TCP to the contact's plane [m], (1,); 1 without one."""
        return -self._contact()[0] if self._inputs.acting.contact.holds else np.ones(1)
