"""Tools that do not settle from evaluation to evaluation: gears unloaded in their backlash."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

# Evaluations before which no sample can be said not to settle.
_EARLY = 3
# A sample does not settle where a tool would move farther than the last time, or turns away from its
# last move (by more than this cosine) and would go more than this part of it.  Moves below the last
# number do not matter [m].
_TURNS, _SETTLES, _STILL = 0.5, 0.5, 1e-7
# Stiffness that holds such a sample in all directions: to begin with, part of the process's own (the
# median along the path), by how much it changes from evaluation to evaluation, and the most.
_HOLD, _TIGHTER, _TIGHTEST = 0.1, 4.0, 400.0
# What is held creeps along a straight line (by this cosine at least), and then goes on by as many of
# its own moves as are left of a series that falls as the last two did: so many times as many as the
# last time at most.
_STRAIGHT, _FASTER = 0.7, 4.0
# Where that leads astray it goes this part as far, and every time farther again.
_SLOWER, _DARES = 0.25, 2.0


@dataclass(frozen=True)
class LocalStabilisation:
    """Stiffnesses that hold tools along their paths until they settle.

    A gear that hardly anything pushes to a flank jumps from one to the other at a stiffness that was
    taken a little too small; and what one sample answers depends on its neighbours' jumps.  So a tool
    that does not settle is held there.  What is held creeps: it is carried on by several of its own
    moves at a time, by their secant (Irons and Tuck 1969, by sample; docs/references.md).

    Attributes:
        hold: Stiffness that holds them in all directions [N/m], (tools, n).
        factor: Multiple of its own move that a tool goes on by [1], (tools, n).
        most: Largest such multiple [1], (tools, n).
        move: The last moves, from where the process saw a tool to where the robot put it [m],
            (tools, n, 3).
        evaluations: Number of evaluations.
    """

    hold: np.ndarray
    factor: np.ndarray
    most: np.ndarray
    move: np.ndarray
    evaluations: int = 0

    @classmethod
    def initial(cls, hold: np.ndarray) -> LocalStabilisation:
        """Return the state before the first evaluation, with tools held by (tools, n) [N/m]."""
        unit_factors = np.ones_like(hold)
        return cls(hold, unit_factors, np.full_like(hold, np.inf), np.zeros((*hold.shape, 3)))

    def after(self, move: np.ndarray, usual: float) -> LocalStabilisation:
        """Return the state after one more evaluation.

        Args:
            move: The moves that follow from it [m], (tools, n, 3).
            usual: Stiffness of the process that is usual along the path [N/m].
        """
        now = replace(self, move=move, evaluations=self.evaluations + 1)
        if now.evaluations < _EARLY:
            return now
        size, before = np.linalg.norm(move, axis=-1), np.linalg.norm(self.move, axis=-1)
        onward = np.sum(move * self.move, axis=-1)
        reverses = onward < _TURNS * size * before
        restless = ((size > before) | (reverses & (size > _SETTLES * before))) & (size > _STILL)
        accelerated = self.factor > 1.0
        # What was carried too far comes back the same way, and the secant knows how far.
        line = (np.abs(onward) > _STRAIGHT * size * before) & (onward < before**2)
        creeps = (self.hold > 0.0) & line & (accelerated | (~restless & (onward > 0.0)))
        astray = restless & accelerated & ~line
        hold = np.where(restless & ~accelerated, self._tighter(usual), self.hold)
        most = np.where(astray, np.maximum(_SLOWER * self.factor, 1.0), _DARES * self.most)
        fastest = np.minimum(most, _FASTER * np.maximum(self.factor, 1.0))
        factor = np.where(creeps, np.minimum(self._secant(move), fastest), 1.0)
        return replace(now, hold=hold, factor=factor, most=most)

    def restarted(self) -> LocalStabilisation:
        """Return the state before the first evaluation of another coupling, with the same held."""
        return LocalStabilisation.initial(self.hold)

    def _secant(self, move: np.ndarray) -> np.ndarray:
        """Return Aitken's factor, which ends a series of moves that changes as the last two did."""
        change = move - self.move
        fell, size = -np.sum(change * self.move, axis=-1), np.sum(change**2, axis=-1)
        return self.factor * np.divide(fell, size, where=size > 0.0, out=np.ones_like(fell))

    def _tighter(self, usual: float) -> np.ndarray:
        return np.clip(_TIGHTER * self.hold, _HOLD * usual, _TIGHTEST * usual)
