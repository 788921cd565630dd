"""Stability along the path of a case: every place judged, the worst one looked at closely."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.case.case import Case
from coupling.errors import StabilityError
from coupling.path.histories import ToolPath
from coupling.results.cut_stability import CutStability
from coupling.stability.case_cut import CaseCuts, is_milling
from coupling.stability.floquet import vibration_of
from coupling.stability.judgement import Judgement, in_words

# Places of a path that are judged in brief, and speeds of which one is looked for that is stable.
_FEW, _SPEEDS = 8, 60
# Depths are the same if they differ by less of themselves.
_SAME_DEPTH = 0.05


@dataclass(frozen=True)
class PathStability:
    """Cuts along a path, judged at their programmed depth and speed.

    Attributes:
        judgements: Cuts in order of time, one at least.
    """

    judgements: tuple[Judgement, ...]

    @classmethod
    def of(
        cls, cuts: CaseCuts, places: int, actual: ToolPath | None = None
    ) -> PathStability | None:
        """Return the stability along a path.

        Args:
            cuts: Cuts of the case.
            places: Number of places at most.
            actual: Path that the tool takes, in the world, by which it is as deep as it is; None: as
                deep as is programmed.

        Returns:
            The judgements; None where the tool never cuts.

        Raises:
            PlanningError: If the robot cannot follow the path.
            StabilityError: If it has no equilibrium at a place.
        """
        along = cuts.along_path
        if not along:
            return None
        rows = np.unique(np.linspace(0, len(along) - 1, places).astype(int))
        placed = tuple(along[row] for row in rows.tolist())
        if actual is not None and not (placed := cuts.as_deep_as(actual, placed)):
            return None
        return cls(tuple(Judgement.of(cuts, cut) for cut in placed))

    @cached_property
    def worst(self) -> Judgement:
        """The cut that grows fastest where any grows, else the one nearest to its limit."""
        fastest = max(self.judgements, key=lambda judgement: judgement.vibration.growth)
        if not fastest.is_stable:
            return fastest
        # By zero order where none has a limit.
        return min(
            self.judgements,
            key=lambda judgement: (
                judgement.margin,
                judgement.zero_order / judgement.placed.cut.depth,
            ),
        )

    @property
    def is_stable(self) -> bool:
        """Whether no cut chatters."""
        return self.worst.is_stable

    @property
    def sentence(self) -> str:
        """Whether it chatters and where, in words."""
        worst = self.worst
        whose = "" if worst.cuts.tool else "; the tool is taken as rigid"
        is_or_not = "is " if worst.is_stable else ""
        time = f" (t = {worst.placed.time:.2f} s)" if worst.placed.time is not None else ""
        return f"The cut {is_or_not}{in_words(worst)}{time}; {self._depth_in_words}{whose}"

    @property
    def _depth_in_words(self) -> str:
        """The worst cut's depth, programmed and, where it is another one, actual."""
        depth, programmed = self.worst.placed.cut.depth, self.worst.placed.programmed_depth
        words = f"programmed {1e3 * programmed:.3g} mm"
        if abs(depth - programmed) <= _SAME_DEPTH * programmed:
            return words
        return f"{words}, {1e3 * depth:.3g} mm by a robot that gives way"

    @property
    def alternative(self) -> str:
        """What would be stable along the whole path, in words; empty where the cut is."""
        if self.is_stable:
            return ""
        cut = self.worst.placed.cut
        limit = min(judgement.limit for judgement in self.judgements if not judgement.is_stable)
        if all(
            judgement.placed.programmed_depth < judgement.limit for judgement in self.judgements
        ):
            return (
                f"the programmed {1e3 * self.worst.placed.programmed_depth:.3g} mm at {cut.rpm:.0f}"
                " 1/min: touch the tool off at the part, or compensate"
            )
        shallower = f"less than {1e3 * limit:.3g} mm at {cut.rpm:.0f} 1/min"
        speeds = np.geomspace(*self.worst.cuts.speeds, _SPEEDS)
        for rpm in sorted(speeds.tolist(), key=lambda rpm: abs(np.log(rpm / cut.rpm))):
            if self._is_stable_at(rpm):
                return f"{shallower}, or {1e3 * cut.depth:.3g} mm at {rpm:.0f} 1/min"
        return f"{shallower}; no speed from {speeds[0]:.0f} to {speeds[-1]:.0f} 1/min"

    def _is_stable_at(self, rpm: float) -> bool:
        """Return whether the programmed cuts are stable at another speed of the spindle [1/min]."""
        try:
            return all(
                vibration_of(judgement.there.whole, judgement.placed.cut.at_speed(rpm)).is_stable
                for judgement in sorted(self.judgements, key=lambda judgement: judgement.margin)
            )
        except StabilityError:  # too slow for the fastest mode
            return False

    @property
    def brief(self) -> CutStability:
        """The worst cut, with its sentence."""
        worst, vibration = self.worst, self.worst.vibration
        return CutStability(
            sentence=self.sentence,
            alternative=self.alternative,
            stable=vibration.is_stable,
            time_s=worst.placed.time,
            rpm=worst.placed.cut.rpm,
            depth_m=worst.placed.cut.depth,
            limit_m=worst.limit,
            frequency_Hz=vibration.frequency,
            growth_1_s=vibration.growth,
        )


def stability_in_brief(case: Case, actual: ToolPath | None = None) -> CutStability | None:
    """Return the stability along a case's path, at a few places; None where nothing is milled.

    Args:
        case: The case.
        actual: Path that the tool takes, in the world; None: that of the program.

    Raises:
        PlanningError: If the robot cannot follow the path.
        StabilityError: If it has no equilibrium at a place, or nothing gives way.
    """
    if not is_milling(case):
        return None
    path = PathStability.of(CaseCuts(case), _FEW, actual)
    return None if path is None else path.brief
