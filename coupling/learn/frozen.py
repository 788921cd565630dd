"""Where a fit begins again that ended in a local minimum beside the valley.

What a gear's crossing takes is 2 B d: its backlash and its damping pull against each other, and along
that local minima lie one behind the other.  So a gear is taken to both sides along it, and in its
damping alone.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from coupling.fit.parameters import RobotParameter
from coupling.learn.parameters import prior_of

# Steps in backlash and damping of a gear, and their sizes by what was known before: local minima are
# narrow, and the first passes may have led to the wrong side of what was known.
_STEPS = ((1.0, -1.0), (-1.0, 1.0), (0.0, 1.0), (0.0, -1.0))
_SIZES = (1.0 / 3.0, 2.0 / 3.0)


@dataclass(frozen=True)
class FrozenDerivatives:
    """Derivatives that are taken as they are, whatever the parameters.

    Attributes:
        values: By log factors at the times of a measurement, (n, 6, P).
    """

    values: np.ndarray

    def columns(self, x: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Return them."""
        return self.values


def steps_aside(
    parameters: Sequence[RobotParameter], shown: Collection[int]
) -> list[list[np.ndarray]]:
    """Return steps of log factors to both sides, for every gear whose backlash is shown.

    Args:
        parameters: What is learned.
        shown: Numbers of the parameters that matter.

    Returns:
        For each gear whose backlash and damping matter its steps, (P,).
    """
    of = {(own.gear, own.kind): k for k, own in enumerate(parameters) if k in shown}
    prior = prior_of(tuple(parameters))
    found = []
    for gear in sorted({own.gear for own in parameters if own.gear is not None}):
        pair = [of[gear, kind] for kind in ("backlash", "damping") if (gear, kind) in of]
        if len(pair) < 2:
            continue
        steps = []
        for size, signs in product(_SIZES, _STEPS):
            step = np.zeros(len(parameters))
            step[pair] = size * prior[pair] * signs
            steps.append(step)
        found.append(steps)
    return found
