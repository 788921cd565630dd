"""What makes a setting good: little displacement by the process, and gears that do not reverse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coupling.case.place import Objective
from coupling.place.screen import ScreenFigures

# Where the process has no force, the tool is moved by this one in its softest direction [N].
REFERENCE_FORCE = 100.0
# How much the other one of displacement and flanks counts in an objective that is of one alone: it
# decides between settings that are alike.
_BESIDE = 1e-3


@dataclass(frozen=True)
class PlaceDemands:
    """What a setting must keep to.

    Attributes:
        joint_margin: Distance of the joints from their limits [rad].
        regularity: Distance from singular postures, `Following.regularity`.
        clear_share: Part of a torque's swing by which it must stay clear of zero.
    """

    joint_margin: float
    regularity: float
    clear_share: float

    def refusals(self, figures: ScreenFigures) -> dict[str, np.ndarray]:
        """Return which settings are refused for what; the first reason of each, (n,) each."""
        reasons = {
            "out of reach": ~figures.reached,
            "a joint too near to its limit": figures.limit_margin < self.joint_margin,
            "too near to a singular posture": figures.regularity < self.regularity,
            "a joint too fast": figures.rate_share > 1.0,
        }
        left = np.ones(len(figures), dtype=bool)
        for what, wrong in reasons.items():
            reasons[what] = wrong & left
            left &= ~wrong
        return reasons

    def admits(self, figures: ScreenFigures) -> np.ndarray:
        """Return which settings keep to all of them, (n,)."""
        refused = np.any(list(self.refusals(figures).values()), axis=0)
        return ~refused

    def risk(self, figures: ScreenFigures) -> np.ndarray:
        """Return how much each gear counts as one that may reverse, (n, gears).

        1 where its torque changes sign, 0 where it stays clear of zero as demanded, straight between.
        """
        demanded = np.maximum(self.clear_share * figures.swing, 1e-9)
        share: np.ndarray = np.clip(1.0 - figures.margin / demanded, 0.0, 1.0)
        return share

    def exposure(self, figures: ScreenFigures) -> np.ndarray:
        """Return what backlashes that are 20 % off may do at the tool at rest, summed [m], (n,)."""
        exposed: np.ndarray = np.sum(self.risk(figures) * figures.miss, axis=1)
        return exposed


Cost = Callable[[np.ndarray, np.ndarray], np.ndarray]

# From displacement by the process and exposure [m], (n,) each.
OBJECTIVES: dict[Objective, Cost] = {
    "stiffness": lambda moved, exposed: moved + _BESIDE * exposed,
    "flanks": lambda moved, exposed: exposed + _BESIDE * moved,
    "both": lambda moved, exposed: moved + exposed,
}


@dataclass(frozen=True)
class PlaceObjective:
    """What a search looks for.

    Attributes:
        objective: Name in `OBJECTIVES`.
        demands: What settings must keep to.
        forced: Whether the process has a force.
    """

    objective: Objective
    demands: PlaceDemands
    forced: bool

    def moved(self, figures: ScreenFigures) -> np.ndarray:
        """Return what the process, or the reference force, moves the tool by [m], (n,)."""
        return figures.deviation if self.forced else REFERENCE_FORCE * figures.compliance

    def cost(self, figures: ScreenFigures) -> np.ndarray:
        """Return what is to be small [m], (n,); infinite where a setting is refused."""
        exposed = self.demands.exposure(figures)
        cost = OBJECTIVES[self.objective](self.moved(figures), exposed)
        return np.where(self.demands.admits(figures), cost, np.inf)
