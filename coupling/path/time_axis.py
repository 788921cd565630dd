"""Checks of values over time that are common to paths, motions and wrenches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np


class Timed(Protocol):
    """Values over time."""

    @property
    def time(self) -> np.ndarray:
        """Times [s], (n,)."""


def require_history(time: np.ndarray, values: np.ndarray, name: str, jumps: bool = False) -> None:
    """Raise a ValueError unless values (n, k) of any unit are finite and times (n,) [s] rise.

    Where there may be jumps a time may stand twice.
    """
    if time.ndim != 1 or len(time) < 2 or values.ndim != 2 or len(values) != len(time):
        raise ValueError(
            f"{name}: expected times (n,) and values (n, k), n >= 2, got shapes {time.shape} and"
            f" {values.shape}"
        )
    if not np.all(np.isfinite(time)) or not np.all(np.isfinite(values)):
        raise ValueError(f"{name}: expected finite times and values, got one that is not finite")
    falls = np.diff(time) < 0.0 if jumps else np.diff(time) <= 0.0
    if jumps:
        falls[1:] |= time[2:] == time[:-2]
    if np.any(falls):
        row = int(np.argmax(falls))
        raise ValueError(
            f"{name}: time: expected rising values, got {time[row + 1]:.9g} s after"
            f" {time[row]:.9g} s in row {row + 2}"
        )


def of_tools(
    time: np.ndarray, values: np.ndarray, columns: int, name: str, jumps: bool = False
) -> np.ndarray:
    """Return checked values, any unit, (tools, n, columns), from those of a single tool as well."""
    stacked = values[None] if values.ndim == 2 else values
    if stacked.ndim != 3 or len(stacked) == 0 or stacked.shape[2] != columns:
        raise ValueError(
            f"{name}: expected values (tools, n, {columns}), or (n, {columns}) for one tool, got"
            f" shape {values.shape}"
        )
    for tool in stacked:
        require_history(time, tool, name, jumps)
    return stacked


def common_time(histories: Sequence[Timed], name: str) -> np.ndarray:
    """Return the times [s], (n,), that all histories have; raise a ValueError where they differ."""
    time = histories[0].time
    if not all(np.array_equal(history.time, time) for history in histories):
        raise ValueError(f"{name}: expected the same times for all tools, got different times")
    return time
