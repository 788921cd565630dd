"""CSV files that people measure and write: comments, other columns, and where something is wrong."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from coupling.errors import reason_of
from coupling.files.bounded_file import read_bounded

# A column of this name before it has the standard deviation of another one.
DEVIATION = "sd."
# Larger numbers are no measurement, and their squares overflow.
_MAX_VALUE = 1e100
# No file that is measured is larger [bytes]; a mistaken name must not fill the memory.
_MAX_BYTES = 500_000_000


class MeasuredTable:
    """The named columns of a file, as far as they are wanted."""

    def __init__(
        self,
        path: Path,
        header: list[str],
        lines: Sequence[tuple[int, list[str]]],
        error: type[Exception],
    ) -> None:
        self._path, self.header, self.lines, self._error_class = path, header, lines, error
        for number, row in lines:
            if len(row) != len(header):
                raise error(
                    f"{path}: line {number}: expected {len(header)} cells, one for each column, got"
                    f" {len(row)}{self._hint}"
                )

    @property
    def _hint(self) -> str:
        semicolons = ";" in "".join(self.header)
        return ": separate them with commas, decimals with a point" if semicolons else ""

    @classmethod
    def read(cls, path: Path, error: type[Exception]) -> MeasuredTable:
        """Read a file; lines that begin with # are comments.

        Args:
            error: Exception class for every problem: with file, line, column, what was expected and got.
        """
        try:
            text = read_bounded(path, _MAX_BYTES, error).decode("utf-8-sig")
        except UnicodeDecodeError as cause:
            raise error(f"{path}: cannot be read: {reason_of(cause)}") from cause
        numbered = [
            (number, line)
            for number, line in enumerate(text.splitlines(), start=1)
            if line.strip() and not line.lstrip().startswith("#")
        ]
        if len(numbered) < 2:
            raise error(
                f"{path}: expected a line of column names and at least one row of numbers, got"
                f" {len(numbered)} lines that are no comments"
            )
        try:
            cells = list(
                csv.reader((line for _, line in numbered), strict=True, skipinitialspace=True)
            )
        except csv.Error as cause:
            raise error(f"{path}: is not a table of CSV: {cause}") from cause
        if len(cells) != len(numbered):
            raise error(f"{path}: is not a table of CSV: a quoted text goes over its line's end")
        header = [name.strip() for name in cells[0]]
        rows = [(number, row) for (number, _), row in zip(numbered[1:], cells[1:], strict=True)]
        return cls(path, header, rows, error)

    def has(self, names: Sequence[str]) -> bool:
        """Return whether a group of columns is there."""
        return names[0] in self.header

    def require(self, names: Sequence[str]) -> None:
        """Refuse a file without some columns."""
        missing = [name for name in names if name not in self.header]
        if missing:
            raise self._error_class(
                f"{self._path}: columns {', '.join(missing)} are missing: expected"
                f" {', '.join(names)}, got {', '.join(self.header)[:300]}{self._hint}"
            )

    def require_whole(self, group: Sequence[str]) -> None:
        """Refuse a group of columns that is there in part."""
        present = [name for name in group if name in self.header]
        if present and len(present) < len(group):
            raise self._error_class(
                f"{self._path}: expected all of the columns {', '.join(group)}, or none, got"
                f" {', '.join(present)}"
            )

    def of(self, names: Sequence[str]) -> np.ndarray:
        """Return columns, any unit, (rows, names)."""
        return np.column_stack([self._column(name) for name in names])

    def deviations(self, names: Sequence[str]) -> np.ndarray:
        """Return the standard deviations of columns, any unit, (rows, names); NaN without."""
        columns = []
        for name in names:
            column = DEVIATION + name
            values = np.full(len(self.lines), np.nan)
            if column in self.header:
                values = self._column(column)
                if not np.all(values >= 0.0):
                    raise self.row_error(column, int(np.argmin(values)), "a number >= 0")
            columns.append(values)
        return np.column_stack(columns)

    def names(self) -> tuple[str, ...]:
        """Return the names of the rows; those without one are called by their line."""
        at = self._index("name") if "name" in self.header else None
        names = ["" if at is None else row[at].strip() for _, row in self.lines]
        return tuple(
            name or f"line {number}" for name, (number, _) in zip(names, self.lines, strict=True)
        )

    def _column(self, name: str) -> np.ndarray:
        at, values = self._index(name), np.empty(len(self.lines))
        for k, (_, row) in enumerate(self.lines):
            try:
                values[k] = float(row[at])
            except ValueError:
                raise self.row_error(name, k, "a finite number") from None
            if not abs(values[k]) < _MAX_VALUE:
                raise self.row_error(name, k, "a finite number")
        return values

    def _index(self, name: str) -> int:
        if self.header.count(name) > 1:
            raise self._error_class(f"{self._path}: expected one column {name!r}, got two")
        return self.header.index(name)

    def row_error(self, name: str, row: int, expected: str) -> Exception:
        """Return the error of a cell, by its column and row from 0."""
        number, cells = self.lines[row]
        got = cells[self.header.index(name)]
        return self._error_class(
            f"{self._path}: line {number}: {name}: expected {expected}, got {got!r}"
        )
