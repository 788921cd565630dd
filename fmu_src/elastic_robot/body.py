"""Rigid bodies as data: mass, centre of mass and inertia, checked to be those of a mass distribution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic_robot.requirements import Vector, require_number, require_vector

# Negative moments of rounding, and how far identified ones may be from the triangle inequality: makers
# publish 0.7 % for arms of their own, which changes no motion.  Both in parts of the largest moment.
_INERTIA_TOLERANCE, TRIANGLE_TOLERANCE = 1e-6, 0.02


@dataclass(frozen=True)
class Body:
    """Rigid body.

    Attributes:
        mass: Mass [kg], >= 0.
        com: Centre of mass in the body's frame [m], (3,).
        inertia: Inertia about the centre of mass, in the body's axes [kg m^2]: xx, yy, zz or
            xx, yy, zz, xy, xz, yz.

    Raises:
        ValueError: If a value is missing, not finite, or no mass distribution has this inertia.
    """

    mass: float
    com: Vector
    inertia: Vector

    def __post_init__(self) -> None:
        require_number("mass", self.mass, minimum=0.0, open_end=False, unit="kg")
        require_vector("com", self.com, 3, "m")
        if len(self.inertia) not in (3, 6) or not np.all(np.isfinite(self.inertia)):
            raise ValueError(
                "inertia: expected xx, yy, zz or xx, yy, zz, xy, xz, yz [kg m^2], got"
                f" {list(self.inertia)}"
            )
        small, middle, large = np.linalg.eigvalsh(self.inertia_matrix)
        slack, excess = (
            part * max(large, 0.0) for part in (_INERTIA_TOLERANCE, TRIANGLE_TOLERANCE)
        )
        if small < -slack or large > small + middle + excess:
            raise ValueError(
                "inertia: expected principal moments >= 0 of which none exceeds the sum of the others"
                f" by more than {100.0 * TRIANGLE_TOLERANCE:g} %,"
                f" got {small:.6g}, {middle:.6g}, {large:.6g} kg m^2 of {list(self.inertia)}"
            )
        if self.mass == 0.0 and large > 0.0:
            raise ValueError(f"mass: expected > 0 [kg] with inertia {list(self.inertia)}, got 0")

    @classmethod
    def from_matrix(cls, mass: float, com: np.ndarray, matrix: np.ndarray) -> Body:
        """Return the body of a centre of mass [m], (3,), and inertia about it [kg m^2], (3, 3)."""
        six = matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        return cls(float(mass), tuple(com.tolist()), tuple(six.tolist()))

    @property
    def inertia_matrix(self) -> np.ndarray:
        """Inertia tensor about the centre of mass [kg m^2], (3, 3)."""
        xx, yy, zz, xy, xz, yz = (*self.inertia, 0.0, 0.0, 0.0)[:6]
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def scaled(self, factor: float) -> Body:
        """Return the body with its density multiplied by a factor."""
        return Body(self.mass * factor, self.com, tuple(i * factor for i in self.inertia))

    def placed(self, rotation: np.ndarray, position: np.ndarray) -> Body:
        """Return the body in another frame, of which this body's frame has the given placement.

        Args:
            rotation: Rotation from this body's axes to the other frame's, (3, 3).
            position: This body's origin in the other frame [m], (3,).

        Example:
            >>> quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
            >>> rod = Body(mass=1.0, com=(0.5, 0.0, 0.0), inertia=(0.0, 2.0, 2.0))
            >>> rod.placed(quarter, np.array([0.0, 0.0, 1.0])).com
            (0.0, 0.5, 1.0)
        """
        com = rotation @ self.com + position
        return Body.from_matrix(self.mass, com, rotation @ self.inertia_matrix @ rotation.T)


def triangle_excess(body: Body) -> float:
    """Return by what part of itself a body's largest principal moment exceeds the sum of the others.

    Example:
        >>> round(triangle_excess(Body(1.0, (0.0, 0.0, 0.0), (1.0, 1.0, 2.02))), 4)
        0.0099
    """
    small, middle, large = np.linalg.eigvalsh(body.inertia_matrix)
    return max(float((large - small - middle) / large), 0.0) if large > 0.0 else 0.0
