"""The run folder: written whole or not at all, and read back for reports."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from coupling.case import Case
from coupling.errors import ResultError
from coupling.path import JointPath, ToolPath, WrenchHistory
from coupling.run import Run, as_figures
from coupling.tables import (
    CORRECTION_COLUMNS,
    POSE_COLUMNS,
    WRENCH_COLUMNS,
    read_header,
    read_table,
    write_table,
)
from coupling.workpiece import Workpiece

_RESULT = "result.json"
_PACKAGES = ("elastic-robot-fmu", "fmpy", "numpy", "pin", "pythonfmu", "scipy")


@dataclass(frozen=True)
class StoredRun:
    """A run read back from its folder.

    Attributes:
        name: Of the folder.
        figures: Content of result.json.
        desired, uncompensated, achieved, command: Tool paths.
        joints: Joint angles of `command`.
        correction: command minus desired, (n, 6).
        wrench: On the tool.
        workpieces: "before" and "after" compensation, where the process tells.
    """

    name: str
    figures: dict[str, Any]
    desired: ToolPath
    uncompensated: ToolPath
    achieved: ToolPath
    command: ToolPath
    joints: JointPath
    correction: np.ndarray
    wrench: WrenchHistory
    workpieces: dict[str, Workpiece]


@contextmanager
def new_run_folder(folder: Path, overwrite: bool) -> Iterator[Path]:
    """Give a scratch folder that becomes `folder` if the block ends well, and vanishes if not.

    It is made at once, so that a folder that cannot be written is found before the work is done.

    Raises:
        ResultError: If `folder` exists and may not be replaced, or cannot be written.
    """
    _require_free(folder, overwrite)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}-"))
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
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _require_free(folder: Path, overwrite: bool) -> None:
    if not folder.exists():
        return
    if not folder.is_dir():
        raise ResultError(f"{folder}: is a file; needed is the name of a folder")
    if not any(folder.iterdir()):
        return
    if not (folder / _RESULT).exists():
        raise ResultError(f"{folder}: holds files that are not a result; name another folder")
    if not overwrite:
        raise ResultError(f"{folder}: holds a result already; add --overwrite to replace it")


def write_run(folder: Path, case: Case, run: Run) -> None:
    """Write all files of a run but the report into an existing folder.

    Raises:
        ResultError: If a file cannot be written.
    """
    figures = {"case": case.name, **as_figures(run), "versions": _versions()}
    joints = [f"q{i + 1}" for i in range(run.joints.q.shape[1])]
    try:
        (folder / "case.toml").write_text(tomli_w.dumps(case.resolved), encoding="utf-8")
        (folder / _RESULT).write_text(json.dumps(figures, indent=1), encoding="utf-8")
        for name, path in (
            ("desired", run.desired),
            ("uncompensated", run.uncompensated),
            ("achieved", run.achieved),
        ):
            _write(folder, name, POSE_COLUMNS, path.time, path.pose)
        command = np.hstack([run.command.pose, run.joints.q])
        _write(folder, "command", (*POSE_COLUMNS, *joints), run.command.time, command)
        correction = run.command.deviation_from(run.desired)
        _write(folder, "correction", CORRECTION_COLUMNS, run.command.time, correction)
        _write(folder, "wrench", WRENCH_COLUMNS, run.wrench.time, run.wrench.wrench)
        for name, workpiece in (
            ("before", run.workpiece_before),
            ("after", run.wrench.workpiece),
        ):
            if workpiece is not None:
                workpiece.write(_workpiece_file(folder, name))
    except OSError as cause:
        raise ResultError(f"{folder}: cannot be written: {cause.strerror or cause}") from cause


def _workpiece_file(folder: Path, name: str) -> Path:
    return folder / f"workpiece_{name}.vtu"


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


def read_run(folder: Path) -> StoredRun:
    """Read a run folder.

    Raises:
        ResultError: If a file is missing or broken.
    """
    try:
        figures = json.loads((folder / _RESULT).read_text(encoding="utf-8"))
    except OSError as cause:
        raise ResultError(
            f"{folder / _RESULT}: cannot be read: {cause.strerror or cause}; needed is a run folder"
        ) from cause
    except ValueError as cause:
        raise ResultError(f"{folder / _RESULT}: is not valid JSON: {cause}") from cause

    def table(name: str, columns: tuple[str, ...]) -> np.ndarray:
        return read_table(folder / f"{name}.csv", ("time", *columns), ResultError)

    def tool_path(name: str) -> ToolPath:
        values = table(name, POSE_COLUMNS)
        return ToolPath(values[:, 0], values[:, 1:])

    header = read_header(folder / "command.csv", ResultError)
    joints = tuple(name for name in header if name.startswith("q") and name[1:].isdigit())
    angles, wrench = table("command", joints), table("wrench", WRENCH_COLUMNS)
    try:
        return StoredRun(
            name=folder.name,
            figures=figures,
            desired=tool_path("desired"),
            uncompensated=tool_path("uncompensated"),
            achieved=tool_path("achieved"),
            command=tool_path("command"),
            joints=JointPath(angles[:, 0], angles[:, 1:]),
            correction=table("correction", CORRECTION_COLUMNS)[:, 1:],
            wrench=WrenchHistory(wrench[:, 0], wrench[:, 1:]),
            workpieces={
                name: Workpiece.read(file)
                for name in ("before", "after")
                if (file := _workpiece_file(folder, name)).exists()
            },
        )
    except ValueError as cause:
        raise ResultError(f"{folder}: {cause}") from cause
