"""Write the tables of docs/export.md from runs of three cases: make export."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
from scipy.interpolate import BPoly

from coupling.case.case import Case
from coupling.export.exported import ExportedProgram, ExportOptions
from coupling.export.exporting import export_run
from coupling.export.interpolated import drive_motion
from coupling.files.controller_axes import controller_axes
from coupling.files.robot_file import find_robot
from coupling.path.controller import Controller
from coupling.path.joint_path import JointPath
from coupling.programs.languages import LANGUAGES
from coupling.run.folder import write_run
from coupling.run.models import Models, cell_of
from coupling.run.stored_run import read_run
from docs.scripts.page import finish, replace_parts, table
from docs.scripts.runs import CASES as CASES_FOLDER
from docs.scripts.runs import compensated, example

CASES = ("cone", "milling_20000", "iso9283")
# The last of them ten times as fast.
_FAST = "iso9283_fast"
# Cases whose targets are set apart, and least times between them [s].
SPACED, SPACINGS = ("milling_20000", "gcode_groove"), (0.004, 0.008, 0.012, 0.024)
# What the tables above have as least time between targets [s].
_CLOSEST = 0.004
# Of sensor interfaces [s].
CYCLES = (0.004, 0.012)
# Points from which a derivative is taken.
_NEIGHBOURS = 5


@cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory()


@cache
def _run(name: str) -> tuple[Path, Case]:
    """Return the run folder of a case."""
    keys: dict[str, float | str] = {"feed_m_s": 1.0} if name == _FAST else {}
    if name == "gcode_groove":
        keys = {"file": str(CASES_FOLDER.parent / "toolpaths" / "groove.ngc")}
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


def spacings() -> str:
    """Return what programs lose whose targets are set apart, under two motions of a controller."""

    def rows() -> Iterator[tuple[str, ...]]:
        for name in SPACED:
            for own in (language for language in LANGUAGES.values() if not language.dense):
                for shortest in SPACINGS:
                    options = ExportOptions(own, own.targets[0], shortest=shortest)
                    (one,) = export_run(_run(name)[0], options)
                    lines = one.loss_on_joint_lines
                    yield (
                        f"`{name}`",
                        own.name,
                        f"{1e3 * shortest:.0f} ms",
                        f"{one.points}",
                        f"{1e3 * one.median:.0f} ms",
                        _um(one.loss),
                        "" if lines is None else _um(lines),
                    )

    head = ("case", "language", "`--shortest-ms`", "points", "median", "loss [um]")
    return table((*head, "loss on joint lines [um]"), rows())


def splines() -> str:
    """Return what KRL's files do if the controller's spline is another one than is assumed."""
    return table(
        ("case", "loss, C2 cubic [um]", "loss, quintic by five points [um]"),
        [(f"`{name}`", _um(_exported(name, "krl").loss), _um(_with_other(name))) for name in CASES],
    )


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


def _with_other(name: str) -> float:
    """Return the loss of a KRL program under `five_point_quintic` [m]."""
    folder, case = _run(name)
    stored = read_run(folder).first
    program = LANGUAGES["krl"].read(_exported(name, "krl").files)
    joints, end = controller_axes(find_robot("icme2008"), 6), stored.wrench.time[-1]
    found = drive_motion(
        program,
        case.robots[0].description,
        joints,
        case.controller.cycle,
        0.0,
        None,
        five_point_quintic,
    )
    motion = JointPath(np.append(found.time[:-1], max(found.time[-1], end)), found.q)
    with Models(case.fmu) as models:
        cell, _ = cell_of(case.robots, models)
        command = cell.simulate(stored.joints, stored.wrench, "dynamic")
        path = cell.simulate(motion, stored.wrench, "dynamic")
    return float(path.distance_to(command).max())


def five_point_quintic(time: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return quintic pieces whose rates and accelerations are those of quartics through five points.

    At both ends it rests.

    Args:
        time: Of the points, rising [s], (n,).
        values: (n, k).
        at: Times that are asked for [s], (m,).
    """
    rate, acceleration = np.zeros_like(values), np.zeros_like(values)
    size = min(_NEIGHBOURS, len(time))
    for k in range(1, len(time) - 1):
        first = int(np.clip(k - size // 2, 0, len(time) - size))
        rows = slice(first, first + size)
        scale = time[rows][-1] - time[rows][0]
        powers = np.vander((time[rows] - time[k]) / scale, increasing=True)
        found = np.linalg.solve(powers, values[rows])
        rate[k] = found[1] / scale
        if size > 2:
            acceleration[k] = 2.0 * found[2] / scale**2
    whole: np.ndarray = BPoly.from_derivatives(
        time, np.stack([values, rate, acceleration], axis=1)
    )(at)
    return whole


def _um(length: float) -> str:
    return f"{1e6 * length:.2f}"


PARTS = {"programs": programs, "spacings": spacings, "cycles": cycles, "splines": splines}

if __name__ == "__main__":
    sys.exit(finish(lambda: replace_parts("export", PARTS, sys.argv[1:])))
