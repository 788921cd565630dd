"""Which columns of a device's file are time, position and orientation, and in which units."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from coupling.errors import LearnError, reason_of
from coupling.files.recorded_bag import is_bag, read_recorded_bag
from coupling.files.recorded_csv import read_recorded_csv
from coupling.files.recorded_table import LENGTHS, TIMES, RecordedTable
from coupling.files.recorded_trace import is_trace, read_recorded_trace

QUANTITIES = ("time", "x", "y", "z")
ORIENTATION = ("qx", "qy", "qz", "qw")
# Names that devices have for them, in lower case and without anything but letters and digits.
_TIME_NAMES = {"time", "t", "timestamp", "zeit", "zeitstempel", "elapsedtime", "elapsed"}
_AXIS_NAMES = (
    "{}",
    "pos{}",
    "{}pos",
    "position{}",
    "{}position",
    "{}act",
    "act{}",
    "tcp{}",
    "{}tcp",
)
_RATE = re.compile(r"([0-9]*\.?[0-9]*[1-9][0-9]*\.?[0-9]*) ?Hz")
# A step so many times as long as usual is a gap.
_GAP = 5.0
# A quaternion is of length 1 to this.
_UNIT = 1e-2


@dataclass(frozen=True)
class ColumnChoice:
    """Columns of a file that somebody has named.

    Attributes:
        names: Names of columns by `QUANTITIES` and `ORIENTATION`, and of a bag's "topic"; of time also
            the rate of the rows, such as "1000Hz".
        length, time: Units of columns that state none; "" for none.

    Example:
        >>> ColumnChoice.of("time=t, x=X1", "mm,ms")
        ColumnChoice(names={'time': 't', 'x': 'X1'}, length='mm', time='ms')
    """

    names: Mapping[str, str] = field(default_factory=dict)
    length: str = ""
    time: str = ""

    @classmethod
    def of(cls, columns: str | None, unit: str | None) -> ColumnChoice:
        """Return the choice of the options --columns and --unit.

        Raises:
            LearnError: If they name something else.
        """
        names, known = {}, (*QUANTITIES, *ORIENTATION, "topic")
        for pair in (columns or "").split(",") if columns else ():
            quantity, sign, name = (part.strip() for part in pair.partition("="))
            if quantity not in known or not sign or not name:
                raise LearnError(
                    f"--columns: expected QUANTITY=COLUMN between commas, the quantity one of"
                    f" {', '.join(known)}, got {pair.strip()!r}"
                )
            names[quantity] = name
        units = {"length": "", "time": ""}
        for word in (unit or "").split(",") if unit else ():
            kind = {**dict.fromkeys(LENGTHS, "length"), **dict.fromkeys(TIMES, "time")}.get(
                word.strip()
            )
            if kind is None or units[kind]:
                raise LearnError(
                    f"--unit: expected a unit of lengths, of times or one of each, such as mm,ms, got"
                    f" {unit!r}"
                )
            units[kind] = word.strip()
        return cls(names, **units)


@dataclass(frozen=True)
class Understood:
    """How a device's file was understood.

    Attributes:
        columns: Quantity, name of its column and unit, of each that is read.
        rows: Number of rows.
        rate: Usual rate of its rows [Hz].
        gaps: Beginning and length of gaps between rows, [s], the longest first.
        left_out: Parts of the file that are not read, in words.
    """

    columns: tuple[tuple[str, str, str], ...]
    rows: int
    rate: float
    gaps: tuple[tuple[float, float], ...]
    left_out: tuple[str, ...]

    @classmethod
    def of(
        cls,
        columns: Sequence[tuple[str, str, str]],
        time: np.ndarray,
        left_out: Sequence[str] = (),
    ) -> Understood:
        """Return how a file with times [s], (n,), was understood."""
        steps = np.diff(time)
        usual = float(np.median(steps)) if len(steps) else np.inf
        gaps = [(float(time[k]), float(steps[k])) for k in np.flatnonzero(steps > _GAP * usual)]
        return cls(
            columns=tuple(columns),
            rows=len(time),
            rate=1.0 / usual if usual > 0.0 else np.nan,
            gaps=tuple(sorted(gaps, key=lambda gap: -gap[1])),
            left_out=tuple(left_out),
        )

    @property
    def sentence(self) -> str:
        """How it was understood, in a sentence."""
        columns = ", ".join(
            f"{name} [{unit}] is {quantity}" for quantity, name, unit in self.columns
        )
        text = f"{columns}; {self.rows} rows at {self.rate:.4g} Hz"
        if self.gaps:
            begin, length = self.gaps[0]
            text += f"; {len(self.gaps)} gaps, the longest {length:.3g} s at {begin:.3f} s"
        return text + (f"; left out: {', '.join(self.left_out)}" if self.left_out else "")


def read_recorded(path: Path, choice: ColumnChoice) -> RecordedTable:
    """Read the file of a device: a bag, a trace or a table of text.

    Raises:
        LearnError: If it cannot be read.
    """
    if is_bag(path):
        return read_recorded_bag(path, choice.names.get("topic"), LearnError)
    try:
        read = read_recorded_trace if is_trace(path) else read_recorded_csv
    except OSError as cause:
        raise LearnError(f"{path}: cannot be read: {reason_of(cause)}") from cause
    return read(path, LearnError)


def chosen_columns(
    table: RecordedTable, choice: ColumnChoice
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None, Understood]:
    """Return times [s], (n,), positions [m], (n, 3), quaternions, (n, 4) or None, and how that is known.

    Raises:
        LearnError: If a column is missing, could be several, or its unit is not known.
    """
    choice = _with_titles(table, choice)
    _require_names(table, choice)
    rate = _RATE.fullmatch(choice.names.get("time", ""))
    if rate is not None:
        rows = len(next(iter(table.columns.values())))
        clock = {choice.names["time"]: np.arange(rows) / float(rate[1])}
        table = replace(
            table,
            columns=clock | dict(table.columns),
            units={**table.units, **dict.fromkeys(clock, "s")},
        )
    columns = [
        _column(table, quantity, choice, TIMES if quantity == "time" else LENGTHS)
        for quantity in QUANTITIES
    ]
    values = np.column_stack([scale * table.columns[name] for _, name, _, scale in columns])
    quaternion = None
    if all(choice.names.get(name, name) in table.columns for name in ORIENTATION):
        names = [choice.names.get(name, name) for name in ORIENTATION]
        quaternion = np.column_stack([table.columns[name] for name in names])
        columns += [(part, name, "1", 1.0) for part, name in zip(ORIENTATION, names, strict=True)]
    used = {name for _, name, _, _ in columns}
    others = [name for name in table.columns if name not in used]
    if w := next((name for name in others if name in ("w", "W")), None):
        names = [name for _, name, _, _ in columns[1:4]]
        require_positions(table.path, np.column_stack([table.columns[n] for n in (*names, w)]))
    whole = np.isfinite(values).all(axis=1)
    if quaternion is not None:
        whole &= np.isfinite(quaternion).all(axis=1)
        quaternion = quaternion[whole]
    # A device that repeats a time has written a row twice.
    kept = np.flatnonzero(whole)
    again = np.flatnonzero(np.diff(values[kept, 0]) == 0.0) + 1
    if 2 * len(again) > len(kept):
        raise LearnError(
            f"{table.path}: time: expected a time of its own for each row, got the same in"
            f" {len(again)} of {len(kept)} rows: give the rate of the rows, such as --columns"
            " time=1000Hz"
        )
    kept = np.delete(np.arange(len(kept)), again)
    values = values[whole][kept]
    quaternion = None if quaternion is None else quaternion[kept]
    left_out = list(table.left_out)
    if not whole.all():
        left_out.append(f"{np.count_nonzero(~whole)} rows with empty cells")
    if len(again):
        left_out.append(f"{len(again)} rows at the time of the one before")
    if others:
        left_out.append(f"the columns {', '.join(others)}")
    time = values[:, 0]
    understood = Understood.of([column[:3] for column in columns], time, left_out)
    return time, values[:, 1:], quaternion, understood


def require_positions(path: Path, values: np.ndarray) -> None:
    """Refuse columns x, y, z that are a unit quaternion with the column w beside them, (rows, 4).

    Raises:
        LearnError: If they are.
    """
    off = np.abs(np.linalg.norm(values, axis=1) - 1.0)
    if np.nanmax(off, initial=0.0) < _UNIT:
        raise LearnError(
            f"{path}: expected positions, got unit quaternions in x, y, z, w: name the columns, such as"
            " --columns x=px,y=py,z=pz,qx=x,qy=y,qz=z,qw=w"
        )


def _with_titles(table: RecordedTable, choice: ColumnChoice) -> ColumnChoice:
    """Return a choice with the titles of columns that it names by their numbers."""
    titles = {
        quantity: name if name in table.columns else table.numbers.get(name, name)
        for quantity, name in choice.names.items()
    }
    return replace(choice, names=titles)


def _candidates(table: RecordedTable, quantity: str) -> list[str]:
    """Return the columns whose names mean a quantity."""
    return [name for name in table.columns if _means(name, quantity)]


def _require_names(table: RecordedTable, choice: ColumnChoice) -> None:
    """Refuse a table in which it is not clear which columns are time and position."""
    unclear = {
        quantity: names
        for quantity in QUANTITIES
        if quantity not in choice.names and len(names := _candidates(table, quantity)) != 1
    }
    if not unclear:
        return
    candidates = [name for names in unclear.values() for name in names] or list(table.columns)
    # A number for a title says nothing, the first of its values does.
    shown = [
        f"{name} (first {table.columns[name][0]:g})" if name.isdecimal() else name
        for name in candidates
    ]
    rate = ", or the rate of its rows, time=1000Hz" if "time" in unclear else ""
    texts = f" (without {', '.join(table.left_out)})" if table.left_out else ""
    raise LearnError(
        f"{table.path}: expected one column of {' and of '.join(unclear)}, got"
        f" {', '.join(shown)}{texts}: name it with --columns"
        f" {','.join(f'{quantity}=NAME' for quantity in unclear)}{rate}"
    )


def _column(
    table: RecordedTable, quantity: str, choice: ColumnChoice, units: Mapping[str, float]
) -> tuple[str, str, str, float]:
    """Return a quantity, the name of its column, its unit, and that in SI."""
    there = ", ".join(table.columns)
    name = choice.names.get(quantity) or _candidates(table, quantity)[0]
    if name not in table.columns:
        raise LearnError(
            f"{table.path}: --columns: expected a column of the file for {quantity}, got {name!r}; there"
            f" are {there}"
        )
    stated, chosen = table.units.get(name, ""), choice.time if units is TIMES else choice.length
    if stated and stated not in units:
        raise LearnError(
            f"{table.path}: column {name}: expected a unit of {', '.join(units)}, got {stated!r}"
        )
    if stated and chosen and units[stated] != units[chosen]:
        raise LearnError(
            f"{table.path}: column {name}: is in {stated} by its name, got --unit {chosen}: leave it out"
        )
    unit = stated or chosen or ({"time": "s"}.get(quantity, "m") if name == quantity else "")
    if not unit:
        raise LearnError(
            f"{table.path}: column {name}: its unit is not stated: give it, such as --unit"
            f" {'ms' if units is TIMES else 'mm'}"
        )
    return quantity, name, unit, units[unit]


def _means(name: str, quantity: str) -> bool:
    """Return whether a column's name is one that devices have for a quantity."""
    title = re.sub(r" \([0-9]+\)$", "", name)  # one of several of this title
    plain = re.sub(r"[^a-z0-9]", "", title.lower())
    if quantity == "time":
        return plain in _TIME_NAMES
    names = {pattern.format(quantity) for pattern in _AXIS_NAMES}
    return plain in names or plain.endswith(f"position{quantity}")
