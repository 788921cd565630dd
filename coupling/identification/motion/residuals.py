"""How much of recordings a fitted robot leaves, and what is said of it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from coupling.identification.motion.problem import (
    MotionProblem,
    SmoothedRecording,
    rms,
)
from coupling.identification.motion.recording import smooth
from coupling.results.base import finite
from coupling.results.motion_result import RecordingResult, WindUpShareResult

# Part of a motor's torque from which on what is left is remarked upon [1].
_HALF = 0.5
# A motor moves from this part of its largest rate on, and is no resting one with so many of such rows.
_MOVES, _MOVING = 0.1, 0.25


def recording_result(
    problem: MotionProblem,
    smoothed: SmoothedRecording,
    x: np.ndarray,
    bandwidth: float,
) -> RecordingResult:
    """Return how well a recording is predicted.

    Args:
        x: Values as the fit counts, parts of usual sizes [1], (P,).
        bandwidth: Bandwidth of the motors' smoothed motion [Hz].
    """
    predicted, recording = problem.predicted(smoothed, x), smoothed.recording
    wind_up, torque = problem.residuals(smoothed, predicted)
    apart, linked = recording.wind_up - predicted.wind_up, recording.with_link
    size = np.maximum(rms(recording.torque), 1e-300)
    shares = dict(predicted.shares)
    if any(smoothed.lines):
        shares["lines of the encoder"] = apart - wind_up
    return RecordingResult(
        name=recording.name,
        held_out=recording.is_held_out,
        time=tuple(recording.time.tolist()),
        rows=len(recording.time),
        wind_up_rad=numbers(rms(wind_up)),
        wind_up_without_lines_rad=numbers(np.std(apart, axis=0)),
        wind_up_lag_alone_rad=numbers(_lag_alone(problem, smoothed)),
        torque_relative=numbers(rms(torque) / size),
        slow_torque_relative=numbers(rms(smooth(torque, recording.step, bandwidth)) / size),
        measured_wind_up=_columns(_centred(recording.wind_up)[:, linked]),
        left_wind_up=_columns(wind_up[:, linked]),
        shares=tuple(
            WindUpShareResult(name=name, wind_up=_columns(_centred(share)[:, linked]))
            for name, share in shares.items()
        ),
        measured_torque=_columns(recording.torque),
        left_torque=_columns(torque),
    )


def _lag_alone(problem: MotionProblem, smoothed: SmoothedRecording) -> np.ndarray:
    """Return the rms [rad], (j,), that a lag fitted to a problem's recordings leaves of a wind-up."""
    sizes = np.full(smoothed.motion.q.shape[1], np.nan)
    for i in smoothed.recording.with_link:

        def parts(other: SmoothedRecording, i: int = i) -> tuple[np.ndarray, np.ndarray]:
            rate, wind_up = other.motion.qd[:, i], other.recording.wind_up[:, i]
            return other.remove_fitted(rate, i), other.remove_fitted(wind_up, i)

        rates, wind_ups = map(np.concatenate, zip(*map(parts, problem.recordings), strict=True))
        lag = rates @ wind_ups / max(rates @ rates, 1e-300)
        rate, wind_up = parts(smoothed)
        sizes[i] = rms(wind_up - lag * rate)
    return sizes


def misses_load(smoothed: SmoothedRecording, result: RecordingResult) -> np.ndarray:
    """Return the mask of motors that move, and leave more than half of the slow torque, (j,).

    These are neither friction, which is fitted, nor noise, but loads.
    """
    speed = np.abs(smoothed.motion.qd)
    moves = np.mean(speed > _MOVES * speed.max(axis=0), axis=0)
    slow_torque = np.array(result.slow_torque_relative, dtype=float)
    return np.asarray((moves > _MOVING) & (slow_torque > _HALF))


def remarks_on(result: RecordingResult) -> list[str]:
    """Return a sentence on each torque of which most is left, and link that lag predicts better."""
    words = f"{result.name}, {'predicted' if result.held_out else 'fitted'}: the residual of"
    remarks = [
        f"{words} the torque of motor {i} is {100.0 * part:.0f} % of it: is the column of another"
        " joint, delayed or in another unit, or is the model incomplete?"
        for i, part in enumerate(result.torque_relative, start=1)
        if part is not None and part > _HALF
    ]
    pairs = zip(result.wind_up_rad, result.wind_up_lag_alone_rad, strict=True)
    return remarks + [
        f"{words} motor less link {i} is {1e6 * size:.3g} urad, more than with a lag and an offset"
        f" alone, {1e6 * alone:.3g} urad: the model of this joint is incomplete."
        for i, (size, alone) in enumerate(pairs, start=1)
        if size is not None and alone is not None and size > alone
    ]


def numbers(values: Iterable[float]) -> tuple[float | None, ...]:
    """Return numbers as they are stored, None where there is no encoder."""
    return tuple(map(finite, values))


def _centred(values: np.ndarray) -> np.ndarray:
    return values - values.mean(axis=0)


def _columns(values: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(np.round(column, 9).tolist()) for column in values.T)
