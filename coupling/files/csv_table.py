"""CSV files with a header line, SI units and exact numbers: the only reader and writer of tables."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TextIO

import numpy as np
from pydantic_core import to_json

from coupling.errors import reason_of
from coupling.files.bounded_file import require_bounded

# No table is larger [bytes], and no line of names longer.
_MAX_BYTES, _MAX_HEADER_BYTES = 2_000_000_000, 1_000_000
# So many are turned into text at once.
_ROWS = 10_000

POSE_COLUMNS = ("x", "y", "z", "qx", "qy", "qz", "qw")
WRENCH_COLUMNS = ("fx", "fy", "fz", "mx", "my", "mz")
STIFFNESS_COLUMNS = ("kxx", "kxy", "kxz", "kyy", "kyz", "kzz")
ANCHOR_COLUMNS = ("x", "y", "z", *STIFFNESS_COLUMNS)
CORRECTION_COLUMNS = ("dx", "dy", "dz", "drx", "dry", "drz")


def write_table(file: Path | TextIO, columns: Sequence[str], data: np.ndarray) -> None:
    """Write numbers (rows, columns), each in the fewest digits that are read as the same number.

    The numbers of JSON are those of a CSV file, and its writer takes a third of the time of NumPy's.

    Example:
        >>> from io import StringIO
        >>> text = StringIO()
        >>> write_table(text, ("time", "x"), np.array([[0.0, 0.1], [0.004, 1e-7]]))
        >>> text.getvalue().split()
        ['time,x', '0.0,0.1', '0.004,1e-7']
    """
    if isinstance(file, Path):
        with file.open("w", encoding="utf-8", newline="\n") as stream:
            write_table(stream, columns, data)
        return
    file.write(",".join(columns) + "\n")
    for first in range(0, len(data), _ROWS):
        rows = np.asarray(data[first : first + _ROWS], dtype=float).tolist()
        text = to_json(rows, inf_nan_mode="constants").decode()
        file.write(text.removeprefix("[[").removesuffix("]]").replace("],[", "\n") + "\n")


class WrittenTables:
    """Tables as they are read from their files, without reading those that were just written by it."""

    def __init__(self) -> None:
        self._tables: dict[Path, tuple[list[str], np.ndarray]] = {}

    def write(self, file: Path, columns: Sequence[str], data: np.ndarray) -> None:
        """Write numbers of any unit, (rows, columns), as `write_table`."""
        write_table(file, columns, data)
        self._tables[file] = (list(columns), data)

    def header(self, file: Path, error: type[Exception]) -> list[str]:
        """Return the names of a table's columns, as `read_header`."""
        return self._tables[file][0] if file in self._tables else read_header(file, error)

    def read(self, file: Path, columns: Sequence[str], error: type[Exception]) -> np.ndarray:
        """Return the named columns of a table, any unit, (rows, columns), as `read_table`."""
        if file not in self._tables:
            return read_table(file, columns, error)
        header, data = self._tables[file]
        return data[:, [header.index(name) for name in columns]]


def read_header(file: Path, error: type[Exception]) -> list[str]:
    """Return the column names of a CSV file; `error` is raised if it cannot be read."""
    require_bounded(file, _MAX_BYTES, error)
    try:
        # Spreadsheets begin a table with a mark of its encoding.
        with file.open(encoding="utf-8-sig") as stream:
            return [name.strip() for name in stream.readline(_MAX_HEADER_BYTES).split(",")]
    except (OSError, UnicodeDecodeError) as cause:
        raise error(f"{file}: cannot be read: {reason_of(cause)}") from cause


def read_table(file: Path, columns: Sequence[str], error: type[Exception]) -> np.ndarray:
    """Read the named columns of a CSV file; others are ignored.

    Returns:
        Values in the order of `columns`, any unit, (rows, columns).
    """
    header = read_header(file, error)
    missing = [name for name in columns if name not in header]
    if missing:
        hint = ": separate columns by commas" if len(header) == 1 and ";" in header[0] else ""
        raise error(
            f"{file}: columns {', '.join(missing)} are missing: expected {', '.join(columns)}, got"
            f" {', '.join(header) or 'an empty file'}{hint}"
        )
    twice = [name for name in columns if header.count(name) > 1]
    if twice:
        raise error(
            f"{file}: expected each column once, got {twice[0]} {header.count(twice[0])} times: rename"
            " those that are not meant"
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a table without rows is refused below
            rows = np.loadtxt(file, delimiter=",", ndmin=2, skiprows=1, encoding="utf-8")
    except (OSError, ValueError) as cause:
        reason, _, _ = str(cause).partition(";")  # behind it stands what a programmer may do
        # NumPy counts columns from 1 and, in this sentence alone, rows from 0.
        reason = re.sub(
            r"at row (\d+), column", lambda row: f"in row {int(row[1]) + 1}, column", reason
        )
        raise error(f"{file}: is not a table of numbers: {reason}") from cause
    if rows.shape[0] == 0 or rows.shape[1] != len(header):
        got = f"{rows.shape[0]} rows of {rows.shape[1]}" if len(rows) else "none"
        raise error(f"{file}: expected rows of {len(header)} numbers, one for each name, got {got}")
    bad = np.argwhere(~np.isfinite(rows))
    if len(bad):
        row, column = bad[0]
        raise error(
            f"{file}: {header[column]}: expected a finite number, got {rows[row, column]} in row"
            f" {row + 1}"
        )
    return rows[:, [header.index(name) for name in columns]]
