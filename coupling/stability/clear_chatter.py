"""A cut that chatters whatever path its tool takes: judged before a command is computed."""

from __future__ import annotations

from collections.abc import Sequence

from coupling.case.case import Case
from coupling.errors import CouplingError, PlanningError, StabilityError
from coupling.events import Progress, WarningEvent, Watch
from coupling.results.stability_result import StabilityResult
from coupling.stability.analysis import stability_along_path
from coupling.stability.case_cut import CaseCuts, is_milling
from coupling.stability.path_stability import PathStability


class ClearChatterError(CouplingError):
    """A cut chatters clearly, and no command is computed.

    Attributes:
        stability: Verdict and limits over speed, feed and place.
    """

    def __init__(self, stability: StabilityResult) -> None:
        super().__init__(f"{stability.case}: {stability.sentence}")
        self.stability = stability


def refuse_clear_chatter(case: Case, file: str, words: Sequence[str], watch: Watch) -> None:
    """Refuse a cut that chatters clearly, as `Judgement.chatters_clearly` says.

    A case that mills nothing or cannot be judged is not refused; its command says why.

    Args:
        file: Its file, as commands name it.
        words: Words of the command that would compute it.
        watch: Function called with the verdict, and then with the progress of its limits.

    Raises:
        ClearChatterError: If the cut of the case does.
    """
    if not is_milling(case):
        return
    watch(Progress("judging whether the cut chatters", 0, 1))
    try:
        cuts = CaseCuts(case)
        path = PathStability.in_brief(cuts)
        if path is None or not path.chatters_clearly:
            return
    except (PlanningError, StabilityError):
        return
    watch(WarningEvent(f"{path.sentence}: no command is computed, only the limits of this cut"))
    limits = stability_along_path(cuts, watch)
    raise ClearChatterError(
        limits.model_copy(update={"case_file": file, "instead_of": tuple(words)})
    )
