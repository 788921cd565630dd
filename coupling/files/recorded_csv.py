"""Text tables of any device: separators, decimal commas, lines above the table, units in its head."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path

import numpy as np

from coupling.files.bounded_file import read_bounded
from coupling.files.motive_head import is_motive, motive_titles
from coupling.files.recorded_table import RecordedTable, name_and_unit

_MAX_BYTES = 500_000_000
_SEPARATORS = (";", "\t", ",", "|", None)
# Lines above a table at most, and rows by which its separator is found.
_ABOVE, _LOOKED_AT = 200, 40
# Changes of a text at most that tells groups of rows apart.
_GROUPS = 8
# Fewest columns of numbers: time or a number, and three coordinates.
_FEWEST = 3
_NUMBER = re.compile(r"[+-]?([0-9]+([.,][0-9]*)?|[.,][0-9]+)([eE][+-]?[0-9]+)?")
# A number with another mark between its thousands than before its decimals.
_THOUSANDS = re.compile(r"[+-]?[0-9]{1,3}((,[0-9]{3})+\.[0-9]*|(\.[0-9]{3})+,[0-9]*)")
_EMPTY = frozenset(("", "nan", "null", "n/a", "#n/a", "-"))
_DATES = ("%Y-%m-%d", "%d.%m.%Y", "%Y/%m/%d", "%m/%d/%Y", "%m/%d/%y", "%d.%m.%y")
# Days count from one that is near, so that milliseconds are not rounded.
_SOME_DAY = datetime(2020, 1, 1)
# A time of day, perhaps behind a date and before what says which half of the day or which zone it is of.
_CLOCK = re.compile(
    r"(?:(\S+?)[ T]+)?(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?)\s*([AP]M)?"
    r"\s*(?:Z|UTC|GMT|([+-]\d{2}):?(\d{2}))?",
    re.IGNORECASE,
)
_COMMENTS = ("#", "//")


def read_recorded_csv(path: Path, error: type[Exception]) -> RecordedTable:
    """Read a text table.

    Lines that begin with # or // and lines above the table are left out, but for titles in the comment
    above the first row, and columns that are neither numbers nor times. The head of an export of
    OptiTrack's Motive is read as a whole. Times of day and dates count in
    seconds from the first one. Columns of one title have their number behind it.

    Args:
        path: The file.
        error: Exception class for every problem.
    """
    filled = [line for line in _text(path, error).splitlines() if line.strip()]
    read = [k for k, line in enumerate(filled) if not line.lstrip().startswith(_COMMENTS)]
    lines = [filled[k] for k in read]
    separator, first = _layout(path, lines, error)
    rows = _split(lines[first:], separator)
    head = _split(lines[max(first - 2, 0) : first], separator)
    count = len(rows[0])
    if is_motive(lines[0]):
        titles = motive_titles(_split(lines[:first], separator), count)
        above, used = [""] * count, first
    else:
        titles, above, used = _titles(head, count)
    if not used:
        titles = _commented_titles(filled[: read[first]], separator, count) or titles
    for number, row in enumerate(rows):
        if len(row) != count:
            raise error(
                f"{path}: row {number + 1} of the table: expected {count} cells as in its first row, got"
                f" {len(row)}"
            )
    _require_rows_below(path, _split(lines[: first - used], separator), rows[0], error)
    columns, units, texts = {}, {}, []
    marks: dict[str, str] = {}
    names_and_units = _told_apart([name_and_unit(title) for title in titles])
    for (name, stated), unit, cells in zip(
        names_and_units, above, zip(*rows, strict=True), strict=True
    ):
        try:
            values = _values(cells)
        except ValueError as cause:
            raise error(f"{path}: column {name}: {cause}") from cause
        if values is None:
            mixed = next((cell for cell in cells if _THOUSANDS.fullmatch(cell)), "")
            changes = f" (with marks between thousands, as {mixed!r})" if mixed else ""
            texts.append(f"{name}{changes or _describe_changes(cells)}")
            continue
        for mark in ",.":
            cell = next((cell for cell in cells if mark in cell and ":" not in cell), None)
            marks |= {} if cell is None else {mark: cell}
        if "," in marks and ("." in marks or separator == ","):
            raise error(
                f"{path}: column {name}: expected one decimal mark, got {marks[',']!r} and"
                f" {marks.get('.', 'commas between cells')!r}: write decimal points, and no mark between"
                " thousands"
            )
        columns[name] = values
        if any(":" in cell for cell in cells[:1]):
            units[name] = "s"
        elif stated or unit:
            units[name] = stated or unit
    skipped = first - used
    left_out = [f"{skipped} lines above the table"] if skipped > 0 else []
    left_out += [f"the texts {', '.join(texts)}"] if texts else []
    numbers = {str(number): name for number, (name, _) in enumerate(names_and_units, start=1)}
    return RecordedTable(path, columns, units, tuple(left_out), numbers)


def _describe_changes(cells: Sequence[str]) -> str:
    """Return where a text that stands for groups of rows changes; "" for one that does not, or often."""
    rows = [k for k in range(1, len(cells)) if cells[k] != cells[k - 1]]
    if not 0 < len(rows) <= _GROUPS:
        return ""
    return f" (changes to {cells[rows[0]][:40]!r} in row {rows[0] + 1})"


def _text(path: Path, error: type[Exception]) -> str:
    content = read_bounded(path, _MAX_BYTES, error)
    encoding = "utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")  # of programs for Windows
    if "\0" in text:
        raise error(f"{path}: expected a table of text, got bytes that are none")
    return text


def _layout(path: Path, lines: list[str], error: type[Exception]) -> tuple[str | None, int]:
    """Return the separator of a table and the line of its first row of numbers, from 0."""
    best: tuple[int, str | None, int] = (0, None, 0)
    for separator in _SEPARATORS:
        for first in range(min(len(lines), _ABOVE)):
            block = _split(lines[first : first + _LOOKED_AT], separator)
            if len(block) < 2 or len({len(row) for row in block}) > 1:
                continue
            numbers = sum(
                _values([row[k] for row in block]) is not None for k in range(len(block[0]))
            )
            if numbers >= _FEWEST:
                if numbers > best[0]:
                    best = (numbers, separator, first)
                break
    if best[0] == 0:
        raise error(
            f"{path}: expected a table with a column of times and three of positions, got none: is it a"
            " table of text?"
        )
    return best[1], best[2]


def _split(lines: Sequence[str], separator: str | None) -> list[list[str]]:
    if separator is None:
        return [line.split() for line in lines]
    try:
        rows = list(csv.reader(lines, delimiter=separator, skipinitialspace=True))
    except csv.Error:
        return []
    # Some devices end every line with the separator.
    while rows and all(len(row) > 1 and not row[-1].strip() for row in rows):
        rows = [row[:-1] for row in rows]
    return [[cell.strip() for cell in row] for row in rows]


def _require_rows_below(
    path: Path, above: list[list[str]], first: list[str], error: type[Exception]
) -> None:
    """Refuse a table above the table, which a second line of titles ends."""
    numbers = [place for place, cell in enumerate(first) if _NUMBER.fullmatch(cell)]
    for row in above:
        if len(row) == len(first) and all(_NUMBER.fullmatch(row[place]) for place in numbers):
            raise error(
                f"{path}: expected one table, got a row of numbers {' '.join(row)[:60]!r} above the line"
                " of titles: write the titles once, above all rows"
            )


def _titles(head: list[list[str]], count: int) -> tuple[list[str], list[str], int]:
    """Return titles and units of columns, and the number of lines above the table that have them.

    Columns without a title are called by their numbers.
    """
    # A title more or less than a row has cells that are filled.
    lines = [[*line, ""][:count] for line in head if abs(len(line) - count) <= 1]
    if not lines:
        return [str(number) for number in range(1, count + 1)], [""] * count, 0
    if len(lines) == 2 and all(len(cell.strip("[]()")) <= 5 for cell in lines[1]):
        first = [name_and_unit(f"x [{cell.strip('[]()')}]")[1] for cell in lines[1]]
        if any(unit in ("s", "ms", "us", "m", "mm", "um", "µm") for unit in first):
            return lines[0], first, 2
    titles = [cell or str(number) for number, cell in enumerate(lines[-1], start=1)]
    return titles, [""] * count, 1


def _commented_titles(above: Sequence[str], separator: str | None, count: int) -> list[str]:
    """Return the titles in the comment right above the first row; none where it has others."""
    comment = above[-1].strip() if above else ""
    if not comment.startswith(_COMMENTS):
        return []
    cells = _split([comment.lstrip("#/ ")], separator)[0]
    is_title = len(cells) == count and not any(_NUMBER.fullmatch(cell) for cell in cells)
    return cells if is_title else []


def _told_apart(names_and_units: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return names and units of columns, those that several have with the column's number."""
    names = [name for name, _ in names_and_units]
    return [
        (name if names.count(name) == 1 else f"{name} ({number})", unit)
        for number, (name, unit) in enumerate(names_and_units, start=1)
    ]


def _values(cells: Sequence[str]) -> np.ndarray | None:
    """Return cells as numbers, or as seconds from the first time; None where they are texts.

    Raises:
        ValueError: If a cell is a text behind many numbers.
    """
    filled = [cell for cell in cells if cell.lower() not in _EMPTY]
    if not filled:
        return None
    if all(_NUMBER.fullmatch(cell) for cell in filled[:_LOOKED_AT]):
        for cell in filled[_LOOKED_AT:]:
            if not _NUMBER.fullmatch(cell):
                row = cells.index(cell) + 1
                raise ValueError(f"expected a number in row {row} of the table, got {cell[:40]!r}")
        return np.array(
            [np.nan if c.lower() in _EMPTY else float(c.replace(",", ".")) for c in cells]
        )
    seconds = [_seconds(cell) for cell in cells]
    instants = [value for value in seconds if value is not None]
    return np.array(instants) - instants[0] if instants and len(instants) == len(cells) else None


def _seconds(cell: str) -> float | None:
    """Return a time of day, or a date with one [s]; None for something else."""
    match = _CLOCK.fullmatch(cell.strip("'\""))
    if match is None:
        return None
    date, hours, minutes, seconds, half, zone_hours, zone_minutes = match.groups()
    day = _day(date) if date else 0.0
    if day is None or (half and not 1 <= int(hours) <= 12):
        return None
    hour = int(hours) if not half else int(hours) % 12 + 12 * (half.upper() == "PM")
    zone = 0.0
    if zone_hours:
        zone = 3600.0 * int(zone_hours) + math.copysign(60.0 * int(zone_minutes), int(zone_hours))
    return day + 3600.0 * hour + 60.0 * int(minutes) + float(seconds.replace(",", ".")) - zone


def _day(date: str) -> float | None:
    """Return the beginning of a day [s]; None for something else."""
    for form in _DATES:
        with suppress(ValueError):
            return 86400.0 * (datetime.strptime(date, form) - _SOME_DAY).days
    return None
