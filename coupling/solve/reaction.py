"""How a process reacts to a displacement of the tools: its stiffness along a path, from evaluations."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coupling.process.base import joined, own_blocks

# Displacement along its force that a tool may make in the first update [m].  The stiffness that this
# asks for should rather be too large, which is slow, than too small, which loses contact.
_FIRST_MOVE = 2e-4
# A tool that moved less between two evaluations tells nothing of the stiffness [m].
_LEAST_MOVE = 1e-8
# A force that changes at a right angle to the motion, by this cosine, is no reaction to it.
_LEAST_COSINE = 1e-3
# Evaluations before which no sample can be said not to settle.
_EARLY = 3
# A sample does not settle where a tool moves farther than the last time, or turns away from its last
# move (by more than this cosine) and goes more than this part of it.  Moves below the last number do not
# matter [m].
_TURNS, _SETTLES, _STILL = 0.5, 0.5, 1e-7
# Stiffness that holds such a sample in all directions: to begin with, part of the process's own (the
# median along the path), by how much it changes from evaluation to evaluation, and the most.
_HOLD, _TIGHTER, _TIGHTEST = 0.1, 4.0, 400.0
# One that creeps, straight on (by this cosine at least), is held too tightly: it gets this multiple of
# the stiffness that its last two steps tell.
_STRAIGHT, _SAFE = 0.9, 1.5
# What it jumped at, times this, is then the least.
_ABOVE = 2.0


@dataclass(frozen=True)
class Reaction:
    """What evaluations of a process have told of its stiffness along the path of all tools.

    Attributes:
        position: Positions of the TCPs that the process saw last [m], (tools, n, 3).
        force: Forces that it answered with [N], (tools, n, 3).
        own: Stiffness that it states, or that explains its answers [N/m], (n, 3 tools, 3 tools).
        hold: What is added in all directions where a tool does not settle [N/m], (tools, n).
        step: How every tool has moved between the last two evaluations [m], (tools, n, 3).
        eased: Stiffness that a tool was met with along its step, over that which it is met with now: how
            much farther it may move, (tools, n).
        least: What a tool that jumped after it had been held less is held by at least [N/m], (tools, n).
        evaluations: Number of evaluations.
    """

    position: np.ndarray
    force: np.ndarray
    own: np.ndarray
    hold: np.ndarray
    step: np.ndarray
    eased: np.ndarray
    least: np.ndarray
    evaluations: int = 1

    @classmethod
    def first(cls, position: np.ndarray, force: np.ndarray) -> Reaction:
        """Return a guess from one evaluation: a stiffness along the force, of equal size everywhere."""
        size = np.linalg.norm(force, axis=-1, keepdims=True)
        direction = np.divide(force, size, out=np.zeros_like(force), where=size > 0.0)
        tools, count = force.shape[:2]
        stiffness = np.zeros((count, tools, 3, tools, 3))
        for k, along in enumerate(direction):
            stiffness[:, k, :, k] = float(size.max()) / _FIRST_MOVE * _square(along)
        return cls.known(position, force, stiffness.reshape(count, 3 * tools, 3 * tools))

    @classmethod
    def known(cls, position: np.ndarray, force: np.ndarray, stiffness: np.ndarray) -> Reaction:
        """Return what is known of a process whose stiffness is given."""
        free = np.zeros(force.shape[:-1])
        eased = np.ones_like(free)
        return cls(position, force, stiffness, free, np.zeros_like(force), eased, least=free)

    @property
    def stiffness(self) -> np.ndarray:
        """Stiffness to meet the tools with [N/m], (n, 3 tools, 3 tools)."""
        hold = np.repeat(self.hold, 3, axis=0).T
        held: np.ndarray = self.own + hold[..., None] * np.eye(hold.shape[-1])
        return held

    def then(
        self, position: np.ndarray, force: np.ndarray, stated: np.ndarray | None = None
    ) -> Reaction:
        """Return what is known after one more evaluation, which may state the stiffness.

        Otherwise that of a sample is the symmetric one of rank one that explains the change of the
        forces on all tools, df df^T / (-df . dx): of all that are not negative the smallest.  It stays
        where no tool moved or the forces did not fall back.
        """
        step = position - self.position
        moves, changed = joined(step), joined(force - self.force)
        work = -np.sum(changed * moves, axis=-1)
        moved, strong = np.linalg.norm(moves, axis=-1), np.linalg.norm(changed, axis=-1)
        falls = (moved > _LEAST_MOVE) & (work > _LEAST_COSINE * moved * strong)
        found = _square(changed) / np.where(falls, work, 1.0)[..., None, None]
        own = np.where(falls[..., None, None], found, self.own) if stated is None else stated
        count = self.evaluations + 1
        return Reaction(position, force, own, self.hold, step, self.eased, self.least, count)

    def held_after(self, last: Reaction) -> Reaction:
        """Return the same, with tools held where they do not settle: gears that hang in their play.

        A gear that hardly anything pushes to a flank jumps from one to the other at a stiffness that was
        taken a little too small; and what one sample answers depends on its neighbours' jumps.

        Where one then creeps, it is held less, but by more than when it jumped for that.  A gear that
        the spring alone holds makes steps s with F = K s, so that two of them tell the process's
        stiffness, K* s_1 = K_1 s_1 - K_2 s_2.

        Args:
            last: What was known one evaluation before.
        """
        if last.evaluations < _EARLY:
            return self
        own = own_blocks(self.own)
        sizes = np.trace(own, axis1=-2, axis2=-1)
        usual = float(np.median(sizes[sizes > 0.0])) if np.any(sizes > 0.0) else 0.0
        moved, before = (np.linalg.norm(entry.step, axis=-1) for entry in (self, last))
        onward = np.sum(self.step * last.step, axis=-1)
        turned = onward < _TURNS * moved * before
        restless = (moved > np.maximum(self.eased, 1.0) * before) | (
            turned & (moved > _SETTLES * before)
        )
        restless &= moved > _STILL
        tighter = np.clip(_TIGHTER * self.hold, _HOLD * usual, _TIGHTEST * usual)
        creeps = ~restless & (onward > _STRAIGHT * moved * before)
        along = _ratio(self.step, moved[..., None])
        stiff = np.einsum("...i,...ij,...j->...", along, own, along)
        told = (self.eased - _ratio(onward, before**2)) * (stiff + self.hold)
        looser = np.clip(_SAFE * told - stiff, self.hold / _TIGHTER, self.hold)
        jumped = restless & (self.eased > 1.0)
        least = np.where(jumped, np.maximum(self.least, _ABOVE * self.hold), self.least)
        looser = np.maximum(looser, np.minimum(least, self.hold))
        hold = np.where(restless, tighter, np.where(creeps, looser, self.hold))
        eased = np.where(stiff + hold > 0.0, _ratio(stiff + self.hold, stiff + hold), 1.0)
        return replace(self, hold=hold, eased=eased, least=least)


def _ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Return part / whole, 0 where the whole is."""
    return np.divide(part, whole, where=whole > 0.0, out=np.zeros_like(part))


def _square(vectors: np.ndarray) -> np.ndarray:
    """Return v v^T of vectors (..., m)."""
    product: np.ndarray = vectors[..., :, None] * vectors[..., None, :]
    return product
