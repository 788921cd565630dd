"""Periodic errors of the links' encoders: lines in a turn, found in what a fit leaves of wind-ups."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

# Fewest lines in a turn: what is slower may be the gear's.
_FEWEST = 100.0
# A line is one if it takes this part of what is left, in the sum over all recordings.
_TAKES = 0.1
# How many periods of a line a motion must cover; most lines of an encoder.
_PERIODS, _MOST_LINES = 20.0, 2
# Points in a main lobe of the spectrum.
_POINTS = 8


def encoder_lines(left: Sequence[np.ndarray], angle: Sequence[np.ndarray]) -> tuple[float, ...]:
    """Return the numbers of periods in a turn that what is left of wind-ups has.

    An incremental encoder's scale begins anywhere in each recording, so that every recording has a phase
    of its own; the number must be the same.

    Args:
        left: What is left in each recording [rad], (n,) each.
        angle: Angles of the link [rad], (n,) each.

    Example:
        >>> turn = np.sin(np.linspace(0.0, 6.0, 4000))
        >>> encoder_lines([2e-5 * np.cos(512.0 * turn + 1.0)], [turn])
        (512.0,)
    """
    travel = max(float(np.ptp(own)) for own in angle)
    if travel <= 0.0:
        return ()
    # Two samples a period where the link turns fastest.
    fastest = max(float(np.abs(np.diff(own)).max()) for own in angle)
    lowest = max(_FEWEST, 2.0 * np.pi * _PERIODS / travel)
    tried = np.arange(lowest, np.pi / fastest, 2.0 * np.pi / travel / _POINTS)
    rest = [own - own.mean() for own in left]
    found: list[float] = []
    while len(tried) and len(found) < _MOST_LINES:
        takes = _taken(rest, angle, tried)
        best = float(tried[int(np.argmax(takes))])
        step = tried[1] - tried[0] if len(tried) > 1 else 1.0
        near = best + step * np.linspace(-1.0, 1.0, 41)
        near_takes = _taken(rest, angle, near)
        best = round(float(near[int(np.argmax(near_takes))]), 1)
        if near_takes.max() < _TAKES:
            break
        found.append(best)
        rest = [own - _fitted(own, best * turn) for own, turn in zip(rest, angle, strict=True)]
    return tuple(found)


def _taken(
    left: Sequence[np.ndarray], angle: Sequence[np.ndarray], lines: np.ndarray
) -> np.ndarray:
    """Return the part of the squares that each line takes, (len(lines),)."""
    whole = sum(float(own @ own) for own in left)
    taken = np.zeros(len(lines))
    for own, turn in zip(left, angle, strict=True):
        for k, line in enumerate(lines.tolist()):
            taken[k] += 2.0 * abs(np.exp(1j * line * turn) @ own) ** 2 / len(own)
    share: np.ndarray = taken / max(whole, 1e-300)
    return share


def _fitted(left: np.ndarray, phase: np.ndarray) -> np.ndarray:
    columns = np.column_stack([np.cos(phase), np.sin(phase)])
    fitted: np.ndarray = columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
    return fitted
