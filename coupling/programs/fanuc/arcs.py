"""Arcs of FANUC programs: C through a position to another, A from position to position of one circle."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.errors import ProgramError
from coupling.programs.circles import add_arc
from coupling.programs.poses import turn_between
from coupling.programs.program import Pose, ProgramMove, rest_behind

# Positions of a circle may be off it by the rounding of their numbers, and more of a post's [m].
_OFF_CIRCLE = 1e-5
# Rotations are one if they differ by less [rad]: by the rounding of W, P, R.
_SAME_ROTATION = 1e-4
_FEWEST = 3


def add_circular(moves: list[ProgramMove], via: Pose, end: ProgramMove) -> None:
    """Add the arc of a C from the last move's pose through a position to its end.

    Raises:
        ProgramError: If the tool turns on it, which the controller does by rules of its own, or there is
            no such arc.
    """
    assert end.pose is not None
    for pose in (moves[-1].pose if moves else None, via):
        if pose is not None and turn_between(pose, end.pose) > _SAME_ROTATION:
            raise _turning(end.where)
    if moves and moves[-1].pose is not None:
        end = _with_rotation(end, moves[-1].pose)
    add_arc(moves, via, end, "none")


@dataclass
class ArcRun:
    """Moves of A motions one after the other.

    To the first one the tool goes straight; from there it follows the circle through three of them.

    Attributes:
        ends: Moves to their positions.
    """

    ends: list[ProgramMove] = field(default_factory=list)

    def add(self, moves: list[ProgramMove], end: ProgramMove) -> None:
        """Add the move of an A.

        Raises:
            ProgramError: If the tool turns, or its position is not on the circle of those before.
        """
        assert end.pose is not None
        if self.ends:
            assert self.ends[0].pose is not None
            if turn_between(self.ends[0].pose, end.pose) > _SAME_ROTATION:
                raise _turning(end.where)
            end = _with_rotation(end, self.ends[0].pose)
        self.ends.append(end)
        if len(self.ends) < _FEWEST:
            moves.append(end)
            return
        if len(self.ends) == _FEWEST:
            second = moves.pop()
            self._follow(moves, second)
        self._follow(moves, end)

    def finish(self) -> None:
        """End the arcs.

        Raises:
            ProgramError: If there are too few positions for a circle.
        """
        if 0 < len(self.ends) < _FEWEST:
            raise ProgramError(
                f"{self.ends[-1].where}: expected at least three A one after the other, which make a"
                f" circle, got {len(self.ends)}: write L or C"
            )
        self.ends = []

    def _follow(self, moves: list[ProgramMove], end: ProgramMove) -> None:
        """Add the arc from the last move to another on the circle of the first three."""
        first, second, third = (np.array(move.pose)[:3] for move in self.ends[:_FEWEST])
        assert moves[-1].pose is not None
        assert end.pose is not None
        u, v = second - first, third - first
        normal = np.cross(u, v)
        square = float(normal @ normal)
        if square <= 1e-12 * float((u @ u) * (v @ v)):
            raise ProgramError(
                f"{end.where}: expected A on a circle, got positions on a line: write L"
            )
        centre = first + (np.cross(v, normal) * (u @ u) + np.cross(normal, u) * (v @ v)) / (
            2.0 * square
        )
        axis = normal / square**0.5
        before, behind = np.array(moves[-1].pose[:3]) - centre, np.array(end.pose[:3]) - centre
        off = float(
            np.hypot(np.linalg.norm(behind) - np.linalg.norm(first - centre), behind @ axis)
        )
        if off > _OFF_CIRCLE:
            raise ProgramError(
                f"{end.where}: expected all A of an arc on one circle, got a position {1e3 * off:.3g} mm"
                " off it: divide the arc into lines, or into C"
            )
        angle = np.arctan2(axis @ np.cross(before, behind), before @ behind) % (2.0 * np.pi)
        middle = centre + Rotation.from_rotvec(0.5 * angle * axis).apply(before)
        add_arc(
            moves, (*middle.tolist(), *end.pose[3:]), replace(end, is_stop=False, wait=0.0), "none"
        )
        if end.is_stop:
            rest_behind(moves, end.wait)


def _with_rotation(end: ProgramMove, pose: Pose) -> ProgramMove:
    """Return a move whose target has the rotation of another pose, which it has but for rounding."""
    assert end.pose is not None
    return replace(end, pose=(*end.pose[:3], *pose[3:]))


def _turning(where: str) -> ProgramError:
    return ProgramError(
        f"{where}: expected one rotation of the tool on an arc, got a tool that turns, whose way the"
        " controller alone knows: divide the arc into lines"
    )
