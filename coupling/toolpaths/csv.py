"""A tool path from a file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from coupling.errors import CaseError
from coupling.files.csv_table import POSE_COLUMNS, read_header, read_table
from coupling.files.formats import other_format
from coupling.files.toml_file import FilePath, Positive
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.path.interpolation import InterpolatedPath, divide_steps
from coupling.programs.text import shorten
from coupling.toolpaths.bounds import MAX_SPEED
from coupling.toolpaths.instants import NO_CORNERS, Corners, insert_corners
from coupling.toolpaths.motion import require_few
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.task import Task
from coupling.toolpaths.untilted import UntiltedPath

# A quaternion written with few digits is normalised; beyond this it is a mistake.
_UNIT_TOLERANCE = 1e-3
# No robot reaches so far [m]: its path is in other units.
_MAX_DISTANCE = 20.0
# A path that is nowhere as fast may be in other units [m/s].
_SLOW = 1e-3
# No path is so long [s].
_MAX_TIME = 1e7
_COLUMNS = ("time", *POSE_COLUMNS)
# So much of a file tells what it is [bytes].
_HEAD_BYTES = 16_384


class CsvPath(ToolPathTable):
    """Poses of the TCP in the part frame, from a CSV file.

    Keys: file, with the columns time, x, y, z, qx, qy, qz, qw (s, m, unit quaternion of
    part_from_tool).  The path must begin and end at rest, because the drives do.  Where the tilt is
    measured from the path, the normal is each row's own: opposite to its axis of approach.  sample_s,
    the longest time between two samples of the process: between rows farther apart the path goes on as
    a smooth one through them; None: its rows are the samples.
    """

    kind: Literal["csv"]
    file: FilePath
    sample_s: Positive | None = None

    def untilted(self, part: Frame, corners: Corners = NO_CORNERS) -> UntiltedPath:
        """Return the tool path in the world before the tool is turned.

        Raises:
            CaseError: If the file is unreadable or not a path.
        """
        table = self._table()
        length = np.linalg.norm(table[:, 4:], axis=1)
        wrong = np.flatnonzero(np.abs(length - 1.0) > _UNIT_TOLERANCE)
        if len(wrong):
            raise CaseError(
                f"{self.file}: expected quaternions of length 1, got length"
                f" {length[wrong[0]]:.6g} in row {wrong[0] + 1}"
            )
        try:
            path = ToolPath(table[:, 0], table[:, 1:]).transformed(part)
        except ValueError as cause:
            raise CaseError(f"{self.file}: {cause}") from cause
        path, rows = insert_corners(path, corners)
        if self.sample_s is not None:
            require_few(float(path.time[-1] - path.time[0]) / self.sample_s, self.file)
            time, _ = divide_steps(path.time, self.sample_s)
            path, rows = InterpolatedPath(path).at(time), np.arange(len(time))
        return self._with_headings(UntiltedPath(part, path, rows))

    def task(
        self, part: Frame, corners: Corners = NO_CORNERS, untilted: UntiltedPath | None = None
    ) -> Task:
        """Return the task, with remarks on columns that are left out, and on a tool that creeps."""
        task = super().task(part, corners, untilted)
        others = [name for name in read_header(self.file, CaseError) if name not in _COLUMNS]
        remarks = [f"columns left out: {shorten(', '.join(others), 80)}"] if others else []
        ways = np.linalg.norm(np.diff(task.forming.position[0], axis=0), axis=1)
        if (speed := float(np.max(ways / np.diff(task.forming.time)))) < _SLOW:
            remarks.append(
                f"the tool goes at most {1e3 * speed:.3g} mm/s: are times in seconds, places in metres?"
            )
        return replace(task, remarks=tuple(f"{self.file.name}: {text}" for text in remarks))

    def _table(self) -> np.ndarray:
        """Return time [s], position [m] and quaternion of each row, (rows, 8)."""
        if self.file.is_file() and (other := other_format(_head(self.file), ["csv"])):
            raise CaseError(f"{self.file}: expected a table of poses, {other}")
        names = read_header(self.file, CaseError)
        missing = [name for name in _COLUMNS if name not in names]
        if missing:
            got = ", ".join(names)[:80] or "an empty file"
            raise CaseError(
                f"{self.file}: columns {', '.join(missing)} are missing: expected"
                f" {', '.join(_COLUMNS)}, in s, m and the unit quaternion of part_from_tool, got {got}:"
                " convert them, and separate columns by commas"
            )
        table = read_table(self.file, _COLUMNS, CaseError)
        largest = float(np.abs(table[:, 1:4]).max())
        if largest > _MAX_DISTANCE:
            raise CaseError(
                f"{self.file}: x, y, z: expected metres, got values up to {largest:.4g}: divide"
                " millimetres by 1000"
            )
        latest = float(np.abs(table[:, 0]).max())
        if latest > _MAX_TIME:
            raise CaseError(
                f"{self.file}: time: expected seconds from the start, at most {_MAX_TIME:g}, got"
                f" {latest:.4g}: subtract the first row's, and convert it to s"
            )
        steps = np.diff(table[:, 0])
        if np.all(steps > 0.0) and len(steps):  # other times are refused with the path
            speed = np.linalg.norm(np.diff(table[:, 1:4], axis=0), axis=1) / steps
            if speed.max() > MAX_SPEED:
                raise CaseError(
                    f"{self.file}: expected metres and seconds, at most {MAX_SPEED:g} m/s, got"
                    f" {speed.max():.4g} m/s to row {int(np.argmax(speed)) + 2}: divide millimetres by"
                    " 1000, or look at its times"
                )
        return table


def _head(file: Path) -> bytes:
    try:
        with file.open("rb") as stream:
            return stream.read(_HEAD_BYTES)
    except OSError:
        return b""  # told where the table is read
