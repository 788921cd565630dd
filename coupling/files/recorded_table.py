"""Columns that a device has recorded, by the names and in the units of its file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

# Units of lengths [m] and times [s].
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "in": 0.0254}
TIMES = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0}
_UNITS = {**LENGTHS, **TIMES}
# Words that devices write for them, in lower case.
_WORDS = {
    **dict.fromkeys(("second", "seconds", "secs", "sekunden"), "s"),
    **dict.fromkeys(("millisecond", "milliseconds", "msec", "msecs", "millisekunden"), "ms"),
    **dict.fromkeys(("microsecond", "microseconds", "usec", "usecs"), "us"),
    **dict.fromkeys(("nanosecond", "nanoseconds", "nsec", "nsecs"), "ns"),
    **dict.fromkeys(("minute", "minutes"), "min"),
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("centimeter", "centimeters", "centimetre", "centimetres"), "cm"),
    **dict.fromkeys(("millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("micrometer", "micrometers", "micrometre", "micrometres", "micron"), "um"),
    **dict.fromkeys(("inch", "inches"), "in"),
}
_BRACKETS = re.compile(r"(.*?)\s*[\[(]\s*([^\[\]()]*?)\s*[\])]\s*")
_SUFFIX = re.compile(r"(.+)_([a-zµμ]+)")


@dataclass(frozen=True)
class RecordedTable:
    """Columns that a device has recorded.

    Attributes:
        path: The file.
        columns: Values in the units of the file, NaN where there is none, by name, (n,) each.
        units: Units by the names of columns that state one.
        left_out: Parts of the file that are not read, in words.
        numbers: Names of a file's columns by their numbers, from 1.
    """

    path: Path
    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    left_out: tuple[str, ...] = ()
    numbers: Mapping[str, str] = field(default_factory=dict)


def name_and_unit(title: str) -> tuple[str, str]:
    """Return the name of a column and its unit; "" where it states none.

    Example:
        >>> [name_and_unit(title) for title in ("X [mm]", "Time(s)", "t_ms", "x", "pos_x", "Zeit")]
        [('X', 'mm'), ('Time', 's'), ('t', 'ms'), ('x', ''), ('pos_x', ''), ('Zeit', '')]
        >>> name_and_unit("Time (Seconds)"), name_and_unit("X (Tool)")
        (('Time', 's'), ('X', 'Tool'))
    """
    if match := _BRACKETS.fullmatch(title):
        unit = match[2].lower()
        return match[1].strip(), _WORDS.get(unit, match[2] if unit not in _UNITS else unit)
    if (match := _SUFFIX.fullmatch(title)) and match[2] in _UNITS:
        return match[1], match[2]
    return title.strip(), ""
