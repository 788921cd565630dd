"""Any program as a process: it finds path.csv in a fresh folder and leaves wrench.csv there."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo

from coupling.errors import CaseError, ProcessError
from coupling.events import Watch, unwatched
from coupling.files.csv_table import (
    POSE_COLUMNS,
    STIFFNESS_COLUMNS,
    WRENCH_COLUMNS,
    read_header,
    read_table,
    write_table,
)
from coupling.files.toml_file import FilePath, Positive
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.process.base import EVALUATIONS, ProcessResponse, ProcessTable, WithIdentity
from coupling.process.evaluation_folder import (
    PATH,
    RESTART,
    begin_evaluation,
    finish_evaluation,
    note_failure,
)
from coupling.process.frames import PoseFrame, poses_in, response_in_base
from coupling.process.program import OUTPUT, last_lines, quoted, run_program
from coupling.toolpaths.task import Task

WRENCH = "wrench.csv"
_RESTART = "{restart}"
# Largest error of an answered time, as a share of the shortest step: printed digits.
_TIME_TOLERANCE = 1e-3


@dataclass(frozen=True)
class ExternalProgram(WithIdentity):
    """A program that is run for every evaluation.

    Attributes:
        command: Program and arguments; {restart} in them stands for a folder in which the program finds
            the restart files that it wrote there before it was interrupted.
        time_limit: Time that one evaluation may take [s].
        part: base_from_part.
        frame: Frame of path.csv and wrench.csv: "part" or "base".
        folder: Place where every evaluation gets a folder of its own: 0001, 0002, ...
        watch: Function called with every line that the program prints.
    """

    command: tuple[str, ...]
    time_limit: float
    part: Frame
    frame: PoseFrame
    folder: Path
    watch: Watch = unwatched

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Run the program on a path and return its answer, base axes.

        Raises:
            ProcessError: With the program's last lines, if it fails or answers nonsense.
        """
        table = StringIO()
        poses = poses_in(self.frame, path, self.part)
        write_table(table, ("time", *POSE_COLUMNS), np.column_stack([path.time, poses]))
        with_restart = any(_RESTART in word for word in self.command)
        content = table.getvalue().encode()
        place = begin_evaluation(self.folder, self.identity, content, with_restart)
        restart = str((place / RESTART).resolve())
        command = [word.replace(_RESTART, restart) for word in self.command]
        try:
            run_program(command, place, self.time_limit, self.watch)
            rows = self._read(place, path)
        except ProcessError as cause:
            note_failure(place, str(cause))
            raise ProcessError(f"evaluation {place.name}: {cause}") from cause
        finish_evaluation(place)
        return response_in_base(self.frame, rows, path, self.part)

    def _read(self, folder: Path, path: ToolPath) -> np.ndarray:
        """Return times, wrenches and, if stated, stiffnesses that the program left, (n, 7 or 13)."""
        said = quoted(last_lines(folder)) if (folder / OUTPUT).exists() else ""
        if not (folder / WRENCH).is_file():
            raise ProcessError(f"{self.command[0]!r} wrote no {WRENCH}{said}")
        try:
            stiffness_columns = set(STIFFNESS_COLUMNS) & set(
                read_header(folder / WRENCH, ProcessError)
            )
            columns = WRENCH_COLUMNS + (STIFFNESS_COLUMNS if stiffness_columns else ())
            table = read_table(folder / WRENCH, ("time", *columns), ProcessError)
        except ProcessError as cause:
            problem = str(cause).removeprefix(f"{folder}/")
            raise ProcessError(
                f"{self.command[0]!r} gave an invalid result: {problem}{said}"
            ) from cause
        jumps = np.append(np.diff(table[:, 0]) == 0.0, False)
        if len(table) - np.count_nonzero(jumps) != len(path.time):
            raise ProcessError(
                f"{WRENCH}: expected {len(path.time)} rows, as in {PATH}, and two of the same time where"
                f" the force jumps, got {len(table)} rows of"
                f" {len(table) - np.count_nonzero(jumps)} times{said}"
            )
        if np.any(jumps[1:] & jumps[:-1]):
            row = int(np.argmax(jumps[1:] & jumps[:-1]))
            raise ProcessError(
                f"{WRENCH}: expected two rows of the same time where the force jumps, before and after"
                f" it, got more of {table[row, 0]:.9g} s{said}"
            )
        rows_of = np.append(0, np.cumsum(~jumps[:-1]))
        late = np.abs(table[:, 0] - path.time[rows_of])
        if late.max() > _TIME_TOLERANCE * np.diff(path.time).min():
            row = int(late.argmax())
            raise ProcessError(
                f"{WRENCH}: time: expected {path.time[rows_of[row]]:.9g} s, as in {PATH}, got"
                f" {table[row, 0]:.9g} s in row {row + 1}{said}"
            )
        table[:, 0] = path.time[rows_of]
        return table


def _fill_command(command: list[str], info: ValidationInfo) -> list[str]:
    """Put the case file's folder and this Python into a command."""
    folder = (info.context or {}).get("folder", Path()).resolve()
    return [
        word.replace("{case}", str(folder)).replace("{python}", sys.executable) for word in command
    ]


class ExternalTable(ProcessTable):
    """Keys: command, time_limit_s, frame ("part" unless given), files, retries.

    In the words of the command, {case} stands for the folder of the case file, {python} for the Python
    that runs this and {restart} for a folder for restart files.  files are what the answers depend on
    beside the words of the command that are files; a folder stands for all files in it.
    """

    WITHOUT_EFFECT: ClassVar[frozenset[str]] = frozenset({"time_limit_s"})

    model: Literal["external"]
    command: Annotated[list[str], Field(min_length=1), AfterValidator(_fill_command)]
    time_limit_s: Positive
    frame: PoseFrame = "part"
    files: list[FilePath] = []

    def process(self, task: Task) -> ExternalProgram:
        """Return the program as a process.

        Raises:
            CaseError: If the program or a file is not there.
        """
        if shutil.which(self.command[0]) is None:
            if Path(self.command[0]).is_file():
                raise CaseError(
                    f"process: command: {self.command[0]!r} is not executable: chmod +x, or name its"
                    " interpreter first"
                )
            raise CaseError(
                f"process: command: there is no program {self.command[0]!r}: give a name on the"
                " search path, or an absolute path ({case} is the folder of the case file)"
            )
        return ExternalProgram(
            tuple(self.command),
            self.time_limit_s,
            task.part,
            self.frame,
            task.workspace / EVALUATIONS,
            task.watch,
            identity=self.identity(task),
        )

    def own_files(self) -> Iterator[Path]:
        """Return the files among the words of the command, and those of `files`."""
        yield from (Path(word) for word in self.command if os.path.isfile(word))
        for file in self.files:
            if file.is_dir():
                yield from sorted(part for part in file.rglob("*") if part.is_file())
            else:
                yield file
