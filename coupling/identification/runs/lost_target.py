"""Rows that a measuring device wrote while it had lost its target: they are not where the tool was."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter

from coupling.errors import LearnError

# How far the tool goes while a position repeats, that it is not for its digits, tenths of a millimetre
# [m].
_MOVED = 2e-4
# Rows around one by whose median it is judged, and how far beside no tool is [m].
_AROUND, _BESIDE = 7, 0.01
# Rows that may be, as a part.
_MOST_BESIDE = 0.05
# A jump of positions: its size, more than digits make [m], and by how much it exceeds all other changes
# over its time but those of another jump.  Simulated strikes, reversals, vibration and noise exceed that
# in one recording of 2000.
_JUMP, _EXCEEDS, _JUMPS = 1e-4, 4.5, 2
# Part of a jump by which those after it stay off those before.
_STAYS = 0.5


def rows_of_target(name: str, position: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Return the rows in which a tool was detected, (k,).

    These are not the ones that repeat the position before them, to the last digit, while the tool moves,
    as devices do that hold their last value, nor those a centimetre beside the ones around.

    Args:
        name: Name of the measurement.
        position: Measured positions [m], (n, 3).
        there: Simulated positions of the tool at the same times [m], (n, 3).

    Raises:
        LearnError: If too many of these are.
    """
    repeats_position = _repeated(position, there)
    near = near_those_around(name, (position - there)[~repeats_position], _BESIDE)
    return np.flatnonzero(~repeats_position)[near]


def near_those_around(name: str, unmodelled: np.ndarray, far: float) -> np.ndarray:
    """Return which rows are not far beside those around them, (n,).

    Args:
        name: Name of the measurement.
        unmodelled: Measured less simulated positions [m], (n, 3).
        far: Distance from which on one is [m].

    Raises:
        LearnError: If too many are.
    """
    near: np.ndarray = distance_from_neighbours(unmodelled) <= far
    outlier_count = len(near) - np.count_nonzero(near)
    if outlier_count > _MOST_BESIDE * len(near):
        raise LearnError(
            f"{name}: expected a continuous path, got {outlier_count} of {len(near)} positions that are"
            f" more than {1e3 * far:.3g} mm off their neighbours: has the device lost its target?"
        )
    return near


def distance_from_neighbours(unmodelled: np.ndarray) -> np.ndarray:
    """Return how far rows (n, 3) are from the median of those around them, in their unit, (n,)."""
    median = median_filter(unmodelled, size=(_AROUND, 1), mode="nearest")
    distance: np.ndarray = np.linalg.norm(unmodelled - median, axis=1)
    return distance


def _repeated(position: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Return which rows repeat the one before while the tool moves away from there, (n,)."""
    repeats = np.append(False, np.all(np.diff(position, axis=0) == 0.0, axis=1))
    first = np.maximum.accumulate(np.where(repeats, 0, np.arange(len(position))))
    step = np.zeros(len(position))
    np.maximum.at(step, first, np.linalg.norm(there - there[first], axis=1))
    repeats_position: np.ndarray = repeats & (step[first] > _MOVED)
    return repeats_position


def require_steady(name: str, time: np.ndarray, unmodelled: np.ndarray) -> None:
    """Refuse positions that jump to the next row, however late, and stay there, as no tool does.

    Args:
        name: Name of the measurement.
        time: Times [s], (n,).
        unmodelled: Measured less simulated positions [m], (n, 3).

    Raises:
        LearnError: With the largest jump.
    """
    change, steps = np.linalg.norm(np.diff(unmodelled, axis=0), axis=1), np.diff(time)
    lags, most = np.rint(steps / np.median(steps)).astype(int), np.full(len(change), np.inf)
    for lag in np.unique(lags[2 * _JUMPS * lags < len(change)]).clip(1):
        # A jump is in as many changes as the rows that they reach over.
        elsewhere = np.sort(np.linalg.norm(unmodelled[lag:] - unmodelled[:-lag], axis=1))
        most[lags.clip(1) == lag] = max(_JUMP, _EXCEEDS * elsewhere[-_JUMPS * lag - 1])
    # Beside an outlier those around it are where they were.
    rows, half = np.arange(len(change)), _AROUND // 2
    median = median_filter(unmodelled, size=(_AROUND, 1), mode="nearest")
    before, after = (
        median[np.maximum(rows - half, 0)],
        median[np.minimum(rows + half + 1, rows[-1] + 1)],
    )
    change[np.linalg.norm(after - before, axis=1) < _STAYS * change] = 0.0
    if np.any(change > most):
        worst = int(np.argmax(change / most))
        raise LearnError(
            f"{name}: expected a continuous path, got a permanent jump by {1e3 * change[worst]:.3g}"
            f" mm at {time[worst + 1]:.6g} s: has the device lost its target and found it elsewhere?"
            " Give only the rows before or after it"
        )
