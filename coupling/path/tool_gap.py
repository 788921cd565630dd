"""The gap between the two tools of a cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class PinchGap:
    """How far the gap between forming and supporting tool is from the commanded one, over time.

    Attributes:
        time: [s], (n,).
        commanded: Between the surfaces of the tools, across the sheet [m].
        before, after: By how much it is wider, before and after compensation [m], (n,).
    """

    time: np.ndarray
    commanded: float
    before: np.ndarray
    after: np.ndarray

    def as_dict(self) -> dict[str, float]:
        """Return its figures by name [m]."""
        return {
            "commanded": self.commanded,
            "narrowest_before": self.commanded + float(self.before.min()),
            "widest_before": self.commanded + float(self.before.max()),
            "narrowest_after": self.commanded + float(self.after.min()),
            "widest_after": self.commanded + float(self.after.max()),
        }
