"""Traces of KUKA's controllers, and what else DIAdem writes: a head of text and a file of numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coupling.errors import reason_of
from coupling.files.bounded_file import read_bounded
from coupling.files.recorded_table import RecordedTable

_MAX_BYTES = 500_000_000
# Where a head has its first channel [bytes].
_LOOKED_AT = 65_536
_BEGIN, _END = "#BEGINCHANNELHEADER", "#ENDCHANNELHEADER"
# Types of numbers by the words of the head.
_TYPES = {"REAL64": "<f8", "REAL32": "<f4", "INT32": "<i4", "INT16": "<i2", "WORD16": "<u2"}
# Keys of a channel.
_NAME, _UNIT, _KIND, _FILE, _STORAGE, _TYPE = "200", "202", "210", "211", "213", "214"
_COUNT, _PLACE, _START, _STEP = "220", "221", "240", "241"


def is_trace(path: Path) -> bool:
    """Return whether a file is the head of a trace."""
    with path.open("rb") as stream:
        return _BEGIN.encode() in stream.read(_LOOKED_AT)


def read_recorded_trace(path: Path, error: type[Exception]) -> RecordedTable:
    """Read a trace by its head, a .dat beside its .r64.

    Args:
        path: The head.
        error: Exception class for every problem.
    """
    text = read_bounded(path, _MAX_BYTES, error).decode("cp1252", errors="replace")
    channels = _channels(text)
    if not channels:
        raise error(f"{path}: expected channels of a trace, got none")
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    left_out: list[str] = []
    for channel in channels:
        name = channel.get(_NAME, "").strip() or f"channel {len(columns) + 1}"
        try:
            values = _channel(path, channel, error)
        except (KeyError, ValueError, OverflowError) as cause:
            raise error(
                f"{path}: channel {name}: expected the number of its values, their file and type, got"
                f" {reason_of(cause)}"
            ) from cause
        if values is None:
            left_out.append(f"the channel {name}")
            continue
        if name in columns:
            raise error(f"{path}: expected one channel {name!r}, got two")
        columns[name] = values
        if unit := channel.get(_UNIT, "").strip(" []"):
            units[name] = unit
    lengths = {len(values) for values in columns.values()}
    if len(lengths) > 1:
        raise error(f"{path}: expected channels of one length, got {sorted(lengths)} values")
    return RecordedTable(path, columns, units, tuple(left_out))


def _channels(text: str) -> list[dict[str, str]]:
    """Return the entries of each channel by their numbers."""
    channels: list[dict[str, str]] = []
    channel: dict[str, str] | None = None
    for line in map(str.strip, text.splitlines()):
        if line.startswith(_BEGIN):
            channel = {}
        elif line.startswith(_END) and channel is not None:
            channels.append(channel)
            channel = None
        elif channel is not None:
            key, _, value = line.partition(",")
            channel[key.strip()] = value.strip()
    return channels


def _channel(path: Path, channel: dict[str, str], error: type[Exception]) -> np.ndarray | None:
    """Return the values of a channel; None of one that is no number."""
    count = int(channel[_COUNT])
    start, step = float(channel.get(_START, "0")), float(channel.get(_STEP, "1"))
    if not 0 <= count <= _MAX_BYTES // 8:
        raise ValueError(f"{count} values")
    if channel.get(_KIND, "").upper().startswith("IMPL"):
        return start + step * np.arange(count)
    kind = _TYPES.get(channel.get(_TYPE, "").upper())
    if kind is None:
        return None
    file = path.parent / Path(channel[_FILE].replace("\\", "/")).name
    content = np.frombuffer(_whole(read_bounded(file, _MAX_BYTES, error), kind), kind)
    place = int(channel.get(_PLACE, "1")) - 1
    if channel.get(_STORAGE, "BLOCK").upper() == "BLOCK":
        # The channels of a file take turns.
        width = -(-len(content) // max(count, 1))
        values = content[place::width] if 0 <= place < width else content[:0]
    else:
        values = content[max(place, 0) : place + count]
    if len(values) != count:
        raise error(
            f"{file}: expected {count} values of each channel, got {len(values)}: it is cut short"
        )
    return start + step * values.astype(float)


def _whole(content: bytes, kind: str) -> bytes:
    size = np.dtype(kind).itemsize
    return content[: len(content) // size * size]
