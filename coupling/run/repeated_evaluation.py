"""Repeated evaluation of the last path, where a run has not converged: is the process repeatable?"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

from coupling.case.case import Case
from coupling.errors import CaseError, ProcessError
from coupling.events import ProcessMessage, WarningEvent, Watch
from coupling.path.deviation import measure
from coupling.path.histories import ToolPath
from coupling.process import Process, ProcessResponse, ProcessTable
from coupling.process.base import ProcessWrapper
from coupling.process.repeatability import Repeatability
from coupling.run.kept_process import checked_process
from coupling.solve.correction import Correction
from coupling.solve.outcome import Outcome
from coupling.store import StoredProcess

# Folder in the workspace of the evaluation that is compared.
AGAIN = "asked_again"
# Longest time that the answer may have taken [s]: the comparison takes as long.
_LONGEST = 600.0
_WITHOUT_END = (Outcome.STAGNATED, Outcome.LIMIT_CYCLE, Outcome.DIVERGED, Outcome.EXHAUSTED)


@dataclass(frozen=True)
class ProcessRequest:
    """One evaluation of a process.

    Attributes:
        path: The path.
        response: Its answer.
        seconds: Time that computing it took [s].
    """

    path: ToolPath
    response: ProcessResponse
    seconds: float


class RememberedProcess(ProcessWrapper):
    """A process that remembers its last evaluation."""

    def __init__(self, process: Process) -> None:
        self.process = process
        self.last: ProcessRequest | None = None

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return the process's answer to a path, and remember both."""
        begin = time.perf_counter()
        response = self.process.evaluate(path)
        seconds = time.perf_counter() - begin
        if isinstance(self.process, StoredProcess):
            seconds = max(seconds, self.process.seconds(path))
        self.last = ProcessRequest(path, response, seconds)
        return response


def repeated_evaluation(
    case: Case, last: ProcessRequest | None, found: Correction, watch: Watch
) -> Repeatability | None:
    """Return how a second answer to the last path differs, where the method came to no end.

    The answer is computed whatever is kept, in a folder of its own.  The shipped models, which answer
    alike, are not evaluated, nor is a process that takes too long or has become another one meanwhile.

    Args:
        last: Last request to its process.
        found: Result of the method.
        watch: Function called with what happens.
    """
    if not isinstance(case.process_table, ProcessTable) or found.outcome not in _WITHOUT_END:
        return None
    if last is None or last.seconds > _LONGEST:
        return None
    process = _anew(case, watch)
    if process is None:
        return None
    watch(ProcessMessage("evaluating the last path again to check the repeatability"))
    try:
        return Repeatability.of(last.response, process.evaluate(last.path))
    except ProcessError as error:
        watch(WarningEvent(f"the process failed in a second evaluation on the last path: {error}"))
        return None


def explained(found: Correction, kind: str, repeated: Repeatability | None) -> Correction:
    """Return a correction whose reason says that the process answers differently, where it does.

    Args:
        kind: "couple" or "compensate".
        repeated: Difference of two responses to its last path; None where it was evaluated once.
    """
    if repeated is None:
        return found
    reason = found.reason
    if repeated.disturbs:
        left, what = (
            (found.consistency, "the path still changes by up to")
            if kind == "couple"
            else (measure(found.achieved, found.desired).maximum, "the deviation is up to")
        )
        reason = f"{repeated.sentence()}; {what} {1e6 * left:.4g} um"
    elif not repeated.identical:
        reason = f"{reason}; and {repeated.sentence()}"
    return replace(found, reason=reason, evaluations=found.evaluations + 1)


def _anew(case: Case, watch: Watch) -> Process | None:
    """Return the process without what it has answered so far; None where it is another one."""
    task = replace(case.task, workspace=case.task.workspace / AGAIN)
    try:
        process = case.process_table.process(task)
    except CaseError:  # its files are gone
        return None
    if process.identity != case.process.identity:
        return None
    return checked_process(replace(case, process=process), watch)
