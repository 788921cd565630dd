"""Scheme "robin": the robot moves against the process's own stiffness instead of a given force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coupling.path.contact_spring import ContactSpring, straight
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process.base import Answer
from coupling.solve.reaction import Reaction
from coupling.solve.relaxation import Constant
from elastic_robot.fmi.interface import Mode

# Part of its stiffness that a process keeps, from evaluation to evaluation, where contact is lost: the
# next path may touch again, and without it the tool would be thrown off again.
_KEPT = 0.25


class Robin(Constant):
    """The robot under F(x_k) + K (x_k - x), K about the process's stiffness -dF/dx.

    At the fixed point the spring carries nothing, so that it changes no answer; on the way there it
    holds a gear that a given force would leave without a place in its play, and with the right K the
    iteration is Newton's.  K is that of the process's answer where it tells, else estimated from
    evaluation to evaluation (docs/robin.md).

    Args:
        first: Factor of every update.
    """

    def __init__(self, first: float = 1.0) -> None:
        super().__init__(first)
        self._seen: Reaction | None = None
        self._stiffness: np.ndarray | None = None

    def loads(self, path: ToolPath, rows: np.ndarray, answer: Answer, mode: Mode) -> WrenchHistory:
        """Return the answer's wrenches beside springs to the path."""
        position, force = path.position[:, rows], answer.wrench.force
        stated = answer.stiffness
        if self._seen is not None:
            if stated is not None:
                stated = self._kept(force, stated)
            last, self._seen = self._seen, self._seen.then(position, force, stated)
            if mode == "quasistatic":  # a moving robot cannot jump from sample to sample
                self._seen = self._seen.held_after(last)
        elif stated is not None:
            self._seen = Reaction.known(position, force, stated)
        else:
            self._seen = self._guess(position, force)
        self._stiffness = self._seen.stiffness
        stiffness = straight(answer.wrench.time, self._stiffness, path.time)
        spring = ContactSpring(path.position, stiffness)
        return replace(super().loads(path, rows, answer, mode), spring=spring)

    def _guess(self, position: np.ndarray, force: np.ndarray) -> Reaction:
        """Return the stiffness that the coupling before this one found, or a first guess."""
        if self._stiffness is not None and self._stiffness.shape[:2] == force.shape[:2]:
            return Reaction.known(position, force, self._stiffness)
        return Reaction.first(position, force)

    def _kept(self, force: np.ndarray, stated: np.ndarray) -> np.ndarray:
        """Return a stated stiffness; a tool that has lost contact keeps part of what held it."""
        assert self._seen is not None
        lost = ~np.any(stated, axis=(-1, -2)) & ~np.any(force, axis=-1)
        return np.where(lost[..., None, None], _KEPT * self._seen.own, stated)

    def reset(self) -> None:
        """Forget earlier evaluations, but how stiff the process was in the last one."""
        self._seen = None
