"""Rotation of a tool about its axis, where a file gives the axis alone."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.toolpaths.part import PART_FROM_TOOL

UPWARD = np.array([0.0, 0.0, 1.0])
# Between axes whose cosine is as close as this to -1 there is no shortest rotation.
_OPPOSITE_TOLERANCE = 1e-6


def upright(axis: np.ndarray) -> Rotation:
    """Return the rotations part_from_tool that turn an untilted tool the shortest way to tool axes.

    Each depends on its axis alone, so that a tool that comes back to an axis has turned about it by
    nothing.

    Args:
        axis: Unit vectors from the tool's tip to its holder, part frame [1], (n, 3).

    Raises:
        ValueError: If an axis points straight down.

    Example:
        >>> tool = upright(np.array([[0.0, 0.6, 0.8]]))
        >>> tool.apply([1.0, 0.0, 0.0]).round(9) + 0.0
        array([[ 0. , -0.6, -0.8]])
    """
    down = 1.0 + axis[:, 2] < _OPPOSITE_TOLERANCE
    if np.any(down):
        raise ValueError(
            "expected tool axes that do not point straight down, got one at point"
            f' {int(np.argmax(down)) + 1}: set roll = "parallel", or turn the part frame'
        )
    rotation: Rotation = _shortest(np.tile(UPWARD, (len(axis), 1)), axis) * PART_FROM_TOOL
    return rotation


def parallel(axis: np.ndarray) -> Rotation:
    """Return the rotations part_from_tool that follow tool axes the shortest way from each to the next.

    The tool never turns about its axis on its way (parallel transport), but after a closed path of the
    axis it has, by the solid angle within.  The first rotation is that of `upright`, or half a turn
    about the part's x axis where that axis points straight down.

    Args:
        axis: Unit vectors from the tool's tip to its holder, part frame [1], (n, 3).

    Raises:
        ValueError: If an axis is opposite to the one before it.
    """
    opposite = 1.0 + np.einsum("ij,ij->i", axis[1:], axis[:-1]) < _OPPOSITE_TOLERANCE
    if np.any(opposite):
        raise ValueError(
            "expected tool axes less than half a turn from point to point, got more at point"
            f" {int(np.argmax(opposite)) + 2}: output points between"
        )
    is_down = 1.0 + axis[0, 2] < _OPPOSITE_TOLERANCE
    first = Rotation.from_euler("x", np.pi) * PART_FROM_TOOL if is_down else upright(axis[:1])[0]
    turns = Rotation.concatenate([first, _shortest(axis[:-1], axis[1:])])
    # Products of all before, by doubling: 1, 2, 4, ... at once.
    quaternion, count = turns.as_quat(), 1
    while count < len(axis):
        later, before = quaternion[count:], quaternion[:-count]
        product = Rotation.from_quat(later) * Rotation.from_quat(before)
        quaternion = np.vstack([quaternion[:count], product.as_quat()])
        count *= 2
    return Rotation.from_quat(quaternion)


# How the tool is rotated about its axis.
ROLLS = {"upright": upright, "parallel": parallel}


def _shortest(axis: np.ndarray, other: np.ndarray) -> Rotation:
    """Return the shortest rotations from unit vectors to others, (n, 3)."""
    across, along = np.cross(axis, other), np.einsum("ij,ij->i", axis, other)
    rotation: Rotation = Rotation.from_quat(np.column_stack([across, 1.0 + along]))
    return rotation
