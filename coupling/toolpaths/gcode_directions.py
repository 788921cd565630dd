"""Directions of the tool along moves of a G-code program: by rotary axes, or from vector to vector."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from coupling.toolpaths.gcode_moves import UNTILTED, GcodeMove, Held
from coupling.toolpaths.rotary import Kinematics

# Directions closer to opposite than this have no plane that one turns in to the other.
_OPPOSITE_TOLERANCE = 1e-9


class MoveDirections:
    """Directions of the tool along moves.

    Args:
        moves: The moves, n of them.
        kinematics: Rotary axes that their angles are of; None where there are none.
    """

    def __init__(self, moves: Sequence[GcodeMove], kinematics: Kinematics | None) -> None:
        self._moves, self._kinematics = moves, kinematics

    def require_planes(self) -> None:
        """Refuse a turn from a direction to the opposite one, which has no plane.

        Raises:
            ValueError: If there is one.
        """
        opposite = self._great & (self._between > np.pi - _OPPOSITE_TOLERANCE)
        if opposite.any():
            raise ValueError(
                f"expected tool axes less than 180 deg apart, got opposite ones in move"
                f" {int(np.argmax(opposite)) + 1}: give one between"
            )

    @cached_property
    def angle_sums(self) -> np.ndarray:
        """Sums of the angles of rotary axes, or angles between tool axes, of the moves [rad], (n,)."""
        before, after = self._angles
        sums: np.ndarray = np.abs(after - before).sum(axis=1)
        sums[self._great] = self._between[self._great]
        return sums

    @cached_property
    def _states(self) -> tuple[list[Held], list[Held]]:
        turns = [move.turn for move in self._moves]
        return (
            [UNTILTED if turn is None else turn.before for turn in turns],
            [UNTILTED if turn is None else turn.after for turn in turns],
        )

    @cached_property
    def _great(self) -> np.ndarray:
        """Whether the tool's axis turns along a great circle, (n,); a constant one does as well."""
        return np.array(
            [
                turn is None or turn.is_great_circle or not turn.after.angles
                for turn in (move.turn for move in self._moves)
            ]
        )

    @cached_property
    def _angles(self) -> tuple[np.ndarray, np.ndarray]:
        """Angles of the rotary axes at both ends of the moves [rad], (n, a) each; zeros for vectors."""
        count = len(self._kinematics.letters) if self._kinematics else 0
        zeros = (0.0,) * count
        before, after = (
            np.array([state.angles or zeros for state in side]) for side in self._states
        )
        shape = (len(self._moves), count)
        return before.reshape(shape), after.reshape(shape)

    @cached_property
    def _directions(self) -> tuple[np.ndarray, np.ndarray]:
        """Unit vectors from tip to holder at both ends of the moves, (n, 3) each."""
        sides = []
        for states, angles in zip(self._states, self._angles, strict=True):
            stated_axes = np.array([state.axis or UNTILTED.axis for state in states])
            is_angle = np.array([bool(state.angles) for state in states])
            if self._kinematics and is_angle.any():
                stated_axes[is_angle] = self._kinematics.axis(angles[is_angle])
            sides.append(stated_axes)
        return sides[0], sides[1]

    @cached_property
    def _between(self) -> np.ndarray:
        """Angles between the tool's axes at both ends of the moves [rad], (n,)."""
        before, after = self._directions
        across = np.linalg.norm(np.cross(before, after), axis=1)
        angles: np.ndarray = np.arctan2(across, np.einsum("ij,ij->i", before, after))
        return angles

    def axes(self, which: np.ndarray, part: np.ndarray) -> np.ndarray:
        """Return unit vectors from tip to holder, (k, 3), of moves (k,) at parts of them (k,)."""
        axes = np.empty((len(which), 3))
        great = self._great[which]
        if great.any():
            rows, u = which[great], part[great, None]
            before, after = (side[rows] for side in self._directions)
            angle = self._between[rows, None]
            sine = np.sin(angle)
            is_turn = sine > 1e-9
            safe = np.where(is_turn, sine, 1.0)
            first = np.where(is_turn, np.sin((1.0 - u) * angle) / safe, 1.0 - u)
            last = np.where(is_turn, np.sin(u * angle) / safe, u)
            axes[great] = first * before + last * after
        if self._kinematics and not great.all():
            axes[~great] = self._kinematics.axis(self.angles_at(which[~great], part[~great]))
        return axes

    def angles_at(self, which: np.ndarray, part: np.ndarray) -> np.ndarray:
        """Return angles of the rotary axes [rad], (k, a), of moves (k,) at parts of them (k,)."""
        before, after = self._angles
        angles: np.ndarray = before[which] + part[:, None] * (after[which] - before[which])
        return angles
