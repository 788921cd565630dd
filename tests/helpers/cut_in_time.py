"""A mill with straight edges in a slot on vibrating supports, integrated by itself.

Runge-Kutta of fourth order on the equation with delays, the past by cubic Hermite polynomials.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class SlotInTime:
    """A slot along x: teeth without edge forces cut from where they are to what is left.

    Attributes:
        teeth, speed, depth: Number, spindle [rad/s], axial depth [m].
        tangential, radial: Cutting coefficients [Pa].
        feed: Speed of the undeflected tool along x [m/s], from time 0 on.
        a, b: Matrices of s' = a s + b F, s = (u, u') along x and y.
    """

    teeth: int
    speed: float
    depth: float
    tangential: float
    radial: float
    feed: float
    a: np.ndarray
    b: np.ndarray

    def motion(self, periods: int, steps: int, nudge: np.ndarray | None = None) -> np.ndarray:
        """Return s at the steps of so many tooth periods, (periods steps + 1, 4)."""
        h = 2.0 * np.pi / (self.teeth * self.speed) / steps
        count = periods * steps
        s, rate = np.zeros((count + 1, 4)), np.zeros((count + 1, 4))
        if nudge is not None:
            s[0] = nudge

        def way(number: int, half: bool) -> np.ndarray:
            """Displacement at a past step, or half a step later, with the feed."""
            if number < 0:
                return s[0, :2]
            u = s[number, :2]
            if half:
                u = 0.5 * (u + s[number + 1, :2])
                u = u + 0.125 * h * (rate[number, :2] - rate[number + 1, :2])
            return u + np.array([self.feed * (number + 0.5 * half) * h, 0.0])

        def force(step: int, number: int, half: bool, u: np.ndarray) -> np.ndarray:
            """Force of the teeth that are in the cut during a step, at its beginning, middle or end."""
            time = (number + 0.5 * half) * h
            now = u + np.array([self.feed * time, 0.0])
            total = np.zeros(2)
            for tooth in range(self.teeth):
                tip = 2.0 * np.pi * tooth / self.teeth
                if (self.speed * (step + 0.5) * h + tip) % (2.0 * np.pi) > np.pi:
                    continue
                phi = self.speed * time + tip
                sin, cos = np.sin(phi), np.cos(phi)
                # What is left lies where the farthest of the passes before has reached.
                chip = min(
                    (now - way(number - back * steps, half)) @ (sin, cos) for back in range(1, 9)
                )
                if chip > 0.0:
                    t, r = self.tangential * chip, self.radial * chip
                    total += self.depth * np.array([-t * cos - r * sin, t * sin - r * cos])
            return total

        for k in range(count):

            def slope(number: int, half: bool, state: np.ndarray, step: int = k) -> np.ndarray:
                return self.a @ state + self.b @ force(step, number, half, state[:2])

            k1 = rate[k] = slope(k, False, s[k])
            k2 = slope(k, True, s[k] + 0.5 * h * k1)
            k3 = slope(k, True, s[k] + 0.5 * h * k2)
            k4 = slope(k + 1, False, s[k] + h * k3)
            s[k + 1] = s[k] + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        return s
