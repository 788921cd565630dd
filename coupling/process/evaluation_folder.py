"""The folder in which a program evaluates one path, and what a run that was killed has left in it.

A folder is marked as unfinished from its first moment to the moment its answer has been read.  Both
marks hold whose evaluation it is, so that an answer, a running program or restart files are only taken
for the same path of the same process.  One whose program has failed says so, and stays for people when
the same evaluation is tried again.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from coupling.process.program import RUNNING, STATUS, end_program, has_ended, is_running

# Mark of a folder, with the key of its evaluation.
FINISHED, UNFINISHED = "evaluation.json", "unfinished.json"
# Ending of the name of a folder that another attempt follows.
ASIDE = ".unfinished"
# Why the program failed, in its folder; ending of the name of one that was tried again, before a number.
FAILURE, FAILED = "failure.txt", ".failed"
PATH = "path.csv"
# Folder within that a program may use to go on where it was interrupted.
RESTART = "restart"


def mark_of(identity: str, path: bytes) -> str:
    """Return the mark of an evaluation: whose it is, and of which path.csv."""
    return json.dumps({"process": identity, PATH: hashlib.sha256(path).hexdigest()}, indent=1)


def finished_in(folder: Path) -> tuple[Path, ...]:
    """Return the finished evaluations in a folder, in their order."""
    return tuple(sorted(mark.parent for mark in folder.glob(f"*/{FINISHED}")))


def finished_as(earlier: Iterable[Path], mark: str) -> Path | None:
    """Return the one of some finished evaluations that has a mark, if there is one."""
    for folder in earlier:
        try:
            if (folder / FINISHED).read_text() == mark:
                return folder
        except OSError:  # removed in the meantime
            continue
    return None


def take_unfinished(old: Path, new: Path) -> None:
    """Move the evaluations without an answer from one place of evaluations to another, to go on there.

    Raises:
        OSError: If one cannot be moved.
    """
    for mark in list(old.glob(f"*/{UNFINISHED}")):
        target = new / mark.parent.name
        if not target.exists():
            new.mkdir(exist_ok=True)
            os.rename(mark.parent, target)


class EvaluationFolder:
    """The folder of the next evaluation.

    Args:
        parent: Place of all evaluations: 0001, 0002, ...
        mark: Mark of the evaluation.
    """

    def __init__(self, parent: Path, mark: str) -> None:
        numbers = [
            int(folder.name)
            for folder in parent.glob("[0-9]*")
            if folder.name.isdigit() and not (folder / UNFINISHED).exists()
        ]
        self.path = parent / f"{1 + max(numbers, default=0):04d}"
        self._aside = self.path.with_name(f"{self.path.name}{ASIDE}")
        self._mark = mark

    @property
    def can_be_taken_over(self) -> bool:
        """Whether a program that a killed run has started for this evaluation runs or has ended."""
        if not self._is_same(self.path) or (self.path / FAILURE).exists():
            return False
        return is_running(self.path) or has_ended(self.path)

    def fail(self, why: str) -> None:
        """Say that the program has failed; another attempt begins anew."""
        with suppress(OSError):  # a full disk, which is not why it has failed
            (self.path / FAILURE).write_text(f"{why}\n", encoding="utf-8")

    def begin(self, path: bytes, with_restart: bool) -> None:
        """Make the folder anew, with the path, and with restart files of an earlier attempt."""
        if self.path.exists():
            end_program(self.path)  # that of another evaluation, which nobody waits for
            self._set_aside()
        self.path.mkdir(parents=True)
        (self.path / UNFINISHED).write_text(self._mark)
        (self.path / PATH).write_bytes(path)
        if not with_restart:
            return
        attempts = (mark.parent for mark in self.path.parent.glob(f"*/{UNFINISHED}"))
        for attempt in sorted(attempts, key=_time_of, reverse=True):
            restart = attempt / RESTART
            if restart.is_dir() and self._is_same(attempt):
                os.rename(restart, self.path / RESTART)
                return
        (self.path / RESTART).mkdir()

    def finish(self) -> None:
        """Mark the folder as finished, and remove what attempts before it have left."""
        os.replace(self.path / UNFINISHED, self.path / FINISHED)
        for name in (RUNNING, STATUS):
            (self.path / name).unlink(missing_ok=True)
        shutil.rmtree(self._aside, ignore_errors=True)

    def _set_aside(self) -> None:
        """Give the folder of an attempt another name."""
        if (self.path / FAILURE).exists():
            number = 1 + max(map(_number, self._failed()), default=0)
            os.rename(self.path, self.path.with_name(f"{self.path.name}{FAILED}{number}"))
            return
        if self._aside.exists():
            shutil.rmtree(self._aside)
        os.rename(self.path, self._aside)

    def _failed(self) -> list[Path]:
        """Return the folders of the failed attempts at this evaluation's number, in their order."""
        candidates = self.path.parent.glob(f"{self.path.name}{FAILED}[0-9]*")
        return sorted((folder for folder in candidates if _number(folder)), key=_number)

    def _is_same(self, folder: Path) -> bool:
        try:
            return (folder / UNFINISHED).read_text() == self._mark
        except OSError:
            return False


def _time_of(folder: Path) -> float:
    """Return when an attempt has begun [s]."""
    with suppress(OSError):
        return (folder / UNFINISHED).stat().st_mtime
    return 0.0


def _number(folder: Path) -> int:
    """Return the number of the failed attempt in a folder, from 1; 0 where its name has none."""
    digits = folder.name.rpartition(FAILED)[2]
    return int(digits) if digits.isdigit() else 0
