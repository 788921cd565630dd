"""Elements of hysteresis along a piece of a motion in which each of them sticks or slips throughout."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic_robot.hysteresis import REVERSAL_TIME, Hysteresis

# An element sticks until it is this far beyond its slip angle [rad]: rounding of a robot at rest moves
# it less, and so does not have it slip and stick by turns.
_BEYOND = 1e-13


@dataclass(frozen=True)
class SlipPiece:
    """Which elements slip, and where the piece began.

    Attributes:
        hysteresis: Law of the elements.
        slips: Mask of the elements that slip, (e,); the others stick.
        x: Elastic coordinates at the beginning [rad], (m,).
        elongation: Elongations there [rad], (e,).
    """

    hysteresis: Hysteresis
    slips: np.ndarray
    x: np.ndarray
    elongation: np.ndarray

    @classmethod
    def starting(
        cls, hysteresis: Hysteresis, x: np.ndarray, v: np.ndarray, elongation: np.ndarray
    ) -> SlipPiece:
        """Return the piece that begins at x, x' [rad, rad/s], (m,), and s [rad], (e,).

        At rest all elements stick.
        """
        of = hysteresis.elements
        slips = (elongation * v[of.coordinate] > 0.0) & (np.abs(elongation) >= of.slip_angle)
        return cls(hysteresis, slips, x, elongation)

    def elongation_at(self, x: np.ndarray) -> np.ndarray:
        """Return s [rad], (e,), at elastic coordinates x [rad], (m,)."""
        change = (x - self.x)[self.hysteresis.elements.coordinate]
        return self.elongation + np.where(self.slips, 0.0, change)

    def ways(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return how far each element is from the end of the piece [rad], (e,).

        A sticking one ends it at its slip angle, one that slips where its gear reverses; one without
        torque does not end it, and is clipped to its slip angle where the motion ends.
        """
        of, elongation = self.hysteresis.elements, self.elongation_at(x)
        reversal = np.sign(elongation) * v[of.coordinate] * REVERSAL_TIME
        ways = np.where(self.slips, reversal, of.slip_angle + _BEYOND - np.abs(elongation))
        return np.where(self.hysteresis.stiffness > 0.0, ways, np.inf)

    def after(self, x: np.ndarray, v: np.ndarray) -> SlipPiece:
        """Return what follows where an element ended this piece, at x, x' [rad, rad/s], (m,)."""
        of, elongation, ways = self.hysteresis.elements, self.elongation_at(x), self.ways(x, v)
        changed = ways <= max(ways.min(), 0.0)
        elongation = np.where(changed, np.copysign(of.slip_angle, elongation), elongation)
        outwards = elongation * v[of.coordinate] > 0.0
        return SlipPiece(
            self.hysteresis, np.where(changed, ~self.slips & outwards, self.slips), x, elongation
        )

    def end(self, x: np.ndarray) -> np.ndarray:
        """Return s [rad], (e,), within the slip angles, at the x [rad], (m,), where a motion ends."""
        limit = self.hysteresis.elements.slip_angle
        return np.clip(self.elongation_at(x), -limit, limit)
