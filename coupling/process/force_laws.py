"""Force laws as formulas: for a whole path in `coupling.process`, step by step in a process FMU.

Imports NumPy alone: a process FMU packs this file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

# Distance from the part's axis [m] below which there is no radial direction.
_ON_AXIS = 1e-12


@dataclass(frozen=True)
class ForceReaction:
    """Force of a process on the tool, and its derivative by a displacement.

    Attributes:
        force: Force on the tool, base axes [N], (n, 3).
        stiffness: K = -dF/dx [N/m], (n, 3, 3).
    """

    force: np.ndarray
    stiffness: np.ndarray


def elastic_wall(
    position: np.ndarray, *, point: np.ndarray, normal: np.ndarray, stiffness: float
) -> ForceReaction:
    """Return the reaction of a frictionless plane wall on linear springs, nothing off the wall.

    Args:
        position: Position of the TCP, base frame [m], (n, 3).
        point: Point of the wall's plane, base frame [m], (3,).
        normal: Unit vector out of the wall, base axes, (3,).
        stiffness: Stiffness of the contact [N/m].

    Example:
        >>> up = np.array([0.0, 0.0, 1.0])
        >>> deep = np.array([[0.0, 0.0, -1e-3]])
        >>> elastic_wall(deep, point=0.0 * up, normal=up, stiffness=1e5).force
        array([[  0.,   0., 100.]])
    """
    penetration = np.maximum((point - position) @ normal, 0.0)
    slope = stiffness * (penetration > 0.0)
    return ForceReaction(
        stiffness * np.outer(penetration, normal), slope[:, None, None] * np.outer(normal, normal)
    )


def sheet_forming(
    position: np.ndarray,
    *,
    desired: np.ndarray,
    part_position: np.ndarray,
    base_from_part: np.ndarray,
    axial: float,
    radial: float,
    penetration_stiffness: float,
    ramp_depth: float,
) -> ForceReaction:
    """Return the reaction of a sheet that is formed, closed on the actual position.

    F = ramp max(0, F_s + k_p p) d, d the unit vector out of the sheet (+z) and towards the part's
    axis in the ratio of the steady forces, F_s their resultant, p how far the actual TCP is beyond
    the desired one against d; the ramp rises with the desired depth.

    Args:
        position: Position of the TCP, base frame [m], (n, 3).
        desired: Desired position at the same times [m], (n, 3).
        part_position: Origin of the part frame in the base frame [m], (3,).
        base_from_part: Rotation matrix, (3, 3).
        axial, radial: Steady force [N].
        penetration_stiffness: k_p [N/m].
        ramp_depth: Depth at which the force is steady [m].

    Example:
        >>> constants = dict(part_position=np.zeros(3), base_from_part=np.eye(3), axial=300.0,
        ...                  radial=400.0, penetration_stiffness=0.0, ramp_depth=1e-3)
        >>> deep = np.array([[0.06, 0.08, -0.01]])
        >>> sheet_forming(deep, desired=deep, **constants).force
        array([[-240., -320.,  300.]])
    """
    points = (desired - part_position) @ base_from_part
    ramp = np.clip(-points[:, 2] / ramp_depth, 0.0, 1.0)
    distance = np.linalg.norm(points[:, :2], axis=1, keepdims=True)
    inward = -points[:, :2] / np.maximum(distance, _ON_AXIS)
    steady = float(np.hypot(axial, radial))
    direction = np.column_stack([radial * inward, np.full(len(points), axial)]) / steady
    direction = direction @ np.transpose(base_from_part)
    penetration = np.sum((desired - position) * direction, axis=1)
    size = ramp * np.maximum(steady + penetration_stiffness * penetration, 0.0)
    slope = ramp * penetration_stiffness * (size > 0.0)
    outer = direction[:, :, None] * direction[:, None, :]
    return ForceReaction(size[:, None] * direction, slope[:, None, None] * outer)


FORCE_LAWS: dict[str, Callable[..., ForceReaction]] = {
    "elastic_wall": elastic_wall,
    "sheet_forming": sheet_forming,
}


@dataclass(frozen=True)
class ForceLaw:
    """A process without memory: the force follows from the time and the TCP's position alone.

    Attributes:
        name: Name of the formula in FORCE_LAWS.
        constants: Numbers and arrays of any shape, by the name of the formula's argument.
        desired: Times [s] and positions [m] of the desired path, (m, 4), which a formula takes as
            `desired`, straight between its samples; None: the force does not depend on time.
    """

    name: str
    constants: Mapping[str, float | np.ndarray]
    desired: np.ndarray | None = None

    def reaction(self, time: np.ndarray, position: np.ndarray) -> ForceReaction:
        """Return the reaction at times (n,) [s] and positions of the TCP, base frame [m], (n, 3).

        Example:
            >>> wall = {"point": np.zeros(3), "normal": np.array([0.0, 0.0, 1.0]), "stiffness": 1e5}
            >>> law = ForceLaw("elastic_wall", wall)
            >>> law.reaction(np.zeros(1), np.array([[0.0, 0.0, -1e-3]])).force
            array([[  0.,   0., 100.]])
        """
        return self.reaction_around(self.place(time), position)

    def reaction_around(self, place: np.ndarray, position: np.ndarray) -> ForceReaction:
        """Return the reaction at positions of the TCP from where the law has its origin, (n, 3) [m]."""
        follows = {} if self.desired is None else {"desired": place}
        return FORCE_LAWS[self.name](position, **self.constants, **follows)

    def place(self, time: np.ndarray) -> np.ndarray:
        """Return the origin of the law at times (n,): the desired position [m], (n, 3), or zero."""
        if self.desired is None:
            return np.zeros((len(time), 3))
        instants, *axes = self.desired.T
        return np.column_stack([np.interp(time, instants, axis) for axis in axes])
