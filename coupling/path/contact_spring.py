"""Springs between the tools and places that move along with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coupling.path.frame import Frame


@dataclass(frozen=True)
class ContactSpring:
    """Springs that pull every tool to a place of its own: the force K (anchor - position) at its TCP.

    The rows are at the instants of the wrenches beside which they act.  A place moves straight from row
    to row; row k of the stiffness acts over the step that ends there.  Of a coupling that has converged
    the springs carry nothing.

    Attributes:
        anchor: Places, base axes of the first robot [m], (tools, n, 3).
        stiffness: K, symmetric and not negative [N/m], (tools, n, 3, 3).

    Raises:
        ValueError: If sizes do not agree or a value is not finite.

    Example:
        >>> spring = ContactSpring(np.zeros((1, 2, 3)), np.tile(1e5 * np.eye(3), (1, 2, 1, 1)))
        >>> spring.force(np.array([[[0.0, 0.0, -1e-3]] * 2]))[0, 0].round(9)
        array([  0.,   0., 100.])
    """

    anchor: np.ndarray
    stiffness: np.ndarray

    def __post_init__(self) -> None:
        expected = (*self.anchor.shape, 3)
        if self.anchor.ndim != 3 or expected[2:] != (3, 3) or self.stiffness.shape != expected:
            raise ValueError(
                "contact spring: expected anchors (tools, n, 3) and stiffnesses (tools, n, 3, 3), got"
                f" shapes {self.anchor.shape} and {self.stiffness.shape}"
            )
        if not np.all(np.isfinite(self.anchor)) or not np.all(np.isfinite(self.stiffness)):
            raise ValueError("contact spring: expected finite values, got one that is not finite")

    @classmethod
    def of_tools(cls, springs: Sequence[ContactSpring]) -> ContactSpring:
        """Return the springs of several tools, whose rows are at the same times."""
        anchors, stiffnesses = zip(
            *((spring.anchor, spring.stiffness) for spring in springs), strict=True
        )
        return cls(np.concatenate(anchors), np.concatenate(stiffnesses))

    @property
    def tools(self) -> tuple[ContactSpring, ...]:
        """Spring of every tool by itself."""
        pairs = zip(self.anchor, self.stiffness, strict=True)
        return tuple(ContactSpring(anchor[None], stiffness[None]) for anchor, stiffness in pairs)

    @property
    def entries(self) -> np.ndarray:
        """Entries xx, xy, xz, yy, yz, zz of the stiffnesses [N/m], (tools, n, 6)."""
        entries: np.ndarray = self.stiffness[..., *np.triu_indices(3)]
        return entries

    def force(self, position: np.ndarray) -> np.ndarray:
        """Return the forces [N] on the tools at given positions [m], both (tools, n, 3)."""
        force: np.ndarray = np.einsum("...ij,...j->...i", self.stiffness, self.anchor - position)
        return force

    def transformed(self, frame: Frame) -> ContactSpring:
        """Return the springs in another frame, in which `frame` is the present one."""
        matrix = frame.rotation.as_matrix()
        return ContactSpring(frame.points(self.anchor), matrix @ self.stiffness @ matrix.T)
