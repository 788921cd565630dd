"""Frequency responses in a posture: how they are read, and how far a robot is off them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from coupling.errors import IdentifyError
from coupling.identification.response.experiment import DELAY, PostureResponse
from coupling.modes.hammer_test import is_hammer_test, read_measured
from coupling.modes.measured_response import MeasuredResponse, is_of_responses, within
from coupling.results.identified_result import LogErrorResult, PostureResponseResult
from coupling.results.modes_result import ResponseResult

# What is known of instruments before: deviations of the log of a factor, their calibration's [1], and of
# a delay, that of filters [s].
FACTOR_DEVIATION, DELAY_DEVIATION = 0.03, 3e-4
# What is taken off an error as theirs, at most [standard deviations].
_INSTRUMENTS = 3.0


@dataclass(frozen=True)
class MeasuredPosture:
    """Frequency responses in a posture.

    Attributes:
        name: Name of the file.
        q: Angles of the drives [rad], (joints,).
        responses: The responses.
        is_held_out: Whether they are predicted, not fitted.
    """

    name: str
    q: np.ndarray
    responses: tuple[MeasuredResponse, ...]
    is_held_out: bool = False


def is_response(file: Path) -> bool:
    """Return whether a file is one of frequency responses or of a hammer test."""
    return is_of_responses(file) or is_hammer_test(file)


def read_posture(file: Path, q: np.ndarray, is_held_out: bool = False) -> MeasuredPosture:
    """Read the frequency responses or the hammer test of a posture.

    Args:
        q: Angles of the drives [rad], (joints,).

    Raises:
        StabilityError: If the file cannot be read, or has none.
        IdentifyError: If a response is zero at a frequency.
    """
    responses = read_measured(file)
    for response in responses:
        if np.any(response.compliance == 0.0):
            hertz = response.frequency[np.argmax(response.compliance == 0.0)]
            raise IdentifyError(
                f"{file}: {response.name} at {hertz:g} Hz: expected a response other than zero, got 0:"
                " leave the row out, or the columns that were not measured"
            )
    return MeasuredPosture(file.name, q, responses, is_held_out)


def log_residual(posture: PostureResponse, values: np.ndarray) -> np.ndarray:
    """Return log of model over measurement [1], complex, (n,), but for a factor and a delay."""
    residual = posture.log_residual(*np.split(values, 2))[0]
    factor, delay = posture.by_instrument.T
    log_factor = np.clip(
        np.median(residual.real), -_INSTRUMENTS * FACTOR_DEVIATION, _INSTRUMENTS * FACTOR_DEVIATION
    )
    late = np.median(residual.imag / delay.imag)
    late = np.clip(
        late, -_INSTRUMENTS * DELAY_DEVIATION / DELAY, _INSTRUMENTS * DELAY_DEVIATION / DELAY
    )
    return residual + log_factor * factor - late * delay


def error_of(residuals: Sequence[Sequence[np.ndarray]]) -> LogErrorResult:
    """Return the median sizes of residuals [1], (n,), of start, fit and written file, by posture."""
    start, fit, written = (
        float(np.median(np.abs(np.concatenate(parts)))) for parts in zip(*residuals, strict=True)
    )
    return LogErrorResult(start=start, fit=fit, written=written)


def posture_result(
    posture: PostureResponse,
    measured: MeasuredPosture,
    unloaded: tuple[int, ...],
    values: np.ndarray,
    residuals: Sequence[np.ndarray],
) -> PostureResponseResult:
    """Return the figures of a posture.

    Args:
        posture: The linearised robot there.
        measured: The measured responses.
        unloaded: Numbers of joints whose gears are unloaded there, from 1.
        values: Stiffnesses and dampings as written [N m/rad, N m s/rad], (2 m,).
        residuals: `log_residual` of start, fit and written file [1], (n,) each.
    """
    low, high = within(measured.responses)
    frequency, ratio = posture.modes(*np.split(values, 2))
    return PostureResponseResult(
        name=measured.name,
        posture_deg=tuple(np.rad2deg(measured.q).tolist()),
        held_out=measured.is_held_out,
        unloaded_joints=unloaded,
        lowest_Hz=low,
        highest_Hz=high,
        error=error_of([residuals]),
        modes_Hz=tuple(frequency.tolist()),
        damping_ratios=tuple(ratio.tolist()),
        measured=_responses(posture.in_order, np.zeros(len(residuals[0]))),
        start=_responses(posture.in_order, residuals[0]),
        written=_responses(posture.in_order, residuals[2]),
    )


def _responses(
    measured: Sequence[MeasuredResponse], log_errors: np.ndarray
) -> tuple[ResponseResult, ...]:
    """Return responses that are off the measured ones by logs [1], complex, (n,)."""
    ends = np.cumsum([len(response.frequency) for response in measured])[:-1]
    return tuple(
        replace(response, compliance=response.compliance * np.exp(log_error)).stored
        for response, log_error in zip(measured, np.split(log_errors, ends), strict=True)
    )
