"""Write the tables of docs/export.md from runs of three cases: make export."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from coupling.case.case import Case
from coupling.export.exported import ExportedProgram, ExportOptions
from coupling.export.exporting import export_run
from coupling.path.controller import Controller
from coupling.path.joint_path import JointPath
from coupling.programs.languages import LANGUAGES
from coupling.run.folder import write_run
from coupling.run.models import Models, cell_of
from coupling.run.stored_run import read_run
from docs.scripts.page import finish, replace_parts, table
from docs.scripts.runs import compensated, example

CASES = ("cone", "milling_20000", "iso9283")
# The last of them ten times as fast.
_FAST = "iso9283_fast"
# What the tables above have as least time between targets [s].
_CLOSEST = 0.004
# Of sensor interfaces [s].
CYCLES = (0.004, 0.012)


@cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory()


@cache
def _run(name: str) -> tuple[Path, Case]:
    """Return the run folder of a case."""
    keys: dict[str, float | str] = {"feed_m_s": 1.0} if name == _FAST else {}
    changes = {"tool_path": keys} if keys else {}
    case, folder = example(name.removesuffix("_fast"), **changes), Path(_folder().name, name)
    folder.mkdir()
    write_run(folder, case, compensated(case))
    return folder, case


@cache
def _exported(name: str, language: str) -> ExportedProgram:
    own = LANGUAGES[language]
    closest = None if own.dense else _CLOSEST
    (found,) = export_run(_run(name)[0], ExportOptions(own, own.targets[0], shortest=closest))
    return found


def programs() -> str:
    """Return points, bytes and loss of every case in every language."""

    def rows() -> Iterator[tuple[str, ...]]:
        for name in CASES:
            for language in LANGUAGES:
                one = _exported(name, language)
                assert one.command is not None
                assert one.read_back is not None
                yield (
                    f"`{name}`",
                    language,
                    f"{one.points} of {one.candidates}",
                    f"{1e-3 * one.bytes:.0f}",
                    _um(one.command.maximum),
                    _um(one.read_back.maximum),
                    _um(one.loss),
                )

    head = ("case", "language", "points", "kB", "command [um]", "file [um]", "loss [um]")
    return table(head, rows())


def cycles() -> str:
    """Return what rows of angles lose as samples of the command, and as they are written."""

    def rows() -> Iterator[tuple[str, ...]]:
        for name in (*CASES, _FAST):
            for cycle in CYCLES:
                csv = LANGUAGES["csv"]
                (one,) = export_run(_run(name)[0], ExportOptions(csv, "joints", cycle=cycle))
                yield (
                    f"`{name}`" if name != _FAST else "`iso9283` at 1 m/s",
                    f"{1e3 * cycle:.0f} ms",
                    _um(_of_samples(name, cycle)),
                    _um(one.loss),
                )

    return table(("case", "cycle", "loss of samples [um]", "loss of the file [um]"), rows())


def _of_samples(name: str, cycle: float) -> float:
    """Return the loss of the command's own angles on a cycle [m]."""
    folder, case = _run(name)
    stored = read_run(folder).first
    own = stored.joints
    time = Controller(cycle).rows(own.time[0], own.time[-1])
    samples = JointPath(time, (own.trajectory.at(time.clip(max=own.time[-1]))[0],))
    with Models(case.fmu) as models:
        cell, _ = cell_of(case.robots, models)
        command = cell.simulate(own, stored.wrench, "dynamic")
        return float(cell.simulate(samples, stored.wrench, "dynamic").distance_to(command).max())


def _um(length: float) -> str:
    return f"{1e6 * length:.2f}"


PARTS = {"programs": programs, "cycles": cycles}

if __name__ == "__main__":
    sys.exit(finish(lambda: replace_parts("export", PARTS, sys.argv[1:])))
