"""Whether the cut of a command chatters, where its process is milling."""

from __future__ import annotations

from dataclasses import dataclass, replace

from coupling.errors import PlanningError, StabilityError
from coupling.results.cut_stability import CutStability
from coupling.run.check import Check, CheckedCommand
from coupling.solve.correction import Correction
from coupling.solve.outcome import Outcome
from coupling.stability.path_stability import stability_in_brief


@dataclass(frozen=True)
class CutFinding:
    """Finding on a cut.

    Attributes:
        stability: Stability of the cut; None where nothing is milled, or it is not known.
        remarks: Reason why it is not known, as sentences.
    """

    stability: CutStability | None = None
    remarks: tuple[str, ...] = ()


def _compute(command: CheckedCommand) -> CutFinding:
    """Return whether it chatters, or why that is not known, which spoils no result."""
    try:
        return CutFinding(stability_in_brief(command.case))
    except (PlanningError, StabilityError) as error:
        return CutFinding(remarks=(f"whether the cut chatters is not known: {error}",))


def told_of_chatter(command: CheckedCommand, correction: Correction) -> Correction:
    """Return a correction whose verdict says that the cut chatters, where it does.

    Then it is the cut that is at fault, whatever the iteration has come to.
    """
    stability = command.of(CUT_STABILITY).stability
    if stability is None or stability.stable:
        return correction
    reason = (
        f"{stability.sentence[:1].lower()}{stability.sentence[1:]}; stable would be"
        f" {stability.alternative}; the iteration: {correction.reason}"
    )
    return replace(correction, outcome=Outcome.CHATTERS, reason=reason)


CUT_STABILITY = Check("stability", _compute, CutFinding())
