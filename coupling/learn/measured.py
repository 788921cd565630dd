"""measured.csv -> where the tool was seen, over time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.errors import LearnError
from coupling.files.measured_table import MeasuredTable
from coupling.learn.measurement import Measurement

_TIME, _POSITION, _ROTATION = ("time",), ("x", "y", "z"), ("qx", "qy", "qz", "qw")
# A quaternion is of length 1 to this.
_UNIT = 1e-2
# Fewest rows that can be a pass.
_FEWEST = 20


def read_seen(path: Path) -> Measurement:
    """Read where a tool was seen (columns: docs/learn.md).

    Args:
        path: CSV file; lines that begin with # are comments, other columns are ignored.

    Raises:
        LearnError: With file, line, column, what was expected and what was got.
    """
    table = MeasuredTable.read(path, LearnError)
    table.require((*_TIME, *_POSITION))
    table.require_whole(_ROTATION)
    time, position = table.of(_TIME)[:, 0], table.of(_POSITION)
    if len(time) < _FEWEST:
        raise LearnError(f"{path}: expected at least {_FEWEST} rows, got {len(time)}")
    falls = np.flatnonzero(np.diff(time) <= 0.0)
    if len(falls):
        raise table.row_error("time", int(falls[0]) + 1, f"more than {time[falls[0]]:.9g}")
    rotation = None
    if table.has(_ROTATION):
        quaternion = table.of(_ROTATION)
        off = np.abs(np.linalg.norm(quaternion, axis=1) - 1.0)
        if off.max() > _UNIT:
            raise table.row_error("qx", int(np.argmax(off)), "a quaternion of length 1")
        rotation = Rotation.from_quat(quaternion)
    return Measurement(path.name, time, position, rotation)
