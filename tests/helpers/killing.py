"""Runs that are killed: commands in processes that are forked from one that has imported all."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import TYPE_CHECKING

from places import LINE_CASE

if TYPE_CHECKING:
    from coupling.export.exported_program import ExportedProgram, ExportOptions

PROGRAM = Path(__file__).parent / "logged_program.py"
# What is about the run itself, and differs between two runs of one case.
OF_THE_RUN = ("run.json", "report.html", "evaluations")

_context = multiprocessing.get_context("forkserver")
_PRELOADED = (
    "cli",
    "cli.identify_kinds",
    "run_to_folder",
    "export.exporting",
    "study.conduct",
    "identification.next.command",
    "identification.static.identification",
    "place.place",
    "report.identify_report",
    "report.place_report",
    "report.run_report",
)
_LIBRARIES = ("distributed", "plotly.graph_objects", "scipy.stats")
_context.set_forkserver_preload([*(f"coupling.{name}" for name in _PRELOADED), *_LIBRARIES])


def _command(arguments: Sequence[str], output: Path, missing: Sequence[str]) -> None:
    """What the child does: the command, its output in a file."""
    from drawn_robots import leave_out_drawn_robots

    from coupling.cli import main

    leave_out_drawn_robots()
    for package in missing:
        sys.modules[package] = None  # type: ignore[assignment]
    with output.open("a") as stream:
        for number in (1, 2):
            os.dup2(stream.fileno(), number)
        main(list(arguments))


@dataclass(frozen=True)
class Started:
    """A command that runs.

    Attributes:
        process: Its process.
        output: File with all that it prints.
    """

    process: BaseProcess
    output: Path

    def kill(self) -> None:
        """Kill it, and nothing that it has started."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.process.pid or 0, signal.SIGKILL)
        self.process.join()

    def send(self, number: int) -> None:
        os.kill(self.process.pid or 0, number)

    def ends_within(self, seconds: float) -> bool:
        self.process.join(seconds)
        return self.process.exitcode is not None

    def status(self) -> int | None:
        """Wait for its end and return its exit status."""
        self.process.join()
        return self.process.exitcode


def start(
    output: Path, *arguments: object, daemon: bool = True, missing: Sequence[str] = ()
) -> Started:
    """Start a command of elastic-robot.

    Args:
        output: File for all that it prints.
        arguments: What is typed behind the name.
        daemon: Whether it may not start processes of Python's.
        missing: Packages that are not installed where it runs.
    """
    words = [str(argument) for argument in arguments]
    process = _context.Process(target=_command, args=(words, output, missing), daemon=daemon)
    process.start()
    return Started(process, output)


def begin(work: Callable[..., None], *arguments: object) -> BaseProcess:
    """Let a function work in a process of its own."""
    process = _context.Process(target=work, args=arguments, daemon=True)
    process.start()
    return process


def wait_until(condition, seconds: float = 60.0) -> None:
    """Wait for something to become true."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


def files_of(folder: Path) -> dict[str, bytes]:
    """Return the result files of a run: all but what is about the run itself."""
    return {
        str(file.relative_to(folder)): file.read_bytes()
        for file in sorted(folder.rglob("*"))
        if file.is_file() and file.relative_to(folder).parts[0] not in OF_THE_RUN
    }


def logged_case(folder: Path, seconds: float) -> Path:
    """Write a short case whose process logs its evaluations in log.txt of the folder; return its file.

    Args:
        folder: Place of the case.
        seconds: Time that the process works on a path [s].
    """
    folder.mkdir(exist_ok=True)
    (folder / "program.py").write_text(PROGRAM.read_text())
    text = LINE_CASE.read_text()
    head, tail = text[: text.index("[process]")], text[text.index("[coupling]") :]
    words = [sys.executable, "-S", "{case}/program.py", str(seconds)]
    process = f'[process]\nmodel = "external"\ncommand = {words!r}\ntime_limit_s = 60.0\n\n'
    case = folder / "case.toml"
    case.write_text(head + process + tail)
    return case


def log_of(folder: Path) -> list[tuple[str, str]]:
    """Return what the process has logged: what happened, to which path."""
    file = folder / "log.txt"
    lines = file.read_text().splitlines() if file.exists() else []
    return [(line.split()[0], line.split()[1]) for line in lines]


def counts(log: Sequence[tuple[str, str]], what: str) -> Counter[str]:
    """Return how often something happened to every path."""
    return Counter(path for happened, path in log if happened == what)


def nothing() -> None:
    """Let the process that others are forked from start."""


def die_while_keeping(folder: Path, stage: str, who: str = "springs") -> None:
    """Evaluate a process with a store, and be killed at a stage of writing its entry."""
    import numpy as np

    from coupling.files import atomic_file
    from coupling.path.histories import ToolPath, WrenchHistory
    from coupling.process import ProcessResponse
    from coupling.store import EvaluatedProcess, Store

    def die(*_: object) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    class Dying:
        identity = who

        def evaluate(self, path: ToolPath) -> ProcessResponse:
            if stage == "opened":
                die()
            return ProcessResponse(WrenchHistory.of_forces(path.time, [2e5 * path.position[0]]))

    class Os:
        fsync = staticmethod(die if stage == "written" else os.fsync)
        replace = staticmethod(die if stage == "synced" else os.replace)

        def __getattr__(self, name: str) -> object:
            return getattr(os, name)

    atomic_file.os = Os()
    if stage == "renamed":
        atomic_file.sync_folder = die
    pose = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (50, 1))
    path = ToolPath(np.linspace(0.0, 1.0, 50), pose)
    EvaluatedProcess(Dying(), Store(folder)).evaluate(path)


def die_while_exporting(folder: Path, stage: str, text: str) -> None:
    """Export a program of one file, and be killed at a stage of writing its folder."""
    from coupling.export.exported_program import write_export
    from coupling.files import atomic_file, atomic_folder

    def die(*_: object) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    renamed: list[Path] = []

    def move(old: Path, new: Path) -> None:
        if stage == ("complete", "put aside")[min(len(renamed), 1)]:
            die()
        os.replace(old, new)
        renamed.append(new)

    class Os:
        def __getattr__(self, name: str) -> object:
            return getattr(os, name)

    class Renaming(Os):
        rename = staticmethod(move)

    class Syncing(Os):
        fsync = staticmethod(die if stage == "written" else os.fsync)

    atomic_folder.os, atomic_file.os = Renaming(), Syncing()
    if stage == "in place":
        atomic_folder.sync_folder = die
    exported, options = one_program(text)
    write_export(folder, [exported], options, overwrite=True)


def one_program(text: str) -> tuple[ExportedProgram, ExportOptions]:
    """Return a program of one file, WAY.src, with this text, as an export has it."""
    from coupling.export.exported_program import ExportedProgram, ExportOptions
    from coupling.path.deviation import Deviation
    from coupling.programs.languages import LANGUAGES
    from coupling.programs.program import ProgramFile, ProgramMove, RobotProgram
    from coupling.results.export_result import (
        ExportedFileResult,
        ExportedProgramResult,
        NearestSingularity,
    )

    start, end = (0.0,) * 6, (0.1,) * 6
    moves = (ProgramMove("joint", joints=start), ProgramMove("joint", joints=end, duration=1.0))
    none = Deviation(*[0.0] * 7)
    figures = ExportedProgramResult(
        robot="forming",
        program="WAY",
        files=(ExportedFileResult(name="WAY.src", bytes=len(text)),),
        points=2,
        points_on_every_cycle=2,
        points_tolerance_m=5e-6,
        shortest_time_s=1.0,
        median_time_s=1.0,
        loss_m=0.0,
        deviation_of_command_m=none,
        deviation_of_file_m=none,
        base=None,
        tool=None,
        counted_as_controller=True,
        nearest_singularity=NearestSingularity(time=0.0, value=1.0, kind="wrist"),
        drives=(),
    )
    files = (ProgramFile("WAY.src", text),)
    exported = ExportedProgram(RobotProgram("WAY", moves), files, figures)
    return exported, ExportOptions(LANGUAGES["krl"], "joints")


def hold_a_scratch_folder(place: Path) -> None:
    """Make a temporary folder in a place, and sleep."""
    import tempfile

    from coupling.files.scratch import ScratchFolder

    tempfile.tempdir = str(place)
    with ScratchFolder() as folder:
        (folder / "robot.fmu").write_text("")
        time.sleep(600.0)
