"""The folder of exported programs, whole or not at all, with a summary beside them."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from coupling.errors import ProgramError
from coupling.export.exported import Exported, Options
from coupling.files.whole_file import sync_folder

SUMMARY = "export.json"


def require_writable(folder: Path, overwrite: bool) -> None:
    """Refuse a folder that holds something else, or programs that may not be replaced.

    Raises:
        ProgramError: With the folder.
    """
    if not folder.exists():
        return
    if not folder.is_dir():
        raise ProgramError(f"{folder}: expected the name of a folder, got a file")
    if not any(folder.iterdir()):
        return
    if not (folder / SUMMARY).is_file():
        raise ProgramError(f"{folder}: holds files that are no export: name another folder")
    if not overwrite:
        raise ProgramError(f"{folder}: holds programs already: add --overwrite to replace them")


def write_export(
    folder: Path, exports: Sequence[Exported], options: Options, overwrite: bool
) -> None:
    """Write programs and their summary, in the place of those that are there.

    Raises:
        ProgramError: If the folder may not be replaced or cannot be written.
    """
    require_writable(folder, overwrite)
    target = folder.resolve()
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(dir=target.parent, prefix=f".{target.name}."))
    except OSError as cause:
        raise ProgramError(f"{folder}: cannot be made: {cause.strerror or cause}") from cause
    try:
        for one in exports:
            for file in one.files:
                (draft / file.name).write_bytes(file.text.encode("ascii"))
        (draft / SUMMARY).write_text(
            json.dumps(summary(exports, options), indent=1), encoding="utf-8"
        )
        draft.chmod(0o755)
        _take_place(draft, target)
    except OSError as cause:
        raise ProgramError(f"{folder}: cannot be written: {cause.strerror or cause}") from cause
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _take_place(draft: Path, target: Path) -> None:
    """Put a folder in the place of another one."""
    if target.exists():
        old = draft.with_name(f"{draft.name}.old")
        os.rename(target, old)
        try:
            os.rename(draft, target)
        except OSError:
            os.rename(old, target)
            raise
        shutil.rmtree(old)
    else:
        os.rename(draft, target)
    sync_folder(target.parent)


def summary(exports: Sequence[Exported], options: Options) -> dict[str, Any]:
    """Return what export.json says."""
    return {
        "language": options.language.name,
        "targets": options.targets,
        "tolerance_m": options.tolerance,
        "robots": [_of_robot(one) for one in exports],
    }


def _of_robot(one: Exported) -> dict[str, Any]:
    return {
        "robot": one.robot,
        "program": one.program.name,
        "files": [{"name": file.name, "bytes": len(file.text)} for file in one.files],
        "points": one.points,
        "points_on_every_cycle": one.candidates,
        "points_tolerance_m": one.points_tolerance,
        "shortest_time_s": one.shortest,
        "loss_m": one.loss,
        "deviation_of_command_m": asdict(one.command),
        "deviation_of_file_m": asdict(one.read_back),
        "base": one.program.base,
        "tool": one.program.tool,
        "counted_as_controller": one.counted,
        "nearest_singularity": asdict(one.nearest),
        "drives": [asdict(drive) for drive in one.drives],
    }
