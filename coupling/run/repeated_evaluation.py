"""A second evaluation of the path that was evaluated last: is the process repeatable, or noisy?"""

from __future__ import annotations

from dataclasses import dataclass, replace

from coupling.case.case import Case
from coupling.errors import CaseError, ProcessError
from coupling.events import ProcessMessage, WarningEvent, Watch
from coupling.process import (
    ExternalTable,
    NoisySchema,
    ProcessFmuTable,
    ProcessResponse,
    ProcessTable,
)
from coupling.process.base import ProcessRequest
from coupling.process.noise import NoiseRemoval
from coupling.process.noise_filter import LowPass
from coupling.results.repeatability import ForceNoise, Repeatability
from coupling.solve.correction import Correction
from coupling.solve.scheme import Outcome
from coupling.store import EvaluatedProcess

# Folder in the workspace of the evaluation that is compared.
AGAIN = "asked_again"
# Longest time that the answer may have taken [s], as the comparison takes as long: at the end of a run
# that came to none, and on the way.
_LONGEST, _CHEAP = 600.0, 60.0
# A second evaluation may take this many times as long, where a time limit can end it.
_SLOWER = 2.0
# Outcomes of methods that would go on if the process answered alike.
WITHOUT_END = (Outcome.STAGNATED, Outcome.LIMIT_CYCLE, Outcome.DIVERGED, Outcome.EXHAUSTED)


@dataclass(frozen=True)
class RepeatedAnswers:
    """What second answers to a path tell of a process.

    Attributes:
        noise: Noise in its forces; None where it can have none, or is periodic.
        repeatability: Difference of two answers, to the last path where the method came to no end, to
            the first one where its forces are uneven; None where there are no two.
    """

    noise: ForceNoise | None
    repeatability: Repeatability | None
    evaluations: int


def repeat_answers(
    case: Case, process: EvaluatedProcess, correction: Correction, watch: Watch
) -> RepeatedAnswers:
    """Return what second answers tell: one that its noise asks for, one where a method did not end."""
    removal, last = process.noise_removal, None
    first = None if removal is None else removal.repeatability
    if first is None or not first.disturbs:
        last = _repeatability(case, process.last, correction, watch)
    return RepeatedAnswers(
        noise=None if removal is None else removal.noise,
        repeatability=last or first,
        evaluations=sum(comparison is not None for comparison in (first, last)),
    )


def _repeatability(
    case: Case, last: ProcessRequest | None, correction: Correction, watch: Watch
) -> Repeatability | None:
    """Return how a second answer to the last path differs, where the method came to no end."""
    if correction.outcome not in WITHOUT_END or last is None:
        return None
    second = _second_response(case, last, _LONGEST, watch)
    return None if second is None else Repeatability.of(last.response.wrench, second.wrench)


def noise_removal(case: Case, watch: Watch) -> NoiseRemoval | None:
    """Return the removal of the noise in the forces of a case's process; None where it can have none.

    Forces of programs that are uneven are compared with those of a second evaluation of the same path
    where that takes no more than a minute: only what differs is noise, unless the case has a cutoff.
    """
    table = case.process_table
    if not isinstance(table, NoisySchema):
        return None

    def second_answer(first: ProcessRequest) -> ProcessResponse | None:
        return _second_response(case, first, _CHEAP, watch)

    low_pass = table.low_pass(case.motion.path)
    asks = isinstance(table, ProcessTable) and not isinstance(low_pass, LowPass)
    return NoiseRemoval(low_pass, second_answer if asks else None)


def _second_response(
    case: Case, first: ProcessRequest, longest: float, watch: Watch
) -> ProcessResponse | None:
    """Return a second answer to a path; None where it is not to be had.

    It is computed whatever is kept, in a folder of its own.  The shipped models, which answer alike, are
    not evaluated, nor is a process that takes too long or has become another one meanwhile.

    Args:
        longest: Longest time that it may have taken [s].
    """
    if not isinstance(case.process_table, ProcessTable) or first.seconds > longest:
        return None
    process = _anew(case, _SLOWER * longest, watch)
    if process is None:
        return None
    watch(ProcessMessage("evaluating the last path again to check the repeatability"))
    try:
        return process.computed(first.path)
    except ProcessError as error:
        watch(WarningEvent(f"the process failed in a second evaluation on the last path: {error}"))
        return None


def _anew(case: Case, longest: float, watch: Watch) -> EvaluatedProcess | None:
    """Return the process without what it has answered so far; None where it is another one.

    An answer that a killed run has left comes at once, however long it took: the time is limited.
    """
    task = replace(case.task, workspace=case.task.workspace / AGAIN)
    table = case.process_table
    if isinstance(table, ExternalTable | ProcessFmuTable):
        limit = min(table.time_limit_s, longest)
        table = table.model_copy(update={"time_limit_s": limit})
    try:
        process = table.process(task)
    except CaseError:  # its files are gone
        return None
    if process.identity != case.process.identity:
        return None
    return replace(case, process=process).evaluated_process(watch=watch)
