"""Where a step's polynomial first leaves the region in which a coordinate obeys one smooth law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic_robot import gauss
from elastic_robot.settings import Settings

_NOTHING = 1e-40
# In `Crossing`: no coordinate, the depth of a contact.
DEPTH = -1
# A contact begins this far behind the plane [m], so that rounding does not undo it, and ends at it: what
# presses never pulls.
CONTACT_SLACK = 1e-11
# Power coefficients of a quintic from its values at the start, the nodes and the end of a step.
_FROM_VALUES = np.linalg.inv(
    np.concatenate([[0.0], gauss.NODES, [1.0]])[:, None] ** np.arange(gauss.DEGREE + 1)
)


@dataclass(frozen=True)
class Crossing:
    """The first place where a step leaves a region.

    Attributes:
        coordinate: Index of the coordinate that leaves; `DEPTH` for a contact.
        boundary: Value that it passes.
        outward: +1 if it rises through the boundary, -1 if it falls.
        region: The region beyond: -1, 0 or 1.
        fraction: Place in the step, in (0, 1].
    """

    coordinate: int
    boundary: float
    outward: float
    region: int
    fraction: float


class Boundaries:
    """Ends of the present regions of all coordinates.

    Args:
        half_width: The law of coordinate k changes at +-half_width[k]; infinite: never, (m,).
        region: Below (-1), between (0) or above (1) these two values, (m,).
        tolerance: Limit of the local error estimate, in the coordinates' unit.
        settings: Slack and landing.

    Attributes:
        landing: A step that ends on a boundary may miss it by this much.
    """

    def __init__(
        self, half_width: np.ndarray, region: np.ndarray, tolerance: float, settings: Settings
    ) -> None:
        self.half_width = half_width
        self.region = region
        self._bounded = np.flatnonzero(np.isfinite(half_width))
        width, side = half_width[self._bounded], region[self._bounded]
        slack = settings.slack * tolerance
        beyond = np.minimum(slack, settings.slack_of_width * width)
        # Outside the play (region +-1) only the side towards it is a boundary.
        self._upper = np.choose(side + 1, [-width, width, np.inf]) + beyond
        self._lower = np.choose(side + 1, [-np.inf, -width, width]) - beyond
        self.landing = settings.landing * float(beyond.min(initial=slack))

    def first_crossing(self, rows: np.ndarray, h: float) -> Crossing | None:
        """Return where a step leaves its regions first, or None.

        Args:
            rows: x and v at its start and the stage accelerations, (2 + stages, m).
            h: Length of the step [s].
        """
        if len(self._bounded) == 0:
            return None
        rows = rows.take(self._bounded, axis=1)
        rows[1] *= h
        rows[2:] *= h * h
        bernstein = gauss.BERNSTEIN @ rows
        outside = (bernstein > self._upper) | (bernstein < self._lower)
        if not outside.any():
            return None
        first: Crossing | None = None
        for k in np.flatnonzero(outside.any(axis=0)):
            power = gauss.POWER @ rows[:, k]
            for boundary, outward in ((self._upper[k], 1.0), (self._lower[k], -1.0)):
                if not np.isfinite(boundary):
                    continue
                fraction = _first_passage(power, boundary, outward)
                if fraction is not None and (first is None or fraction < first.fraction):
                    coordinate = int(self._bounded[k])
                    region = int(outward) if self.region[coordinate] == 0 else 0
                    first = Crossing(coordinate, float(boundary), outward, region, fraction)
        return first


def contact_crossing(touching: bool, depth: np.ndarray) -> Crossing | None:
    """Return where a contact begins or ends in a step, or None.

    Args:
        touching: Whether it presses.
        depth: Depths [m] at the start, the nodes and the end of the step, (2 + stages,).
    """
    boundary, outward = (0.0, -1.0) if touching else (CONTACT_SLACK, 1.0)
    fraction = _first_passage(_FROM_VALUES @ depth, boundary, outward)
    if fraction is None:
        return None
    return Crossing(DEPTH, boundary, outward, int(not touching), fraction)


def _first_passage(power: np.ndarray, boundary: float, outward: float) -> float | None:
    """Return the smallest s in (0, 1] at which a polynomial passes a boundary outwards."""
    shifted = power.copy()
    shifted[0] -= boundary
    shifted *= outward
    # Of no effect where s <= 1, and their quotients would overflow.
    shifted[np.abs(shifted) < _NOTHING * np.abs(shifted).max()] = 0.0
    roots = np.roots(shifted[::-1])
    real = np.sort(
        roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0.0) & (roots.real <= 1.0)]
    )
    slope = np.polyder(shifted[::-1])
    for s in real:
        if np.polyval(slope, s) > 0.0:
            return float(s)
    return None
