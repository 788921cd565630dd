"""Where a fit begins again that ended in a hollow beside the valley.

What a gear's crossing takes is 2 B d: its backlash and its damping pull against each other, and along
that hollows lie one behind the other.  So a gear is taken to both sides along it, and in its damping
alone.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from coupling.learn.parameters import Learnable, prior_of

# Steps in backlash and damping of a gear, and their size by what was known before.
_STEPS = ((1.0, -1.0), (-1.0, 1.0), (0.0, 1.0), (0.0, -1.0))
_SIZE = 1.0 / 3.0


@dataclass(frozen=True)
class Held:
    """Derivatives that are taken as they are, whatever the parameters.

    Attributes:
        values: By log factors at the times of a measurement, (n, 6, P).
    """

    values: np.ndarray

    def columns(self, x: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Return them."""
        return self.values


def sides(parameters: Sequence[Learnable], shown: Collection[int]) -> list[list[np.ndarray]]:
    """Return steps of log factors to both sides, for every gear whose play is shown.

    Args:
        parameters: What is learned.
        shown: Numbers of the parameters that matter.

    Returns:
        For each gear whose backlash and damping matter four steps, (P,).
    """
    of = {(own.gear, own.kind): k for k, own in enumerate(parameters) if k in shown}
    size = _SIZE * prior_of(tuple(parameters))
    found = []
    for gear in sorted({own.gear for own in parameters if own.gear is not None}):
        pair = [of[gear, kind] for kind in ("backlash", "damping") if (gear, kind) in of]
        if len(pair) < 2:
            continue
        steps = []
        for signs in _STEPS:
            step = np.zeros(len(parameters))
            step[pair] = signs
            steps.append(size * step)
        found.append(steps)
    return found
