"""Any program as a process: it finds path.csv in a fresh folder and leaves wrench.csv there."""

from __future__ import annotations

import os
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo

from coupling.errors import CaseError, ProcessError
from coupling.events import Said, Watch, unwatched
from coupling.files.csv_table import POSE_COLUMNS, WRENCH_COLUMNS, read_table, write_table
from coupling.files.toml_file import FilePath, Positive
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process.base import EVALUATIONS, Answer, Identified, ProcessTable
from coupling.process.frames import PoseFrame, poses_in, wrench_in_base
from coupling.process.program import last_lines, quoted, run_program
from coupling.toolpaths.part import Part
from coupling.toolpaths.task import Task

PATH, WRENCH = "path.csv", "wrench.csv"
# Largest error of an answered time, as a share of the shortest step: printed digits.
_TIME_TOLERANCE = 1e-3


@dataclass(frozen=True)
class External(Identified):
    """A program that is run for every evaluation.

    Attributes:
        command: Program and arguments.
        time_limit: Time that one evaluation may take [s].
        part: Placement of the part.
        frame: Frame of path.csv and wrench.csv: "part" or "base".
        folder: Place where every evaluation gets a folder of its own: 0001, 0002, ...
        reuse: Such a folder of an earlier run, or None; for a path that was answered there, the
            answer is taken and the program not run.
        watch: Function that is told what the program prints.
    """

    command: tuple[str, ...]
    time_limit: float
    part: Part
    frame: PoseFrame
    folder: Path
    reuse: Path | None = None
    watch: Watch = unwatched

    def evaluate(self, path: ToolPath) -> Answer:
        """Run the program on a path and return its answer, base axes.

        Raises:
            ProcessError: With the program's last lines, if it fails or answers nonsense.
        """
        number = 1 + sum(1 for _ in self.folder.glob("*")) if self.folder.exists() else 1
        folder = self.folder / f"{number:04d}"
        folder.mkdir(parents=True)
        poses = poses_in(self.frame, path, self.part)
        write_table(folder / PATH, ("time", *POSE_COLUMNS), np.column_stack([path.time, poses]))
        earlier = self._answered(folder / PATH)
        try:
            if earlier is None:
                run_program(self.command, folder, self.time_limit, self.watch)
            else:
                self.watch(Said(f"the answer to this path is taken from {earlier}"))
                shutil.copyfile(earlier, folder / WRENCH)
            answer = self._read(folder, path)
        except ProcessError as cause:
            raise ProcessError(f"evaluation {folder.name}: {cause}") from cause
        in_base = wrench_in_base(self.frame, answer, path, self.part)
        return Answer(WrenchHistory(path.time, in_base))

    def _answered(self, asked: Path) -> Path | None:
        """Return the wrench.csv of an earlier run for the same path, if there is one."""
        if self.reuse is None:
            return None
        for earlier in sorted(self.reuse.glob(f"*/{WRENCH}")):
            path = earlier.parent / PATH
            if path.is_file() and path.read_bytes() == asked.read_bytes():
                return earlier
        return None

    def _read(self, folder: Path, path: ToolPath) -> np.ndarray:
        """Return the wrenches that the program left, (n, 6)."""
        said = quoted(last_lines(folder)) if (folder / "output.txt").exists() else ""
        if not (folder / WRENCH).is_file():
            raise ProcessError(f"{self.command[0]!r} left no {WRENCH}{said}")
        try:
            table = read_table(folder / WRENCH, ("time", *WRENCH_COLUMNS), ProcessError)
        except ProcessError as cause:
            problem = str(cause).removeprefix(f"{folder}/")
            raise ProcessError(f"{self.command[0]!r} answered badly: {problem}{said}") from cause
        if len(table) != len(path.time):
            raise ProcessError(
                f"{WRENCH}: expected {len(path.time)} rows, as {PATH} has, got {len(table)}{said}"
            )
        late = np.abs(table[:, 0] - path.time)
        if late.max() > _TIME_TOLERANCE * np.diff(path.time).min():
            row = int(late.argmax())
            raise ProcessError(
                f"{WRENCH}: time: expected {path.time[row]:.9g} s, as {PATH} has, got"
                f" {table[row, 0]:.9g} s in row {row + 1}{said}"
            )
        return table[:, 1:]


def _filled(command: list[str], info: ValidationInfo) -> list[str]:
    """Put the case file's folder and this Python into a command."""
    folder = (info.context or {}).get("folder", Path()).resolve()
    return [
        word.replace("{case}", str(folder)).replace("{python}", sys.executable) for word in command
    ]


class ExternalTable(ProcessTable):
    """Keys: command, time_limit_s, frame ("part" unless given), reuse.

    In the words of the command, {case} stands for the folder of the case file and {python} for the
    Python that runs this.
    """

    model: Literal["external"]
    command: Annotated[list[str], Field(min_length=1), AfterValidator(_filled)]
    time_limit_s: Positive
    frame: PoseFrame = "part"
    reuse: FilePath | None = None

    def process(self, task: Task) -> External:
        """Return the program as a process.

        Raises:
            CaseError: If the program or the folder to reuse is not there.
        """
        if shutil.which(self.command[0]) is None:
            raise CaseError(
                f"process: command: there is no program {self.command[0]!r}: give a name on the"
                " search path, or an absolute path ({case} is the folder of the case file)"
            )
        if self.reuse is not None and not self.reuse.is_dir():
            raise CaseError(
                f"process: reuse: expected the folder {EVALUATIONS} of an earlier run, got"
                f" {self.reuse}, which is no folder"
            )
        return External(
            tuple(self.command),
            self.time_limit_s,
            task.part,
            self.frame,
            task.workspace / EVALUATIONS,
            self.reuse,
            task.watch,
            identity=self.identity(task),
        )

    def own_files(self) -> list[Path]:
        """Return the files among the words of the command."""
        return [Path(word) for word in self.command if os.path.isfile(word)]
