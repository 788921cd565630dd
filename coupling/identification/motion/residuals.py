"""How much of recordings a fitted robot leaves, and what each term of the model is worth to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.identification.motion.fit import MotionFit, minus_log_likelihood, rms
from coupling.identification.motion.problem import MotionProblem, Predicted, SmoothedRecording
from coupling.identification.motion.recording import smooth
from coupling.results.base import finite
from coupling.results.motion_result import TermResult

# Part of a motor's torque from which on what is left is remarked upon [1].
_HALF = 0.5
# A motor moves from this part of its largest rate on, and is no resting one with so many of such rows.
_MOVES, _MOVING = 0.1, 0.25


@dataclass(frozen=True)
class RecordingResiduals:
    """What is left of a recording by its prediction.

    Attributes:
        smoothed: The recording.
        held_out: Whether it was not fitted.
        predicted: Its prediction.
        left_wind_up: Measured less predicted wind-up, the recording's own offset and lines taken off
            [rad], (n, j); nan without encoder.
        wind_up: Rms of that [rad], (j,); nan without encoder.
        without_lines: The same with an offset alone for each encoder [rad], (j,).
        lag_alone: Rms of what a lag, fitted to the recordings that are fitted, leaves with a recording's
            own offset and lines, without a model [rad], (j,); nan without encoder.
        torque: Rms of what is left of the motors' torques over that of the torques [1], (j,).
        slow_torque: The same below the bandwidth of the motors' motion [1], (j,).
    """

    smoothed: SmoothedRecording
    held_out: bool
    predicted: Predicted
    left_wind_up: np.ndarray
    wind_up: np.ndarray
    without_lines: np.ndarray
    lag_alone: np.ndarray
    torque: np.ndarray
    slow_torque: np.ndarray

    @property
    def misses_load(self) -> np.ndarray:
        """Mask of motors with a residual of more than half of the slow torque while they move, (j,).

        These are neither friction, which is fitted, nor noise, but loads.
        """
        speed = np.abs(self.smoothed.motion.qd)
        moves = np.mean(speed > _MOVES * speed.max(axis=0), axis=0)
        return np.asarray((moves > _MOVING) & (self.slow_torque > _HALF))


def residuals_of(
    problem: MotionProblem,
    smoothed: SmoothedRecording,
    x: np.ndarray,
    bandwidth: float,
    held_out: bool,
) -> RecordingResiduals:
    """Return how well a recording is predicted.

    Args:
        x: Values as the fit counts, parts of usual sizes [1], (P,).
        bandwidth: Bandwidth of the motors' smoothed motion [Hz].
        held_out: Whether it was not fitted.
    """
    predicted = problem.predicted(smoothed, x)
    wind_up, torque = problem.residuals(smoothed, predicted)
    apart = smoothed.recording.wind_up - predicted.wind_up
    measured = smoothed.recording.torque
    size = np.maximum(rms(measured), 1e-300)
    slow = smooth(torque, smoothed.recording.step, bandwidth)
    return RecordingResiduals(
        smoothed,
        held_out,
        predicted,
        wind_up,
        rms(wind_up),
        np.std(apart, axis=0),
        _lag_alone(problem, smoothed),
        rms(torque) / size,
        rms(slow) / size,
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


def remarks_on(of: RecordingResiduals) -> list[str]:
    """Return a sentence on each torque of which most is left, and link that lag predicts better."""
    words, name = "predicted" if of.held_out else "fitted", of.smoothed.recording.name
    torques = [
        f"{name}, {words}: the residual of the torque of motor {i + 1} is {100.0 * of.torque[i]:.0f}"
        " % of it: is the column of another joint, delayed or in another unit, or is the model"
        " incomplete?"
        for i in np.flatnonzero(of.torque > _HALF)
    ]
    return torques + [
        f"{name}, {words}: the residual of motor less link {i + 1} is {_urad(of.wind_up[i])}, more than"
        f" with a lag and an offset alone, {_urad(of.lag_alone[i])}: the model of this joint is"
        " incomplete."
        for i in of.smoothed.recording.with_link
        if of.wind_up[i] > of.lag_alone[i]
    ]


def _urad(angle: float) -> str:
    return f"{1e6 * angle:.3g} urad"


def terms_left_out(fit: MotionFit, of: RecordingResiduals) -> tuple[TermResult, ...]:
    """Return what each term of a fit is worth, by the others' answer to first order."""
    problem, terms = fit.problem, []
    least = minus_log_likelihood(problem, fit.x)
    for term in dict.fromkeys(p.term for p in problem.parameters):
        of_term = np.array([p.term == term for p in problem.parameters])
        none = np.array([p.inward(p.none) if p.none else 0.0 for p in problem.parameters])
        x = np.where(of_term, none, fit.x)
        response = fit.blocks.only(~of_term, x - fit.x)
        x[~of_term] += response.step
        x = np.clip(x, *problem.bounds)
        without = residuals_of(problem, of.smoothed, x, 1.0, True)
        joint = next(p.joint for p in problem.parameters if p.term == term)
        terms.append(
            TermResult(
                term=term,
                joint=joint + 1,
                wind_up_rad=(finite(of.wind_up[joint]), finite(without.wind_up[joint])),
                torque_relative=(float(of.torque[joint]), float(without.torque[joint])),
                likelier=finite(minus_log_likelihood(problem, x) - least),
            )
        )
    terms += [
        TermResult(
            term=f"lines of the encoder {i + 1}",
            joint=i + 1,
            wind_up_rad=(finite(of.wind_up[i]), finite(of.without_lines[i])),
            torque_relative=(float(of.torque[i]),) * 2,
        )
        for i, lines in enumerate(of.smoothed.lines)
        if lines
    ]
    return tuple(terms)
