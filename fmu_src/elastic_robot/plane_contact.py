"""Contact of a sphere at the TCP with a plane that only pushes: it lifts off.

With the penetration d = R - n . (p - a) of a sphere of radius R about the TCP p, and its rate d', there
act at the sphere's lowest point, where d > 0,

    N = k d max(0, 1 + c d') along n,    -mu N s / sqrt(s . s + v^2) across,

s the velocity across n of that point relative to the plane: Hunt's and Crossley's law with an exponent
of 1 (docs/references.md, Hunt1975), and Coulomb's regularised by the slip speed v.  Both are continuous
where the contact begins and ends.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from elastic_robot.errors import ParameterError

# Slip speed to begin with [m/s]: well below the speed of tools that slide.
SLIP_SPEED = 1e-3


@dataclass(frozen=True)
class PlaneContact:
    """The law of a contact; the plane goes through the anchor of the load and moves with it.

    Attributes:
        stiffness: k [N/m], >= 0; 0: there is no contact.
        dissipation: c [s/m], >= 0: at a force F the contact damps with c F [N s/m].
        radius: R [m], >= 0.
        friction: Coefficient mu, >= 0.
        slip_speed: v [m/s], > 0 where there is friction, which is mu N / sqrt(2) where
            the slip has this speed.
        normal: Direction out of the plane to the robot's side, any length, base axes, (3,).

    Raises:
        ParameterError: If one of the numbers is out of its range.

    Example:
        >>> floor = PlaneContact(stiffness=1e6, friction=0.3)
        >>> slow = np.array([0.5, 0.0, 0.0])
        >>> floor.force(np.array([0.0, 0.0, 1e-4]), slow).round(2)  # the anchor is 0.1 mm above
        array([-30.,   0., 100.])
    """

    stiffness: float = 0.0
    dissipation: float = 0.0
    radius: float = 0.0
    friction: float = 0.0
    slip_speed: float = SLIP_SPEED
    normal: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))

    def __post_init__(self) -> None:
        """Refuse numbers out of their range."""
        for name in ("stiffness", "dissipation", "radius", "friction", "slip_speed"):
            value = getattr(self, name)
            if not 0.0 <= value < np.inf:
                raise ParameterError(f"contact.{name}: expected a number >= 0, got {value}")
        if self.holds and self.friction > 0.0 and self.slip_speed == 0.0:
            raise ParameterError(
                "contact.slip_speed: expected a number > 0 m/s where there is friction, got 0"
            )
        if self.holds and not 0.0 < np.linalg.norm(self.normal) < np.inf:
            raise ParameterError(
                "normal of the contact (contact.nx to contact.nz): expected a vector that is not zero,"
                f" out of the plane to the robot's side, got"
                f" {', '.join(f'{value:.6g}' for value in self.normal)}"
            )

    @classmethod
    def of(cls, numbers: np.ndarray) -> PlaneContact:
        """Return the law with these numbers, in the order of the attributes, (8,)."""
        stiffness, dissipation, radius, friction, slip_speed = numbers[:5].tolist()
        return cls(stiffness, dissipation, radius, friction, slip_speed, numbers[5:])

    @property
    def holds(self) -> bool:
        """Whether there is a contact."""
        return self.stiffness != 0.0

    @cached_property
    def unit(self) -> np.ndarray:
        """Unit vector n of the normal, base axes, (3,)."""
        return self.normal / np.linalg.norm(self.normal)

    @cached_property
    def offset(self) -> np.ndarray:
        """From the TCP to the lowest point of the sphere [m], (3,)."""
        return -self.radius * self.unit

    def depth(self, gap: np.ndarray) -> np.ndarray:
        """Return d [m], (...), of ways from the TCP to the anchor [m], (..., 3)."""
        return self.radius + gap @ self.unit

    def approach(self, velocity: np.ndarray) -> np.ndarray:
        """Return d' [m/s], (...), of velocities relative to the plane [m/s], (..., 3)."""
        return -(velocity @ self.unit)

    def force(self, gap: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Return the force on the sphere [N], (..., 3), none where d <= 0.

        Args:
            gap: Vector from the TCP to the anchor [m], (..., 3).
            velocity: Velocity of the lowest point relative to the plane [m/s], (..., 3).
        """
        slip, size, depth, resisting = self._state(gap, velocity)
        pressure = np.where(depth > 0.0, self.stiffness * depth * resisting, 0.0)
        return pressure[..., None] * (self.unit - self.friction * slip / size)

    def force_gradient(
        self, gap: np.ndarray, velocity: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of `force` by p [N/m] and by the velocity [N s/m], (..., 3, 3) each."""
        slip, size, depth, resisting = self._state(gap, velocity)
        on = depth > 0.0
        pressure = np.where(on, self.stiffness * depth * resisting, 0.0)[..., None, None]
        n, part = self.unit, slip / size
        direction = n - self.friction * part
        by_place = -self.stiffness * np.where(on, resisting, 0.0)[..., None]
        damping = np.where(on & (resisting > 0.0), self.stiffness * depth * self.dissipation, 0.0)
        across = np.eye(3) - np.outer(n, n) - part[..., :, None] * part[..., None, :]
        by_velocity = -damping[..., None, None] * direction[..., :, None] * n
        by_velocity = by_velocity - self.friction * pressure * across / size[..., None]
        return (by_place * direction)[..., :, None] * n, by_velocity

    def _state(self, gap: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, ...]:
        rate = self.approach(velocity)
        slip = velocity + rate[..., None] * self.unit
        size = np.sqrt((slip * slip).sum(axis=-1, keepdims=True) + self.slip_speed**2)
        size = np.where(size > 0.0, size, 1.0)  # without friction any length will do
        # Faster than 1 / c the body springs back more slowly than the tool leaves.
        return slip, size, self.depth(gap), np.maximum(0.0, 1.0 + self.dissipation * rate)


NO_CONTACT = PlaneContact()
