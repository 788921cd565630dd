"""A KUKA KR 300 identified from one recorded motion, and what that predicts of another: docs/motion.md.

Fitted to recording A; of recording B nothing is fitted but the zeros of the encoders behind the gears,
which incremental scales do not know. Beside it, what a lag alone says that is the same on all axes.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from coupling.identification.motion.recording import Recording
from coupling.identification.motion.sensors import delayed
from coupling.results.motion_result import RecordingResult
from docs.scripts import trust_recordings as recordings
from docs.scripts.make_motion import found, recording
from docs.scripts.page import table
from docs.scripts.trust_comparison import Comparison

# Longest lag between a joint's two encoders that is looked for, and how exactly [s].
_LONGEST, _EXACT = 0.02, 1e-8


@cache
def predicted() -> RecordingResult:
    """Return recording B as a fit to A predicts it."""
    (one,) = (own for own in found("A", "B").recordings if own.held_out)
    return one


def torques() -> recordings.Torques:
    """Return its motor torques, smoothed as those of the shipped file are."""
    one = predicted()
    time, measured, left = map(np.array, (one.time, one.measured_torque, one.left_torque))
    smoothed = [recordings.smooth(own.T, time) for own in (measured, measured - left)]
    return recordings.Torques(time, *smoothed)


def one_lag(recording: Recording) -> float:
    """Return the lag [s], the same on all axes, that leaves the least of motor less link."""
    least = minimize_scalar(
        lambda lag: np.sum(left_by_lag(recording, lag) ** 2),
        bounds=(0.0, _LONGEST),
        method="bounded",
        options={"xatol": _EXACT},
    )
    return float(least.x)


def left_by_lag(recording: Recording, lag: float) -> np.ndarray:
    """Return the rms of motor less link that a lag and an offset of each encoder leave [rad], (l,).

    Args:
        recording: The recording; l of its axes have an encoder behind the gear.
        lag: How much later than the motors the links are told [s].
    """
    left = [
        delayed(recording.motor[:, i], recording.step, lag) - recording.link[:, i]
        for i in recording.with_link
    ]
    return np.std(left, axis=1)


def values() -> dict[str, Any]:
    """Return what the page says of it, by the names of its template."""
    one, lag = predicted(), one_lag(recording("A"))
    by_lag = left_by_lag(recording("B"), lag)
    size = np.std(one.measured_wind_up, axis=1)
    by_fit, with_lines = (
        np.array(own[: len(size)], dtype=float)
        for own in (one.wind_up_without_lines_rad, one.wind_up_rad)
    )
    as_file, fitted = (own.error / own.size for own in (recordings.torques("B"), torques()))
    rows = {
        "motor less link [urad]": 1e6 * size,
        "left of it by one lag, no robot": 1e6 * by_lag,
        "left of it by the fit to A": 1e6 * by_fit,
        "the same, lines of the encoders fitted in B": 1e6 * with_lines,
        "left of the motor torque by the shipped file [%]": 100.0 * as_file,
        "left of the motor torque by the fit to A [%]": 100.0 * fitted,
    }
    lines = [
        (name, *(f"{value:.0f}" for value in own), *("" for _ in range(6 - len(own))))
        for name, own in rows.items()
    ]
    return {
        **comparisons(by_fit / size, by_lag / size, fitted),
        "identified": table(("recording B, rms", *(f"A{axis}" for axis in range(1, 7))), lines),
        "lag": 1e3 * lag,
        "of_lag": 100.0 * by_fit / by_lag,
    }


def comparisons(link: np.ndarray, by_lag: np.ndarray, torque: np.ndarray) -> dict[str, Comparison]:
    """Return the page's entries of what is left by axis, in parts of what was measured."""
    return {
        "torque_fitted": recordings.compared("motor torque, robot identified", torque),
        "link": recordings.compared("motor less link, robot identified", link),
        "link_by_lag": recordings.compared("motor less link by one lag, no robot", by_lag),
    }
