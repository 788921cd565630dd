"""run.json, what a run tells of itself, and what pages need of its case.toml."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from coupling.events import Event
from coupling.results.base import ResultFile, ResultPart
from coupling.results.iteration_result import Evaluation
from coupling.results.run_result import Three


class StoredAnswer(ResultPart, Event):
    """A process has answered, or the store has in its place.

    Attributes:
        key: Key of the answer; empty where the process has no identity.
    """

    key: str
    origin: Annotated[Literal["computed", "store"], Field(alias="from")]
    seconds: float


class RunState(ResultFile):
    """What a run tells of itself while it goes on and afterwards."""

    what = "the state of a run"
    sparse: ClassVar = ("durations_s", "reason")

    state: str
    kind: str | None = None
    case: str | None = None
    store: str | None = None
    host: str = ""
    pid: int = 0
    started: str = ""
    changed: str = ""
    waiting: str | None = None
    answers: tuple[StoredAnswer, ...] = ()
    evaluations: tuple[Evaluation, ...] = ()
    warnings: tuple[str, ...] = ()
    durations_s: dict[str, float] | None = None
    reason: str | None = None


class _CaseProcess(ResultPart):
    model: str


class _CasePart(ResultPart):
    position_m: Three
    rpy_deg: Three
    tolerance_mm: float | None = None


class _CaseCompensation(ResultPart):
    method: str = ""


class RunCase(ResultPart):
    """What a page tells of a run's case."""

    process: _CaseProcess
    part: _CasePart
    compensation: _CaseCompensation = _CaseCompensation()
