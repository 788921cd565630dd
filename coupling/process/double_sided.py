"""Forming between two tools: the supporting tool takes a share of the forming force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process.base import Process, ProcessResponse, WithIdentity
from coupling.toolpaths.support import SupportingTool


@dataclass(frozen=True)
class DoubleSided(WithIdentity):
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
    support: SupportingTool
    share: float
    stiffness: float

    def evaluate(self, path: ToolPath) -> ProcessResponse:
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
        return ProcessResponse(
            WrenchHistory(path.time, wrench),
            stiffness=self._stiffness(answer, size, borne, support),
        )

    def _stiffness(
        self, alone: ProcessResponse, size: np.ndarray, borne: np.ndarray, support: SupportingTool
    ) -> np.ndarray | None:
        """Return the stiffness of both tools by both's displacements; None where the law has none.

        With n across the sheet, S = s |F| + k c and dc = n . (dx1 - dx2), where the tools pinch

            dF1 = dF - k dc n,  dF2 = (s d|F| + k dc) n,

        and the law's own dF where they do not: what it shares there is left out, as its reaction to
        the tool's own displacement would not be symmetric.
        """
        if alone.stiffness is None:
            return None
        law, force, normal = alone.stiffness, alone.wrench.force[0], support.direction
        along = np.divide(force, size[:, None], out=np.zeros_like(force), where=size[:, None] > 0.0)
        growth = np.einsum("ni,nij->nj", along, law)  # -d|F|/dx1
        shared = self.share * normal[:, :, None] * growth[:, None, :]
        pressed = (borne > 0.0)[:, None, None]
        pinch = pressed * self.stiffness * normal[:, :, None] * normal[:, None, :]
        forming = np.concatenate([law + pinch, -pinch], axis=2)
        supporting = np.concatenate([pressed * shared - pinch, pinch], axis=2)
        return np.concatenate([forming, supporting], axis=1)
