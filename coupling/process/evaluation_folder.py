"""Folders in which a program evaluates a path each: 0001, 0002, ...

A folder is marked as unfinished from its first moment to the moment its answer has been read.  The mark
holds whose evaluation it is, so that restart files are only passed on to the same path of the same
process.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from contextlib import suppress
from pathlib import Path

from coupling.process.program import end_programs

# Mark of an attempt that has no answer.
UNFINISHED = "unfinished.json"
# Why the program failed, in the folder of its attempt.
FAILURE = "failure.txt"
PATH = "path.csv"
# Folder within that a program may use to go on where it was interrupted.
RESTART = "restart"


def begin_evaluation(place: Path, identity: str, path: bytes, with_restart: bool) -> Path:
    """Make the folder of an evaluation and return it; what a killed run has begun is ended.

    Args:
        place: Place of all evaluations.
        identity: Identity of the process.
        path: Content of path.csv.
        with_restart: Whether it has a folder for restart files, with those of the last attempt.
    """
    digest = hashlib.sha256(path).hexdigest()
    mark = json.dumps({"process": identity, PATH: digest}, indent=1)
    attempts = sorted(file.parent for file in place.glob(f"*/{UNFINISHED}"))
    killed = [attempt for attempt in attempts if not (attempt / FAILURE).exists()]
    if killed:
        end_programs(place)
    numbers = [int(folder.name) for folder in place.glob("[0-9]*") if folder.name.isdigit()]
    folder = place / f"{1 + max(numbers, default=0):04d}"
    folder.mkdir(parents=True)
    (folder / UNFINISHED).write_text(mark)
    (folder / PATH).write_bytes(path)
    same = [attempt for attempt in attempts if _mark_of(attempt) == mark]
    if with_restart:
        folders = [attempt / RESTART for attempt in same if (attempt / RESTART).is_dir()]
        if folders:
            os.rename(folders[-1], folder / RESTART)
        else:
            (folder / RESTART).mkdir()
    for attempt in same:
        if attempt in killed:
            shutil.rmtree(attempt, ignore_errors=True)
    return folder


def finish_evaluation(folder: Path) -> None:
    """Say that the answer in a folder has been read."""
    (folder / UNFINISHED).unlink()


def note_failure(folder: Path, why: str) -> None:
    """Say in a folder why its program has failed."""
    with suppress(OSError):  # a full disk, which is not why it has failed
        (folder / FAILURE).write_text(f"{why}\n", encoding="utf-8")


def move_unfinished(source: Path, target: Path) -> None:
    """Move the attempts without an answer from one place of evaluations to another, to go on there.

    Raises:
        OSError: If one cannot be moved.
    """
    for mark in list(source.glob(f"*/{UNFINISHED}")):
        folder = target / mark.parent.name
        if not folder.exists():
            target.mkdir(exist_ok=True)
            os.rename(mark.parent, folder)


def _mark_of(attempt: Path) -> str:
    with suppress(OSError, UnicodeDecodeError):
        return (attempt / UNFINISHED).read_text()
    return ""
