"""What a run tells of itself while it goes on and afterwards: run.json.

All that differs between two runs of one case stands there, such as times and what was computed anew;
the other files are the same for the same case.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from coupling.errors import ResultError
from coupling.events import Event, WarningEvent
from coupling.files.atomic_file import AtomicFile
from coupling.files.written_files import claim_file, is_of_kind
from coupling.results.run_result import RunResult
from coupling.results.run_state import RunState, StoredAnswer
from coupling.run.stored_run import RESULT, RUN
from coupling.solve.fixed_point import Evaluated
from coupling.solve.scheme import Outcome
from coupling.store import WaitingForOther

# Kind of the folder of a run.
KIND = "run"


def _now() -> str:
    return datetime.now().astimezone().isoformat(timespec="seconds")


class RunLog:
    """The file run.json of a run, written at the start, at every evaluation and at the end.

    Its state is "running", "finished", "interrupted" or "failed"; one that is "running" while no
    process holds the folder was killed.

    Args:
        kind: Command that runs: "couple", "compensate" or "place".

    Raises:
        OSError: If the file cannot be written.
    """

    def __init__(self, folder: Path, kind: str, case: Path, store: str | None) -> None:
        self._file = claim_file(folder / RUN)
        self._content = RunState(
            state="running",
            kind=kind,
            case=str(case.resolve()),
            store=store,
            host=platform.node(),
            pid=os.getpid(),
            started=_now(),
        )
        self._write()

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the process's answers so far, in their order."""
        return tuple(answer.key for answer in self._content.answers)

    def watch(self, event: Event) -> None:
        """Note what happens."""
        content = self._content
        with suppress(OSError):  # a disk that is full meanwhile does not end the run
            match event:
                case StoredAnswer():
                    answer = event.model_copy(update={"seconds": round(event.seconds, 3)})
                    self._write(answers=(*content.answers, answer), waiting=None)
                case Evaluated(evaluation):
                    self._write(evaluations=(*content.evaluations, evaluation))
                case WaitingForOther(text):
                    self._write(waiting=text)
                case WarningEvent(text):
                    self._write(warnings=(*content.warnings, text))

    def finish(self, durations: Mapping[str, float]) -> None:
        """Say that all files are written.

        Args:
            durations: Wall time by part [s].
        """
        self._write(state="finished", waiting=None, durations_s=dict(durations))

    def stop(self, error: BaseException) -> None:
        """Say that the run has ended before its end, where it can be written."""
        interrupted = isinstance(error, KeyboardInterrupt)
        state, reason = ("interrupted", "by hand") if interrupted else ("failed", str(error))
        with suppress(OSError):
            self._write(state=state, waiting=None, reason=reason)

    def _write(self, **changes: object) -> None:
        self._content = self._content.model_copy(update={**changes, "changed": _now()})
        AtomicFile(self._file).write([self._content.text().encode()])


def read_log(folder: Path) -> RunState | None:
    """Return the content of a folder's run.json; None where there is none that can be read."""
    with suppress(ResultError):
        return RunState.read(folder / RUN, ResultError)
    return None


def is_run(folder: Path) -> bool:
    """Return whether a folder is that of a run, finished or not."""
    return is_of_kind(folder, KIND) or read_log(folder) is not None or (folder / RESULT).exists()


def is_finished(folder: Path) -> bool:
    """Return whether a folder holds a whole result; one without run.json is of an earlier version."""
    log = read_log(folder)
    return (folder / RESULT).exists() if log is None else log.state == "finished"


def is_to_go_on(folder: Path, kind: str, case: Path) -> bool:
    """Return whether a folder holds the result of a command whose process has failed on the way."""
    log = read_log(folder)
    if log is None or (log.state, log.kind, log.case) != ("finished", kind, str(case.resolve())):
        return False
    with suppress(ResultError):
        return RunResult.read(folder / RESULT, ResultError).outcome == Outcome.PROCESS_FAILED
    return False
