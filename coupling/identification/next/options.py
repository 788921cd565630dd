"""How the next command is to be found."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from coupling.identification.next.device import FrameKnown

# Runs one after the other on a warm robot repeat better than data sheets of large robots say, 0.05 mm.
REPEATABILITY = 2e-5
KINDS = ("auto", "parameters", "path", "both")


@dataclass(frozen=True)
class NextOptions:
    """How the next command is found.

    Attributes:
        known: What is known of the measuring frame.
        move: One of `KINDS`.
        cutoff: Cutoff of learning along the path that is asked for [Hz]; None: the highest that
            contracts.
        seed: Of the robots that are possible.
        repeatability: RP of the robot by ISO 9283, on the day and on this path [m].
    """

    known: FrameKnown = field(default_factory=FrameKnown)
    move: str = "auto"
    cutoff: float | None = None
    seed: int = 1
    repeatability: float = REPEATABILITY

    @property
    def absolute(self) -> bool:
        """Whether the deviation's constant counts: the frame is said to be known."""
        return bool(np.isfinite(self.known.shift))
