"""What a run tells of itself while it goes on and afterwards: run.json.

All that differs between two runs of one case stands there, such as times and what was computed anew;
the other files are the same for the same case.
"""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Mapping
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Any

from coupling.events import Event, Warned
from coupling.files.whole_file import WholeFile
from coupling.process.base import EVALUATIONS
from coupling.run.figures import evaluation_figures
from coupling.run.stored_run import RESULT, RUN
from coupling.solve.fixed_point import Evaluated
from coupling.store import Answered, Waits


def _now() -> str:
    return datetime.now().astimezone().isoformat(timespec="seconds")


class RunLog:
    """The file run.json of a run, written at the start, at every evaluation and at the end.

    Its state is "running", "finished", "interrupted" or "failed"; one that is "running" while no
    process holds the folder was killed.

    Args:
        folder: Folder of the run.
        about: What to say of the run from its start: kind, case, store.

    Raises:
        OSError: If the file cannot be written.
    """

    def __init__(self, folder: Path, about: Mapping[str, str | None]) -> None:
        self._file = folder / RUN
        self._content: dict[str, Any] = {
            "state": "running",
            **about,
            "host": platform.node(),
            "pid": os.getpid(),
            "started": _now(),
            "changed": _now(),
            "waiting": None,
            "answers": [],
            "evaluations": [],
            "warnings": [],
        }
        self._write()

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the process's answers so far, in their order."""
        return tuple(answer["key"] for answer in self._content["answers"])

    def answers_from(self, origin: str) -> int:
        """Return how many answers were "computed" or came from the "store"."""
        return sum(answer["from"] == origin for answer in self._content["answers"])

    def watch(self, event: Event) -> None:
        """Note what happens."""
        match event:
            case Answered(key, origin, seconds):
                told = {"key": key, "from": origin, "seconds": round(seconds, 3)}
                self._content["answers"].append(told)
                self._content["waiting"] = None
            case Evaluated(evaluation):
                self._content["evaluations"].append(evaluation_figures(evaluation))
            case Waits(text):
                self._content["waiting"] = text
            case Warned(text):
                self._content["warnings"].append(text)
            case _:
                return
        with suppress(OSError):  # a disk that is full meanwhile does not end the run
            self._write()

    def finish(self, durations: Mapping[str, float]) -> None:
        """Say that all files are there.

        Args:
            durations: Wall time by part [s].

        Raises:
            OSError: If it cannot be written.
        """
        folder = self._file.parent
        for file in folder.rglob("*"):
            if file.is_file() and not file.is_relative_to(folder / EVALUATIONS):
                _sync(file)
        self._end("finished", durations_s=dict(durations))

    def stop(self, error: BaseException) -> None:
        """Say that the run has ended before its end, where it can be written.

        Args:
            error: Why: the run was interrupted, or has failed.
        """
        interrupted = isinstance(error, KeyboardInterrupt)
        state, reason = ("interrupted", "by hand") if interrupted else ("failed", str(error))
        with suppress(OSError):
            self._end(state, reason=reason)

    def _end(self, state: str, **more: object) -> None:
        self._content |= {"state": state, "waiting": None, **more}
        self._write()

    def _write(self) -> None:
        self._content["changed"] = _now()
        WholeFile(self._file).write([json.dumps(self._content, indent=1).encode()])


def read_log(folder: Path) -> dict[str, Any]:
    """Return the content of a folder's run.json, empty where there is none that can be read."""
    try:
        content = json.loads((folder / RUN).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def is_run(folder: Path) -> bool:
    """Return whether a folder is that of a run, finished or not."""
    return "state" in read_log(folder) or (folder / RESULT).exists()


def is_finished(folder: Path) -> bool:
    """Return whether a folder holds a whole result; one without run.json is of an earlier version."""
    state = read_log(folder).get("state")
    return state == "finished" or (state is None and (folder / RESULT).exists())


def _sync(file: Path) -> None:
    with file.open("rb") as stream, suppress(OSError):
        os.fsync(stream.fileno())
