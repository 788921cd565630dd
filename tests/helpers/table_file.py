"""What a trajectory file holds, by docs/fmu.md#trajectories, to compare the C core with."""

from __future__ import annotations

import io
import os
import re
import stat
from pathlib import Path

import numpy as np
from npz_file import parse_npz

MOST_BYTES = 1 << 30
MOST_COLUMNS = 256
MOST_DIGITS = 800
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_BLANKS = b" \t\r"
_NUMBER = rb"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_CELL = re.compile(rb"[ \t\r]*(" + _NUMBER + rb")[ \t\r]*")


def read_table(path: Path) -> tuple[list[str], np.ndarray]:
    """Return the names of a file's columns and its numbers, (rows, columns).

    Raises:
        ValueError: With what was expected and what was got, but not in which file.
    """
    try:
        status = os.stat(path)
        if stat.S_ISDIR(status.st_mode):
            raise ValueError("expected a file, got a folder")
        if not stat.S_ISREG(status.st_mode):  # opening a pipe could wait for ever
            raise ValueError("expected a file, got a pipe or device")
        if status.st_size > MOST_BYTES:
            raise ValueError(f"expected at most {MOST_BYTES} bytes, got {status.st_size}")
        content = path.read_bytes()
    except FileNotFoundError:
        raise ValueError("does not exist") from None
    except OSError as error:
        raise ValueError(f"cannot be read: {error.strerror}") from error
    return parse_table(content, path.name.endswith(".npz"))


def parse_table(content: bytes, is_npz: bool) -> tuple[list[str], np.ndarray]:
    """Return the names of the columns and the numbers, (rows, columns), of a file's content.

    Args:
        content: All bytes of the file.
        is_npz: Its name ends in .npz; otherwise the content decides.

    Raises:
        ValueError: As `read_table`.
    """
    if not content:
        raise ValueError("expected a table, got an empty file")
    if is_npz or content.startswith(b"PK\3\4"):
        names, data = parse_npz(content)
        _require_columns(len(names))
        if len(names) != data.shape[1]:
            raise ValueError(f"{len(names)} column names over {data.shape[1]} columns")
        return [_shown(name.encode("ascii")) for name in names], data
    return _parse_csv(content)


def _require_columns(count: int) -> None:
    if count > MOST_COLUMNS:
        raise ValueError(f"expected at most {MOST_COLUMNS} columns, got more")


def _shown(name: bytes) -> str:
    """Return a name without blanks around it, as far as a message may show what may be anything."""
    return "".join(chr(c) if 32 <= c < 127 else "?" for c in name.strip(_BLANKS))


def _parse_csv(text: bytes) -> tuple[list[str], np.ndarray]:
    zero = text.find(b"\0")
    if zero >= 0:
        raise ValueError(f"expected text, got a zero byte in line {1 + text.count(10, 0, zero)}")
    header, *lines = text.removeprefix(_BYTE_ORDER_MARK).split(b"\n")
    names = header.split(b",")
    _require_columns(len(names))
    cells = rb"[ \t\r]*,[ \t\r]*".join([_NUMBER] * len(names))
    row, numbered_lines = re.compile(rb"[ \t\r]*" + cells + rb"[ \t\r]*"), []
    for number, line in enumerate(lines, start=2):
        bare = line.lstrip(_BLANKS)
        if not bare or bare.startswith(b"#"):
            continue
        if len(bare) > MOST_DIGITS or not row.fullmatch(bare):
            _require_row(bare, len(names), number)
        numbered_lines.append((number, bare))
    data = np.empty((0, len(names)))
    if numbered_lines:
        # NumPy takes a carriage return for a line's end; here it is a blank.
        joined = io.BytesIO(b"\n".join(line.replace(b"\r", b" ") for _, line in numbered_lines))
        data = np.loadtxt(joined, delimiter=",", comments=None, ndmin=2)
    huge = np.flatnonzero(~np.isfinite(data).all(axis=1))
    if len(huge):
        number, line = numbered_lines[huge[0]]
        raise _no_number(number, line.split(b",")[int(np.argmin(np.isfinite(data[huge[0]])))])
    return [_shown(name) for name in names], data


def _require_row(line: bytes, columns: int, number: int) -> None:
    """Refuse a line that is not as many numbers as there are columns, cell by cell."""
    at, count = 0, 0
    while True:
        cell = _CELL.match(line, at)
        if cell is None or len(cell[1]) > MOST_DIGITS or np.isinf(float(cell[1])):
            raise _no_number(number, line[at:].split(b",")[0])
        at, count = cell.end(), count + 1
        if at == len(line):
            break
        if line[at : at + 1] != b",":
            raise ValueError(
                f"line {number}: expected a comma between two numbers, got '{_shown(line[at : at + 1])}'"
            )
        at += 1
    if count != columns:
        raise ValueError(f"line {number}: {columns} column names over {count} columns")


def _no_number(number: int, got: bytes) -> ValueError:
    return ValueError(
        f"line {number}: expected a finite number, got '{_shown(got.strip(_BLANKS)[:39])}'"
    )
