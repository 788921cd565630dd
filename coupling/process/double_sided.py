"""Forming between two tools: the supporting tool takes a share of the forming force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process.base import Answer, Identified, Process
from coupling.toolpaths.support import Support


@dataclass(frozen=True)
class DoubleSided(Identified):
    """The forming force of a law, a share of it on the supporting tool, and what both pinch.

    S = max(0, s F + k c) acts on the supporting tool away from the sheet: F is the size of the forming
    force, c how much closer the tools are than commanded, across the sheet.  What S exceeds s F by,
    the pinch, presses the forming tool back as well; where F is zero the sheet is out of reach.

    Attributes:
        law: Forming force on the forming tool alone.
        support: Task of the supporting tool.
        share: s, from 0 to 1.
        stiffness: k, of the sheet between the tools [N/m].
    """

    law: Process
    support: Support
    share: float
    stiffness: float

    def evaluate(self, path: ToolPath) -> Answer:
        """Return the wrenches on both tools along their actual paths."""
        answer = self.law.evaluate(path.tools[0])
        alone = answer.wrench
        size = np.linalg.norm(alone.force[0], axis=1)
        support = self.support.at(path.time)
        closing = -support.opening(path)
        borne = np.maximum(self.share * size + self.stiffness * closing, 0.0) * (size > 0.0)
        pinch = borne - self.share * size
        wrench = np.concatenate([alone.wrench, np.zeros_like(alone.wrench)])
        wrench[0, :, :3] -= pinch[:, None] * support.direction
        wrench[1, :, :3] = borne[:, None] * support.direction
        return Answer(
            WrenchHistory(path.time, wrench), stiffness=self._stiffness(answer, borne, support)
        )

    def _stiffness(self, alone: Answer, borne: np.ndarray, support: Support) -> np.ndarray | None:
        """Return what each tool feels while the other stays; None where the law does not know."""
        if alone.stiffness is None:
            return None
        across = support.direction[:, :, None] * support.direction[:, None, :]
        pinch = (self.stiffness * (borne > 0.0))[:, None, None] * across
        return np.stack([alone.stiffness[0] + pinch, pinch])
