"""The run folder: written whole or not at all."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib import metadata
from pathlib import Path

import numpy as np
import tomli_w

from coupling.case import Case
from coupling.errors import ResultError
from coupling.files.csv_table import (
    CORRECTION_COLUMNS,
    POSE_COLUMNS,
    WRENCH_COLUMNS,
    write_table,
)
from coupling.path.histories import JointPath
from coupling.process.base import EVALUATIONS
from coupling.run.stored_run import GAP, GAP_COLUMNS, RESULT, workpiece_file
from coupling.run.study import Run, as_figures

_PACKAGES = ("elastic-robot-fmu", "fmpy", "numpy", "pin", "pythonfmu", "scipy")


@contextmanager
def new_run_folder(folder: Path, overwrite: bool) -> Iterator[Path]:
    """Give a scratch folder that becomes `folder` if the block ends well, and vanishes if not.

    Only what a process's programs computed in it is kept in any case, and a note on the error tells
    where.  It is made at once, so that a folder that cannot be written is found before the work.

    Raises:
        ResultError: If `folder` exists and may not be replaced, or cannot be written.
    """
    _require_free(folder, overwrite)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f"{folder.name}.unfinished-"))
    except OSError as cause:
        raise ResultError(f"{folder}: cannot be written: {cause.strerror or cause}") from cause
    try:
        yield scratch
        os.chmod(scratch, 0o755)
        if folder.exists():
            shutil.rmtree(folder)
        os.replace(scratch, folder)
    except OSError as cause:
        raise ResultError(f"{folder}: cannot be written: {cause.strerror or cause}") from cause
    except BaseException as error:  # an interrupt as well: what was computed is worth finding
        if (scratch / EVALUATIONS).exists():
            error.add_note(f"what the process computed is kept in {scratch / EVALUATIONS}")
        raise
    finally:
        if not (scratch / EVALUATIONS).exists():
            shutil.rmtree(scratch, ignore_errors=True)


def _require_free(folder: Path, overwrite: bool) -> None:
    if not folder.exists():
        return
    if not folder.is_dir():
        raise ResultError(f"{folder}: is a file; needed is the name of a folder")
    if not any(folder.iterdir()):
        return
    if not (folder / RESULT).exists():
        raise ResultError(f"{folder}: holds files that are not a result; name another folder")
    if not overwrite:
        raise ResultError(f"{folder}: holds a result already; add --overwrite to replace it")


def write_run(folder: Path, case: Case, run: Run) -> None:
    """Write all files of a run but the report into an existing folder.

    Raises:
        ResultError: If a file cannot be written.
    """
    try:
        (folder / "case.toml").write_text(tomli_w.dumps(case.resolved), encoding="utf-8")
        _write_workpieces(folder, run)
        if run.gap is None:
            _write_robot(folder, case.name, run)
            return
        _write_figures(folder, case.name, run)
        gap = np.column_stack([run.gap.before, run.gap.after]) + run.gap.commanded
        _write(folder, GAP, GAP_COLUMNS, run.gap.time, gap)
        for name, own in runs_of_robots(case, run).items():
            (folder / name).mkdir()
            _write_robot(folder / name, f"{case.name}, {name} robot", own)
    except OSError as cause:
        raise ResultError(f"{folder}: cannot be written: {cause.strerror or cause}") from cause


def runs_of_robots(case: Case, run: Run) -> dict[str, Run]:
    """Return the run of a cell as one run for each of its robots.

    Convergence is that of the cell: passes, evaluations and verdict are the same in all.
    """
    counts = [len(placed.description.joints) for placed in case.robots]
    joints = np.split(run.joints.q, np.cumsum(counts)[:-1], axis=1)
    return {
        placed.name: replace(
            run,
            desired=run.desired.tools[k],
            uncompensated=run.uncompensated.tools[k],
            achieved=run.achieved.tools[k],
            command=run.command.tools[k],
            joints=JointPath(run.joints.time, joints[k]),
            wrench=run.wrench.tools[k],
            unloaded=run.unloaded.tools[k],
            dynamic=None if run.dynamic is None else run.dynamic.tools[k],
            rate_warnings=[w for w in run.rate_warnings if w.robot == placed.name],
            gap=None,
        )
        for k, placed in enumerate(case.robots)
    }


def _write_figures(folder: Path, name: str, run: Run) -> None:
    figures = {"case": name, **as_figures(run), "versions": _versions()}
    (folder / RESULT).write_text(json.dumps(figures, indent=1), encoding="utf-8")


def _write_robot(folder: Path, name: str, run: Run) -> None:
    """Write the figures and tables of one robot."""
    joints = [f"q{i + 1}" for i in range(run.joints.q.shape[1])]
    _write_figures(folder, name, run)
    for table, path in (
        ("desired", run.desired),
        ("uncompensated", run.uncompensated),
        ("achieved", run.achieved),
    ):
        _write(folder, table, POSE_COLUMNS, path.time, path.pose)
    command = np.hstack([run.command.pose, run.joints.q])
    _write(folder, "command", (*POSE_COLUMNS, *joints), run.command.time, command)
    correction = run.command.deviation_from(run.desired)
    _write(folder, "correction", CORRECTION_COLUMNS, run.command.time, correction)
    _write(folder, "wrench", WRENCH_COLUMNS, run.wrench.time, run.wrench.wrench)


def _write_workpieces(folder: Path, run: Run) -> None:
    pieces = {"before": run.workpiece_before, "after": run.wrench.workpiece}
    if run.kind == "couple":
        del pieces["after"]
    for state, workpiece in pieces.items():
        if workpiece is not None:
            workpiece.write(workpiece_file(folder, state))


def _write(
    folder: Path, name: str, columns: tuple[str, ...], time: np.ndarray, values: np.ndarray
) -> None:
    write_table(folder / f"{name}.csv", ("time", *columns), np.column_stack([time, values]))


def _versions() -> dict[str, str]:
    found = {}
    for package in _PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:  # run from a checkout that is not installed
            found[package] = "not installed as a package"
    return found
