"""Springs between the tools and places that move along with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class ContactSpring:
    """Springs that pull every tool to a place of its own: the force K (anchor - position) at its TCP.

    A place moves straight from row to row; row k of the stiffness acts over the step that ends there.

    Attributes:
        time: Rising [s], (n,).
        anchor: Places, base axes of the first robot [m], (tools, n, 3).
        stiffness: K, symmetric and not negative [N/m], (tools, n, 3, 3).

    Raises:
        ValueError: If sizes do not agree or a value is not finite.

    Example:
        >>> stiffness = np.tile(1e5 * np.eye(3), (1, 2, 1, 1))
        >>> spring = ContactSpring(np.array([0.0, 1.0]), np.zeros((1, 2, 3)), stiffness)
        >>> spring.force(np.array([[[0.0, 0.0, -1e-3]] * 2]))[0, 0].round(9)
        array([  0.,   0., 100.])
    """

    time: np.ndarray
    anchor: np.ndarray
    stiffness: np.ndarray

    def __post_init__(self) -> None:
        tools, n = self.anchor.shape[:2]
        if self.anchor.shape != (tools, n, 3) or self.stiffness.shape != (tools, n, 3, 3):
            raise ValueError(
                "contact spring: expected anchors (tools, n, 3) and stiffnesses (tools, n, 3, 3), got"
                f" shapes {self.anchor.shape} and {self.stiffness.shape}"
            )
        if self.time.shape != (n,) or n < 2 or np.any(np.diff(self.time) <= 0.0):
            raise ValueError(
                f"contact spring: expected {n} rising times, got shape {self.time.shape}"
            )
        if not np.all(np.isfinite(self.anchor)) or not np.all(np.isfinite(self.stiffness)):
            raise ValueError("contact spring: expected finite values, got one that is not finite")

    @classmethod
    def of_tools(cls, springs: Sequence[ContactSpring]) -> ContactSpring:
        """Return the springs of several tools that move at the same time."""
        anchors, stiffnesses = zip(*((s.anchor, s.stiffness) for s in springs), strict=True)
        return cls(springs[0].time, np.concatenate(anchors), np.concatenate(stiffnesses))

    @property
    def tools(self) -> tuple[ContactSpring, ...]:
        """Spring of every tool by itself."""
        pairs = zip(self.anchor, self.stiffness, strict=True)
        return tuple(ContactSpring(self.time, a[None], k[None]) for a, k in pairs)

    def at(self, time: np.ndarray) -> ContactSpring:
        """Return the same springs at other times, rising and within their own [s], (k,)."""
        rows = np.searchsorted(self.time, time, side="left").clip(max=len(self.time) - 1)
        before = np.maximum(rows - 1, 0)
        length = np.where(rows > before, self.time[rows] - self.time[before], 1.0)
        share = np.where(rows > before, (time - self.time[before]) / length, 1.0)[:, None]
        anchor = (1.0 - share) * self.anchor[:, before] + share * self.anchor[:, rows]
        return ContactSpring(time, anchor, self.stiffness[:, rows])

    def force(self, position: np.ndarray) -> np.ndarray:
        """Return the forces [N] on the tools at given positions [m], both (tools, n, 3)."""
        force: np.ndarray = np.einsum("...ij,...j->...i", self.stiffness, self.anchor - position)
        return force

    def moved(self, position: np.ndarray, rotation: Rotation) -> ContactSpring:
        """Return the springs in a frame whose origin and axes are given in the present one."""
        shape, turn = self.anchor.shape, rotation.inv()
        anchor = turn.apply((self.anchor - position).reshape(-1, 3)).reshape(shape)
        matrix = turn.as_matrix()
        return ContactSpring(self.time, anchor, matrix @ self.stiffness @ matrix.T)
