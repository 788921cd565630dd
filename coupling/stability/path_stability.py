"""Stability along the path of a case: every place judged, the worst one looked at closely."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.case.case import Case
from coupling.errors import StabilityError
from coupling.path.histories import ToolPath
from coupling.results.cut_result import CutStability
from coupling.stability.case_cut import CaseCuts, PlacedCut, is_milling
from coupling.stability.floquet import vibration_of
from coupling.stability.judgement import Judgement, in_words

# Places of a path that are judged, and those nearest to chatter whose limits are enough in brief.
PLACES, _FEW = 60, 6
# Speeds of which one is looked for that is stable.
_SPEEDS = 60
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
            places: Number of places at most: those that differ most.
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
        placed = most_different(along, places)
        if actual is not None and not (placed := cuts.as_deep_as(actual, placed)):
            return None
        return cls(tuple(Judgement.of(cuts, cut) for cut in placed))

    @classmethod
    def in_brief(cls, cuts: CaseCuts, actual: ToolPath | None = None) -> PathStability | None:
        """Return the same of the cuts that are nearest to chatter, by their growth and by zero order.

        Args:
            cuts, actual: As of `of`.
        """
        path = cls.of(cuts, PLACES, actual)
        if path is None:
            return None
        growth = np.array([judgement.vibration.growth for judgement in path.judgements])
        margin = [judgement.zero_order_margin for judgement in path.judgements]
        nearest = np.union1d(np.argsort(-growth)[:_FEW], np.argsort(margin)[:_FEW])
        return cls(tuple(path.judgements[row] for row in nearest.tolist()))

    @cached_property
    def worst(self) -> Judgement:
        """The cut that grows fastest where any grows, else the one nearest to its limit."""
        fastest = max(self.judgements, key=lambda judgement: judgement.vibration.growth)
        if not fastest.is_stable:
            return fastest
        # By zero order where none has a limit.
        return min(
            self.judgements,
            key=lambda judgement: (judgement.margin, judgement.zero_order_margin),
        )

    @property
    def is_stable(self) -> bool:
        """Whether no cut chatters."""
        return self.worst.is_stable

    @property
    def chatters_clearly(self) -> bool:
        """Whether a cut chatters even if its mean force lifts the tool."""
        return any(judgement.chatters_clearly for judgement in self.judgements)

    @property
    def sentence(self) -> str:
        """Whether it chatters and where, in words."""
        worst = self.worst
        whose = "robot and tool" if worst.cuts.tool else "the robot alone, the tool taken as rigid"
        if worst.there.is_undamped:
            whose += "; the robot's file states no damping"
        is_or_not = "is " if worst.is_stable else ""
        time = f" (t = {worst.placed.time:.2f} s)" if worst.placed.time is not None else ""
        return f"The cut {is_or_not}{in_words(worst)}{time}; {self._depth_in_words}; judged for {whose}"

    @property
    def _depth_in_words(self) -> str:
        """The worst cut's depth, programmed and, where it is another one, actual."""
        depth, programmed = self.worst.placed.cut.depth, self.worst.placed.programmed_depth
        if abs(depth - programmed) <= _SAME_DEPTH * programmed:
            return f"{1e3 * programmed:.3g} mm deep, as programmed"
        return (
            f"programmed {1e3 * programmed:.3g} mm, {1e3 * depth:.3g} mm by a robot that gives way"
        )

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


def most_different(along: Sequence[PlacedCut], count: int) -> tuple[PlacedCut, ...]:
    """Return so many cuts at most, in order of time, that every other one is near to one of them.

    Corners, entries and passes in one direction are short: equal steps of time would miss them.  Cuts
    differ in depth, arc, direction of the feed and place along the path; the first is the largest.
    """
    sections = np.array([cut.section for cut in along])
    depths = np.array([cut.cut.depth for cut in along])
    features = np.column_stack(
        [
            sections / sections.max(),
            depths / depths.max(),
            np.array([cut.cut.arcs[0][:2] for cut in along]) / np.pi,
            [(0.5 * np.cos(cut.feed), 0.5 * np.sin(cut.feed)) for cut in along],
            np.linspace(0.0, 1.0, len(along)),
        ]
    )
    chosen = [int(np.argmax(sections))]
    distance = np.full(len(along), np.inf)
    while len(chosen) < count:
        step = np.linalg.norm(features - features[chosen[-1]], axis=1)
        distance = np.minimum(distance, step)
        if not distance.max() > 0.0:
            break
        chosen.append(int(np.argmax(distance)))
    return tuple(along[row] for row in sorted(chosen))


def stability_in_brief(case: Case, actual: ToolPath | None = None) -> CutStability | None:
    """Return the stability along a case's path in brief; None where nothing is milled.

    Args:
        actual: Path that the tool takes, in the world; None: that of the program.

    Raises:
        PlanningError: If the robot cannot follow the path.
        StabilityError: If it has no equilibrium at a place, or nothing gives way.
    """
    if not is_milling(case):
        return None
    path = PathStability.in_brief(CaseCuts(case), actual)
    return None if path is None else path.brief
