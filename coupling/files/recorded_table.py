"""Columns that a device has recorded, by the names and in the units of its file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

# Units of lengths [m] and times [s].
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "in": 0.0254}
TIMES = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0}
_UNITS = {**LENGTHS, **TIMES}
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
    """

    path: Path
    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    left_out: tuple[str, ...] = ()


def name_and_unit(title: str) -> tuple[str, str]:
    """Return the name of a column and its unit; "" where it states none.

    Example:
        >>> [name_and_unit(title) for title in ("X [mm]", "Time(s)", "t_ms", "x", "pos_x", "Zeit")]
        [('X', 'mm'), ('Time', 's'), ('t', 'ms'), ('x', ''), ('pos_x', ''), ('Zeit', '')]
    """
    if match := _BRACKETS.fullmatch(title):
        return match[1].strip(), match[2]
    if (match := _SUFFIX.fullmatch(title)) and match[2] in _UNITS:
        return match[1], match[2]
    return title.strip(), ""
