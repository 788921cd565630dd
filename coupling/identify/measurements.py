"""measurements.csv -> arrays: measured static deflections, one row each."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.errors import IdentifyError

FORCE, MOMENT = ("fx", "fy", "fz"), ("mx", "my", "mz")
SHIFT, TURN = ("dx", "dy", "dz"), ("drx", "dry", "drz")
LOAD_POINT = ("load.x", "load.y", "load.z")
MEASURED_POINT = ("point.x", "point.y", "point.z")
# A column of this name before it has the standard deviation of another one.
DEVIATION = "sd."
# Larger numbers are no measurement, and their squares overflow.
_LARGEST = 1e100


@dataclass(frozen=True)
class Measurements:
    """Measured static deflections, k of them.

    Attributes:
        names: Name of each row.
        q: Drive angles [rad], (k, n).
        wrench: Change of the load on the robot at the load point between the two states compared, base
            axes [N, N m], (k, 6).
        deflection: Change of the measured point's position [m] and, where r = 6, of its orientation
            [rad, rotation vector], base axes, (k, r).
        load_point: Where the load acts, in the TCP's frame [m], (k, 3).
        measured_point: What was measured, in the TCP's frame [m], (k, 3).
        deflection_deviation: Standard deviations of the deflection, (k, r); nan where not given.
        wrench_deviation: Standard deviations of the load, (k, 6); nan where not given.
        remarks: What is odd about the file, in sentences.
    """

    names: tuple[str, ...]
    q: np.ndarray
    wrench: np.ndarray
    deflection: np.ndarray
    load_point: np.ndarray
    measured_point: np.ndarray
    deflection_deviation: np.ndarray
    wrench_deviation: np.ndarray
    remarks: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """Number of rows k."""
        return len(self.names)

    @property
    def rows(self) -> int:
        """Numbers measured in each row: 3, or 6 with rotations."""
        return self.deflection.shape[1]

    @classmethod
    def of(
        cls,
        q: np.ndarray,
        wrench: np.ndarray,
        deflection: np.ndarray,
        load_point: np.ndarray | None = None,
        measured_point: np.ndarray | None = None,
    ) -> Measurements:
        """Return measurements without names and deviations; points at the TCP unless given."""
        count, at_tcp = len(q), np.zeros((len(q), 3))
        return cls(
            tuple(f"row {k + 1}" for k in range(count)),
            q,
            wrench,
            deflection,
            at_tcp if load_point is None else load_point,
            at_tcp if measured_point is None else measured_point,
            np.full(deflection.shape, np.nan),
            np.full((count, 6), np.nan),
        )


def read_measurements(path: Path, joints: int) -> Measurements:
    """Read measurements (columns: docs/identify.md).

    Args:
        path: CSV file; lines that begin with # are comments, other columns are ignored.
        joints: Number of the robot's joints n.

    Raises:
        IdentifyError: With file, line, column, what was expected and what was got.
    """
    header, lines = _lines(path)
    angles = tuple(f"q{i + 1}" for i in range(joints))
    table = _Table(path, header, lines)
    table.require((*angles, *FORCE, *SHIFT))
    for group in (MOMENT, TURN, LOAD_POINT, MEASURED_POINT):
        table.require_whole(group)
    measured = SHIFT + TURN if table.has(TURN) else SHIFT
    load = FORCE + MOMENT if table.has(MOMENT) else FORCE
    wrench = np.zeros((len(lines), 6))
    wrench[:, : len(load)] = table.of(load)
    deviations = np.full((len(lines), 6), np.nan)
    deviations[:, : len(load)] = table.deviations(load)
    return Measurements(
        table.names(),
        table.of(angles),
        wrench,
        table.of(measured),
        table.of(LOAD_POINT) if table.has(LOAD_POINT) else np.zeros((len(lines), 3)),
        table.of(MEASURED_POINT) if table.has(MEASURED_POINT) else np.zeros((len(lines), 3)),
        table.deviations(measured),
        deviations,
        _remarks(header, joints),
    )


def _remarks(header: list[str], joints: int) -> tuple[str, ...]:
    more = [name for name in header if re.fullmatch(r"q\d+", name) and int(name[1:]) > joints]
    if not more:
        return ()
    return (f"columns {', '.join(more)} are not used: the robot has {joints} joints",)


def _lines(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Return the header's names and the cells of each row with the number of its line."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as cause:
        reason = getattr(cause, "strerror", None) or cause
        raise IdentifyError(f"{path}: cannot be read: {reason}") from cause
    numbered = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(numbered) < 2:
        raise IdentifyError(
            f"{path}: expected a line of column names and at least one row of numbers, got"
            f" {len(numbered)} lines that are no comments"
        )
    try:
        cells = list(csv.reader((line for _, line in numbered), strict=True, skipinitialspace=True))
    except csv.Error as cause:
        raise IdentifyError(f"{path}: is not a table of CSV: {cause}") from cause
    if len(cells) != len(numbered):
        raise IdentifyError(
            f"{path}: is not a table of CSV: a quoted text goes over its line's end"
        )
    header = [name.strip() for name in cells[0]]
    rows = [(number, row) for (number, _), row in zip(numbered[1:], cells[1:], strict=True)]
    return header, rows


class _Table:
    """The named columns of a file, as far as they are wanted."""

    def __init__(
        self, path: Path, header: list[str], lines: Sequence[tuple[int, list[str]]]
    ) -> None:
        self._path, self._header, self._lines = path, header, lines
        for number, row in lines:
            if len(row) != len(header):
                raise IdentifyError(
                    f"{path}: line {number}: expected {len(header)} cells, one for each column, got"
                    f" {len(row)}"
                )

    def has(self, names: Sequence[str]) -> bool:
        return names[0] in self._header

    def require(self, names: Sequence[str]) -> None:
        missing = [name for name in names if name not in self._header]
        if missing:
            hint = ": separate them with commas" if ";" in "".join(self._header) else ""
            raise IdentifyError(
                f"{self._path}: columns {', '.join(missing)} are missing: expected"
                f" {', '.join(names)}, got {', '.join(self._header)}{hint}"
            )

    def require_whole(self, group: Sequence[str]) -> None:
        """Refuse a group of columns that is there in part."""
        found = [name for name in group if name in self._header]
        if found and len(found) < len(group):
            raise IdentifyError(
                f"{self._path}: expected all of the columns {', '.join(group)}, or none, got"
                f" {', '.join(found)}"
            )

    def of(self, names: Sequence[str]) -> np.ndarray:
        return np.column_stack([self._column(name) for name in names])

    def deviations(self, names: Sequence[str]) -> np.ndarray:
        """Return the standard deviations of columns, nan where there are none."""
        columns = []
        for name in names:
            own = DEVIATION + name
            values = np.full(len(self._lines), np.nan)
            if own in self._header:
                values = self._column(own)
                if not np.all(values >= 0.0):
                    raise self._error(own, int(np.argmin(values)), "a number >= 0")
            columns.append(values)
        return np.column_stack(columns)

    def names(self) -> tuple[str, ...]:
        """Return the names of the rows; those without one are called by their line."""
        at = self._index("name") if "name" in self._header else None
        given = ["" if at is None else row[at].strip() for _, row in self._lines]
        return tuple(
            name or f"line {number}" for name, (number, _) in zip(given, self._lines, strict=True)
        )

    def _column(self, name: str) -> np.ndarray:
        at, values = self._index(name), np.empty(len(self._lines))
        for k, (_, row) in enumerate(self._lines):
            try:
                values[k] = float(row[at])
            except ValueError:
                raise self._error(name, k, "a finite number") from None
            if not abs(values[k]) < _LARGEST:
                raise self._error(name, k, "a finite number")
        return values

    def _index(self, name: str) -> int:
        if self._header.count(name) > 1:
            raise IdentifyError(f"{self._path}: expected one column {name!r}, got two")
        return self._header.index(name)

    def _error(self, name: str, row: int, expected: str) -> IdentifyError:
        number, cells = self._lines[row]
        got = cells[self._header.index(name)]
        return IdentifyError(
            f"{self._path}: line {number}: {name}: expected {expected}, got {got!r}"
        )
