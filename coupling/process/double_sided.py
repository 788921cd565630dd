"""Forming between two tools: the supporting tool takes a share of the forming force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.toolpaths.support import Support


class FormingLaw(Protocol):
    """A law of the forming force along a desired path."""

    @property
    def desired(self) -> ToolPath:
        """Desired path of the forming tool."""
        ...

    def wrench(self, path: ToolPath) -> WrenchHistory:
        """Return the wrench on the forming tool along its actual path."""
        ...


@dataclass(frozen=True)
class SupportedForming:
    """The forming force of a law, a share of it on the supporting tool, and what both pinch.

    S = max(0, s F + k c) acts on the supporting tool away from the sheet: F is the size of the forming
    force, c how much closer the tools are than commanded, across the sheet.  What S exceeds s F by,
    the pinch, presses the forming tool back as well; where F is zero the sheet is out of reach.

    Attributes:
        law: Of the forming force.
        support: What the supporting tool is to do.
        share: s, from 0 to 1.
        stiffness: k, of the sheet between the tools [N/m].
    """

    law: FormingLaw
    support: Support
    share: float
    stiffness: float

    def wrench(self, path: ToolPath) -> WrenchHistory:
        """Return the wrenches on both tools along their actual paths."""
        forming, _ = path.tools
        alone = self.law.wrench(forming)
        size = np.linalg.norm(alone.wrench[:, :3], axis=1)
        closing = -self.support.opening(path, self.law.desired)
        borne = np.maximum(self.share * size + self.stiffness * closing, 0.0) * (size > 0.0)
        pinch = borne - self.share * size
        on_forming = alone.wrench.copy()
        on_forming[:, :3] -= pinch[:, None] * self.support.direction
        on_support = np.zeros_like(on_forming)
        on_support[:, :3] = borne[:, None] * self.support.direction
        return WrenchHistory.of_tools(
            [WrenchHistory(path.time, on_forming), WrenchHistory(path.time, on_support)]
        )
