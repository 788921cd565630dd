"""Objectives of settings: little displacement by the process, and gears that do not reverse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coupling.case.place import Objective
from coupling.place.screen import ScreenFigures
from coupling.results.placement_result import DemandValues

# Where the process has no force, the tool is moved by this one in its softest direction [N].
REFERENCE_FORCE = 100.0
# How much the other one of displacement and backlash counts in an objective that is of one alone: it
# decides between settings that are alike.
_TIE_WEIGHT = 1e-3


class PlaceDemands(DemandValues):
    """Constraints on a setting, and which settings they refuse."""

    def refusals(self, figures: ScreenFigures) -> dict[str, np.ndarray]:
        """Return masks of refused settings, (n,) each, by the first reason for which they are."""
        reasons = {
            "out of reach": ~figures.reached,
            "a joint too near to its limit": figures.limit_margin < self.joint_margin,
            "too near to a singular posture": figures.conditioning < self.conditioning,
            "a joint too fast": figures.rate_share > 1.0,
            "a motor too weak": figures.motor_share > 1.0,
        }
        admissible = np.ones(len(figures), dtype=bool)
        for what, wrong in reasons.items():
            reasons[what] = wrong & admissible
            admissible &= ~wrong
        return reasons

    def admits(self, figures: ScreenFigures) -> np.ndarray:
        """Return the mask of settings that keep to all constraints, (n,)."""
        refused = np.any(list(self.refusals(figures).values()), axis=0)
        return ~refused

    def risk(self, figures: ScreenFigures) -> np.ndarray:
        """Return the weight of each gear as one that may reverse [1], (n, gears).

        1 where its torque changes sign, 0 where it stays clear of zero as demanded, linear between.
        """
        demanded = np.maximum(self.clear_share * figures.swing, 1e-9)
        share: np.ndarray = np.clip(1.0 - figures.margin / demanded, 0.0, 1.0)
        return share

    def exposure(self, figures: ScreenFigures) -> np.ndarray:
        """Return the error of the tool at rest by what is not known of gears, summed [m], (n,).

        Backlashes 20 % off count where gears may reverse, slip torques 30 % off wherever torques change:
        elements know no side on which they are not loaded.
        """
        exposed: np.ndarray = np.sum(
            self.risk(figures) * figures.backlash_error + figures.hysteresis_error, axis=1
        )
        return exposed


Cost = Callable[[np.ndarray, np.ndarray], np.ndarray]

# Cost [m] of displacement by the process and of exposure to backlash and hysteresis [m], (n,) each.
OBJECTIVES: dict[Objective, Cost] = {
    "stiffness": lambda deviation, exposed: deviation + _TIE_WEIGHT * exposed,
    "backlash": lambda deviation, exposed: exposed + _TIE_WEIGHT * deviation,
    "both": lambda deviation, exposed: deviation + exposed,
    # The search knows no modes: it offers stiff settings, of which the limits decide.
    "stability": lambda deviation, exposed: deviation + _TIE_WEIGHT * exposed,
}


@dataclass(frozen=True)
class PlaceObjective:
    """Objective and constraints of a search."""

    objective: Objective
    demands: PlaceDemands
    forced: bool

    def deviation(self, figures: ScreenFigures) -> np.ndarray:
        """Return the displacement of the tool by the process, or the reference force [m], (n,)."""
        return figures.deviation if self.forced else REFERENCE_FORCE * figures.compliance

    def cost(self, figures: ScreenFigures) -> np.ndarray:
        """Return the cost [m], (n,); infinite where a setting is refused."""
        exposed = self.demands.exposure(figures)
        cost = OBJECTIVES[self.objective](self.deviation(figures), exposed)
        return np.where(self.demands.admits(figures), cost, np.inf)
