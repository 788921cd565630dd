"""How long steps are: as an estimate of the local error allows, and so that they end on a target."""

from __future__ import annotations

from dataclasses import dataclass

from elastic_robot.collocation import Step
from elastic_robot.settings import Settings

# The error estimate of a step of length h falls as h^6: h^2 times the defect, of order 4.
_ERROR_EXPONENT = 1.0 / 6.0


@dataclass(frozen=True)
class StepLength:
    """Chooses the lengths of steps.

    Attributes:
        tolerance: Limit of the local error estimate, in the coordinates' unit.
        settings: Limits of the lengths and of their changes.
    """

    tolerance: float
    settings: Settings

    @property
    def shortest(self) -> float:
        """Length of the shortest step [s]; the integration is given up below it."""
        return self.settings.shortest_step * self.settings.longest_step

    def most_tries(self, length: float) -> float:
        """Return the number of tries after which an integration over a time [s] is given up."""
        settings = self.settings
        most = (
            settings.most_tries + settings.most_tries_per_longest * length / settings.longest_step
        )
        finer = settings.usual_local_error / self.tolerance
        return float(most * max(1.0, finer**_ERROR_EXPONENT))

    def towards(self, left: float, wanted: float) -> float:
        """Return the length of a step that has so much time left to its target [s].

        One step a little longer than wanted, or two equal ones, rather than one full and a sliver.
        """
        return left if left <= self.settings.stretch * wanted else min(wanted, 0.5 * left)

    def shorter(self, step: Step) -> float:
        """Return the length with which to repeat a step whose error is too large [s]."""
        return step.length * max(self.settings.strongest_cut, self._growth(step))

    def following(self, step: Step, wanted: float) -> float:
        """Return the length proposed for the next step [s].

        Args:
            step: The step just taken.
            wanted: Length that it would have had, had its target been far [s].
        """
        growth = self._growth(step)
        proposal = step.length * min(self.settings.fastest_growth, growth)
        if step.length < wanted:
            # Cut short by its target it says little about the step that the error would allow.
            proposal = max(proposal, wanted)
        elif growth < self.settings.smallest_growth:
            proposal = step.length * min(1.0, growth)
        return min(proposal, self.settings.longest_step)

    def _growth(self, step: Step) -> float:
        """Return the length that the error would allow over that of the step."""
        ratio = self.tolerance / max(step.error, 1e-300)
        return float(self.settings.safety * ratio**_ERROR_EXPONENT)
