"""The cut of a command, where its process is milling: its figures, and whether it chatters."""

from __future__ import annotations

from dataclasses import dataclass

from coupling.errors import PlanningError, StabilityError
from coupling.results.cut_result import CutResult
from coupling.results.cut_stability import CutStability
from coupling.results.mean_force import MeanForceAcross
from coupling.run.check import Check, CheckedCommand
from coupling.run.cut_figures import cut_result
from coupling.run.cut_force import mean_force_across
from coupling.stability.path_stability import stability_in_brief


@dataclass(frozen=True)
class CutFinding:
    """Finding on a cut.

    Attributes:
        stability: Stability of the cut; None where nothing is milled, or it is not known.
        cut: Figures of the cut; None where nothing is milled.
        force: Mean force across the feed, likewise.
        remarks: Reason why its stability is not known, as sentences.
    """

    stability: CutStability | None = None
    cut: CutResult | None = None
    force: MeanForceAcross | None = None
    remarks: tuple[str, ...] = ()


def _compute(command: CheckedCommand) -> CutFinding:
    """Return whether it chatters, or why that is not known, which spoils no result."""
    cut, force = cut_result(command.case), mean_force_across(command)
    try:
        stability = stability_in_brief(command.case, command.correction.achieved)
        return CutFinding(stability, cut, force)
    except (PlanningError, StabilityError) as error:
        return CutFinding(None, cut, force, (f"whether the cut chatters is not known: {error}",))


CUT_STABILITY = Check("stability", _compute, CutFinding())
