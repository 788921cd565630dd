"""Loads on the tool: a wrench, a spring between the TCP and an anchor, a contact that lifts off."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from elastic_robot.errors import ParameterError
from elastic_robot.plane_contact import NO_CONTACT, PlaneContact

# Rounding of a stiffness that was computed, over its largest eigenvalue.
_ROUNDING = 1e-9
# Derivatives of a symmetric matrix by its entries xx xy xz yy yz zz, (6, 3, 3).
_ENTRIES = np.zeros((6, 3, 3))
for _k, (_i, _j) in enumerate(zip(*np.triu_indices(3), strict=True)):
    _ENTRIES[_k, _i, _j] = _ENTRIES[_k, _j, _i] = 1.0


def symmetric(entries: np.ndarray) -> np.ndarray:
    """Return symmetric matrices (..., 3, 3) from their entries xx xy xz yy yz zz, (..., 6).

    Example:
        >>> symmetric(np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))
        array([[1., 2., 3.],
               [2., 4., 5.],
               [3., 5., 6.]])
    """
    return np.tensordot(entries, _ENTRIES, 1)


@dataclass(frozen=True)
class ContactSpring:
    """A spring at the TCP over a step: it pulls the TCP to an anchor that moves evenly.

    Its force on the robot is K (a - p), with p the position of the TCP; it has no moment.

    Attributes:
        position: Anchor a at the step's start [m], base axes, (3,).
        velocity: Velocity of the anchor [m/s], base axes, (3,).
        stiffness: K [N/m], symmetric, no eigenvalue below zero, base axes, (3, 3).

    Raises:
        ParameterError: If the stiffness is not such a matrix.

    Example:
        >>> wall = ContactSpring(np.array([1.2, 0, 0.5]), np.zeros(3), np.diag([0, 0, 1e6]))
        >>> Load(np.zeros(6), wall).at(0.0).total(np.array([1.0, 0.0, 0.499]))
        array([   0.,    0., 1000.,    0.,    0.,    0.])
    """

    position: np.ndarray
    velocity: np.ndarray
    stiffness: np.ndarray

    def __post_init__(self) -> None:
        """Refuse a stiffness that is not one."""
        k = self.stiffness
        if np.shape(k) != (3, 3) or not np.isfinite(k).all():
            raise ParameterError(
                "stiffness of the contact spring: expected 3x3 finite numbers, got"
                f" {np.asarray(k).tolist()} N/m"
            )
        largest = np.abs(k).max()
        if np.abs(k - k.T).max() > _ROUNDING * largest:
            raise ParameterError(
                "stiffness of the contact spring: expected a symmetric matrix, got"
                f" {k.tolist()} N/m: take the mean of it and its transpose"
            )
        if largest == 0.0:
            return
        # Scaled, since a product of three huge entries would overflow.
        values = largest * np.linalg.eigvalsh(k / largest)
        if values[0] < -_ROUNDING * np.abs(values).max():
            raise ParameterError(
                "stiffness of the contact spring (anchor.kxx to anchor.kzz): expected no eigenvalue"
                f" below 0, got {', '.join(f'{value:.6g}' for value in values)} N/m: a contact pushes"
                " back in every direction, so leave out what does not"
            )


# The rate of a wrench that is held.
NO_RATE = np.zeros(6)
NO_SPRING = ContactSpring(np.zeros(3), np.zeros(3), np.zeros((3, 3)))


@dataclass(frozen=True)
class ToolLoad:
    """Loads on the tool at one instant, or at k of them.

    Attributes:
        wrench: Wrench on the robot at the TCP, base axes [N, N m], (6,) or (k, 6).
        anchor: Anchor of the spring [m], base axes, (3,) or (k, 3).
        stiffness: Stiffness K of the spring [N/m], (3, 3).
        contact: Contact with a plane through the anchor.
        velocity: Velocity of the anchor [m/s], which the contact feels, base axes, (3,).
    """

    wrench: np.ndarray = field(default_factory=lambda: np.zeros(6))
    anchor: np.ndarray = field(default_factory=lambda: NO_SPRING.position)
    stiffness: np.ndarray = field(default_factory=lambda: NO_SPRING.stiffness)
    contact: PlaneContact = NO_CONTACT
    velocity: np.ndarray = field(default_factory=lambda: NO_SPRING.velocity)

    @cached_property
    def is_sprung(self) -> bool:
        """Whether a spring or a contact answers to where the TCP is."""
        return self.contact.holds or self.has_spring

    @cached_property
    def acts(self) -> bool:
        """Whether anything acts."""
        return self.is_sprung or bool(self.wrench.any())

    @cached_property
    def has_spring(self) -> bool:
        """Whether there is a spring."""
        return self.stiffness is not NO_SPRING.stiffness and bool(self.stiffness.any())

    @cached_property
    def resting(self) -> ToolLoad:
        """The same where the TCP rests on the plane."""
        if not self.contact.holds:
            return self
        return replace(self, velocity=NO_SPRING.velocity)

    def total(self, position: np.ndarray) -> np.ndarray:
        """Return the wrench with the spring's force.

        Args:
            position: Position of the TCP [m], base axes, (3,) or (k, 3).

        Returns:
            (6,) or (k, 6) [N, N m].
        """
        if not self.is_sprung:
            return self.wrench
        stretch = self.anchor - position
        whole = np.empty((*stretch.shape[:-1], 6))
        whole[...] = self.wrench
        whole[..., :3] += stretch @ self.stiffness
        return whole

    def at_rest(self, position: np.ndarray) -> np.ndarray:
        """Return the wrench with the forces of the spring and of the contact at rest, (6,) [N, N m]."""
        whole = self.total(position)
        if self.contact.holds:
            whole[:3] += self.contact.force(self.anchor - position, np.zeros(3))
        return whole

    def support(self, position: np.ndarray) -> np.ndarray:
        """Return the stiffness of the spring and of the contact at rest [N/m], (3, 3)."""
        if not self.contact.holds:
            return self.stiffness
        return self.stiffness - self.contact.force_gradient(self.anchor - position, np.zeros(3))[0]

    def force_by_stiffness(self, position: np.ndarray) -> np.ndarray:
        """Return the spring's force by the entries xx xy xz yy yz zz of K [m], (3, 6) or (k, 3, 6)."""
        by_entry: np.ndarray = np.tensordot(self.anchor - position, _ENTRIES, (-1, -1))
        return by_entry.swapaxes(-1, -2)


@dataclass(frozen=True)
class Load:
    """Loads on the tool over a step.

    Attributes:
        wrench: Wrench on the robot at the TCP at the step's start, base axes [N, N m], (6,).
        spring: Contact spring at the TCP; of no stiffness where there is none.
        rate: Rate of the wrench [N/s, N m/s], (6,).
        contact: Contact with a plane through the spring's anchor, at the TCP as well.

    Example:
        >>> growing = Load(rate=np.array([0.0, 0.0, -1e4, 0.0, 0.0, 0.0]))
        >>> float(growing.at(0.02).wrench[2])
        -200.0
    """

    wrench: np.ndarray = field(default_factory=lambda: np.zeros(6))
    spring: ContactSpring = NO_SPRING
    rate: np.ndarray = field(default_factory=lambda: NO_RATE)
    contact: PlaneContact = NO_CONTACT

    @cached_property
    def _steady(self) -> ToolLoad | None:
        """What acts at all times, if neither the wrench nor the anchor changes."""
        if self.rate.any() or self.spring.velocity.any():
            return None
        spring = self.spring
        return ToolLoad(
            self.wrench, spring.position, spring.stiffness, self.contact, spring.velocity
        )

    def at(self, seconds: float | np.ndarray) -> ToolLoad:
        """Return the loads at a time from the step's start [s], or at k of them, (k,)."""
        if self._steady is not None:
            return self._steady
        spring = self.spring
        return ToolLoad(
            self.wrench + np.multiply.outer(seconds, self.rate),
            spring.position + np.multiply.outer(seconds, spring.velocity),
            spring.stiffness,
            self.contact,
            spring.velocity,
        )
