"""A measured wrench history, for those who own a load cell: the same for every path."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np

from coupling.errors import CaseError
from coupling.files.csv_table import WRENCH_COLUMNS, read_header, read_table
from coupling.files.toml_file import FilePath
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.linear import arc_length, interpolate_rows
from coupling.path.low_pass import low_pass
from coupling.process.base import NoisySchema, ProcessResponse, WithIdentity
from coupling.process.frames import WrenchFrame, wrench_in_base
from coupling.toolpaths.instants import NO_CORNERS, Corners
from coupling.toolpaths.task import Task

_FORCES, _MOMENTS = WRENCH_COLUMNS[:3], WRENCH_COLUMNS[3:]
# A record may end this share of its length before the path does: printed digits, not missing data.
_ROUNDING = 1e-6
# A record whose rows are closer than this part of the path's samples holds more than these can.
_CLOSE = 0.5


@dataclass(frozen=True)
class MeasuredWrench(WithIdentity):
    """A wrench that was recorded along the desired path, and does not ask where the tool is now.

    Attributes:
        part: base_from_part.
        wrench_along_path: Wrench on the tool at the TCP in axes of `frame` [N, N m], (n, 6), one row
            per sample of the desired path.
        frame: "part", "base", or "tool" for a sensor that turns with the tool.
    """

    part: Frame
    wrench_along_path: np.ndarray
    frame: WrenchFrame

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return the record, turned to base axes with the actual tool; it gives way to no position."""
        in_base = wrench_in_base(self.frame, self.wrench_along_path, path, self.part)
        return ProcessResponse(
            WrenchHistory(path.time, in_base), stiffness=np.zeros((len(path.time), 3, 3))
        )


class MeasuredWrenchTable(NoisySchema):
    """Keys: file, a CSV; frame of its axes, "tool" unless given.

    Columns: `time` [s] of the path, or `distance` [m] travelled along it, rising; fx, fy, fz [N]
    on the tool, and mx, my, mz [N m] about the TCP where they were measured.
    """

    FORMULA: ClassVar[bool] = True

    model: Literal["measured"]
    file: FilePath
    frame: WrenchFrame = "tool"

    def corners(self, task: Task) -> Corners:
        """Return the times of a record's rows, where these are no closer than the samples."""
        axis, stations, _ = self._record()
        if axis == "distance" or _is_finer(stations, task.sampled.forming.time):
            return NO_CORNERS
        return stations

    def process(self, task: Task) -> MeasuredWrench:
        """Return the record along a task's path.

        Raises:
            CaseError: If the file is unreadable, or does not cover the path.
        """
        axis, stations, record = self._record()
        time = task.desired.time
        along = time if axis == "time" else arc_length(task.desired.position[0])
        _require_cover(self.file, axis, stations, along)
        if axis == "time" and _is_finer(stations, time):
            # What is faster than the samples would come as something slower.
            record = low_pass(stations, record, 0.5 / float(np.median(np.diff(time))))
        wrench = np.zeros((len(along), len(WRENCH_COLUMNS)))
        wrench[:, : record.shape[1]] = interpolate_rows(along, stations, record)
        return MeasuredWrench(task.part, wrench, self.frame, identity=self.identity(task))

    def _record(self) -> tuple[str, np.ndarray, np.ndarray]:
        """Return the file's axis, its stations there [s] or [m], (m,), and its rows, (m, k)."""
        header = read_header(self.file, CaseError)
        axis = _axis(self.file, header)
        columns = WRENCH_COLUMNS if set(_MOMENTS) & set(header) else _FORCES
        table = read_table(self.file, (axis, *columns), CaseError)
        return axis, table[:, 0], table[:, 1:]

    def own_files(self) -> tuple[Path, ...]:
        """Return the record."""
        return (self.file,)


def _is_finer(recorded: np.ndarray, time: np.ndarray) -> bool:
    """Return whether a record's rows are so close that samples cannot hold them."""
    return bool(np.median(np.diff(recorded)) <= _CLOSE * np.median(np.diff(time)))


def _axis(file: Path, header: list[str]) -> str:
    axis_columns = [name for name in ("time", "distance") if name in header]
    if len(axis_columns) != 1:
        raise CaseError(
            f"process: {file}: expected either a column time or a column distance, got"
            f" {', '.join(header)}"
        )
    return axis_columns[0]


def _require_cover(file: Path, axis: str, stations: np.ndarray, along: np.ndarray) -> None:
    unit = "s" if axis == "time" else "m"
    if np.any(np.diff(stations) <= 0.0):
        row = int(np.argmax(np.diff(stations) <= 0.0))
        raise CaseError(
            f"process: {file}: {axis}: expected rising values, got {stations[row + 1]:.9g} {unit}"
            f" after {stations[row]:.9g} {unit} in row {row + 2}"
        )
    slack = _ROUNDING * float(along[-1] - along[0])
    if stations[0] > along[0] + slack or stations[-1] < along[-1] - slack:
        raise CaseError(
            f"process: {file}: {axis}: expected at least {along[0]:.6g} to {along[-1]:.6g} {unit}"
            f" for the tool path, got {stations[0]:.6g} to {stations[-1]:.6g} {unit}"
        )
