"""Iterative learning control along the path: d_(k+1) = d_b + g Q (y_b - s_b - d_b) [Bristow2006].

The inverse of the robot's model takes the desired path less a correction d.  y_b is the measured tool,
s_b the model's under the command of run b, Q a low-pass of zero phase and g the gain.  Where the model
is on its path, s_b + d_b is the desired path and y_b - s_b - d_b the measured deviation; as s_b is
simulated, a model whose parameters were learned later takes its part off: nothing is corrected twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coupling.identification.next.command_model import CommandModel
from coupling.identification.next.deviation_size import signal_filter
from coupling.identification.next.history import History
from coupling.identification.next.learning_filter import low_passed, weight_of_sample, width_in_time
from coupling.identification.next.measured_run import MeasuredRun
from coupling.identification.next.options import NextOptions
from coupling.identification.runs.measurement import SimulatedPath
from coupling.path.discrepancy import Discrepancy
from coupling.path.linear import interpolate_rows
from coupling.results.next_result import DeviationSize, LearningStep

# A run confirms its correction that leaves less than this part of the best one before.
_CONFIRMED = 0.7
# A run is worse than another by this factor of the rms, and by so many standard deviations of chance.
_WORSE, _DEVIATIONS = 1.1, 2.0
# Independent values of what differs from run to run: a shift and a drift in three directions.
_VALUES = 6.0
# Cutoff that learning begins with, and where gears cross their backlash at other times than the model's,
# as its parameters are not learned [Hz].
_FIRST, _CAUTIOUS = 1.5, 0.4
# Cutoff up to which it grows [Hz]: above it a correction has more noise than signal.
_HIGHEST = 3.0
# Runs that are compared for outliers; a run is one where it is so many times as far from their median as
# they usually are.
_COMPARED, _OUTLIER = 3, 6.0
# Steps per standard deviation of the filter in time, fewest of them, and steps between a table's rows.
_STEPS, _FEWEST_STEPS, _TABLE = 8, 32, 4


@dataclass(frozen=True)
class PathCorrection:
    """Correction along the path beyond the model.

    Attributes:
        time: Even times over the whole path [s], (k,).
        deviation: Displacement [m] and rotation vector [rad] beyond the model, (k, 6).
        cutoff: Cutoff of the low-pass Q [Hz].
        gain: Gain g of the last step.
        noise_share: Part of the noise variance of the run that it was computed from.
    """

    time: np.ndarray
    deviation: np.ndarray
    cutoff: float
    gain: float
    noise_share: float

    def discrepancy(self, history: History) -> Discrepancy:
        """Return it along the desired path, for a case; axes of the robot's base."""
        position = SimulatedPath(history.runs[0].desired).position(self.time)
        return Discrepancy(self.time, position, self.deviation)


def is_worse(size: DeviationSize, best: DeviationSize, options: NextOptions) -> bool:
    """Return whether a run left more than the best one, beyond noise and repeatability.

    Args:
        size: Measured deviation of the run.
        best: Measured deviation of the best one.
        options: Repeatability, and whether the constant counts.
    """
    rms, best_rms, random = options.rms_of(size), options.rms_of(best), options.random
    # A vector r and a random n of few components have the square r^2 + n^2 + 2 r n.
    chance = (2.0 * best_rms + random) * random / np.sqrt(_VALUES)
    doubt = float(np.hypot(np.hypot(best.doubt, size.doubt), chance))
    return rms**2 > (_WORSE * best_rms) ** 2 + _DEVIATIONS * doubt


def learning_step(
    sizes: Sequence[DeviationSize],
    repeats: Sequence[bool],
    is_cautious: bool,
    options: NextOptions,
) -> LearningStep:
    """Return from which run the next command goes on, and how far.

    A worse run is taken back: from the best one, with half the gain and half the cutoff.  The cutoff
    doubles when a run confirms its correction, up to 3 Hz and that at which learning converges.  What
    does not repeat from run to run is averaged, with the gains 1/2, 1/3, .. [Butcher2008].

    Args:
        sizes: Measured deviation of every run.
        repeats: Whether each run left more than by what it differs from the run before.
        is_cautious: Whether gears pass through a backlash that was not learned.
        options: Repeatability, and whether the constant counts.

    Example:
        >>> def size(rms): return DeviationSize(rms, rms, rms, rms)
        >>> runs = [size(4e-4), size(4e-5)]
        >>> step = learning_step(runs, [True] * 2, False, NextOptions())
        >>> step.base, step.gain, step.cutoff
        (1, 1.0, 3.0)
        >>> step = learning_step([*runs, size(9e-5)], [True] * 3, False, NextOptions())
        >>> step.base, step.gain, step.cutoff
        (1, 0.5, 1.5)
    """
    best, base, scale, averaged = 0, 0, 1.0, 1
    cutoff = options.cutoff or (_CAUTIOUS if is_cautious else _FIRST)
    worse = False
    for run in range(1, len(sizes)):
        worse = is_worse(sizes[run], sizes[best], options)
        improved = options.rms_of(sizes[run]) < options.rms_of(sizes[best])
        confirmed = options.rms_of(sizes[run]) < _CONFIRMED * options.rms_of(sizes[best])
        if improved:
            best = run
        base = best if worse else run
        if worse:
            scale, cutoff = 0.5 * scale, 0.5 * cutoff
        elif confirmed:
            scale, cutoff = min(2.0 * scale, 1.0), min(2.0 * cutoff, options.cutoff or _HIGHEST)
        elif not repeats[run]:
            averaged += 1
    return LearningStep(base, best, worse, scale / averaged, cutoff)


def learn_path(history: History, model: CommandModel, step: LearningStep) -> PathCorrection:
    """Return the next correction along the path.

    Args:
        history: All measured runs.
        model: The robot's model.
        step: Run to go on from, gain and cutoff.
    """
    run = history.runs[step.base]
    cutoff = min(step.cutoff, model.highest_cutoff)
    start, end = run.desired.time[[0, -1]]
    count = max(int(np.ceil(_STEPS * (end - start) / width_in_time(cutoff))), _FEWEST_STEPS)
    time = np.linspace(start, end, count - count % _TABLE + _TABLE + 1)
    spacing = float(time[1] - time[0])
    last = range(max(step.base + 1 - _COMPARED, 0), step.base + 1)
    unmodelled = replace_outliers(
        low_passed(
            spacing,
            np.stack([_unmodelled_at(time, history, number, model.x) for number in last], axis=1),
            cutoff,
        )
    )
    before = corrected(run, time)
    gain = step.gain
    deviation = before + gain * (unmodelled - low_passed(spacing, before, cutoff))
    samples = run.measured.time
    share = weight_of_sample(float(np.ptp(samples)) / (len(samples) - 1), cutoff)
    return PathCorrection(time[::_TABLE], deviation[::_TABLE], cutoff, gain, gain * share)


def _unmodelled_at(time: np.ndarray, history: History, number: int, x: np.ndarray) -> np.ndarray:
    """Return what a robot with log factors x [1], (P,), does not explain of a run [m, rad], (n, 6)."""
    low_pass = signal_filter(history.runs[number].measured.time)
    return interpolate_rows(time, low_pass.time, low_pass(history.unmodelled(number, x)))


def replace_outliers(runs: np.ndarray) -> np.ndarray:
    """Return the last run, with the median of three where that is far from it (Hampel's filter).

    What one run alone shows for a while is an outlier until another one confirms it.

    Args:
        runs: Deviations beyond the model of the last runs [m, rad], (k, 1 to 3, 6).

    Example:
        >>> runs = np.zeros((50, 3, 6))
        >>> runs[:, :, 0] = 1e-5 * np.arange(3.0)
        >>> runs[20, 2, 0] = 2e-4
        >>> replace_outliers(runs)[18:22, 0].tolist()
        [2e-05, 2e-05, 1e-05, 2e-05]
        >>> replace_outliers(runs[:, 1:])[20, 0].tolist()
        0.0002
    """
    if runs.shape[1] < _COMPARED:
        return np.asarray(runs[:, -1])
    median = np.median(runs, axis=1)
    distance = np.linalg.norm((runs - median[:, None])[:, :, :3], axis=2)
    far = distance[:, -1] > _OUTLIER * np.median(np.sort(distance, axis=1)[:, 1:])
    return np.where(far[:, None], median, runs[:, -1])


def corrected(run: MeasuredRun, time: np.ndarray) -> np.ndarray:
    """Return what a run's command corrected along the path at times (n,) [m, rad], (n, 6)."""
    discrepancy = run.source.discrepancy
    return np.zeros((len(time), 6)) if discrepancy is None else discrepancy.at(time)


def is_repeated(history: History, number: int, x: np.ndarray) -> bool:
    """Return whether a run left more than by what it differs from the run before.

    Args:
        history: The runs.
        number: Number of the run, from 0.
        x: Log factors of the robot [1], (P,): what it does of the change of the command is taken off.
    """
    if number == 0:
        return True
    run, before = history.runs[number], history.runs[number - 1]
    time, low_pass = run.measured.time, signal_filter(run.measured.time)
    earlier = interpolate_rows(time, before.measured.time, history.unmodelled(number - 1, x))
    change = (history.unmodelled(number, x) - earlier)[:, :3]
    noise = 3.0 * run.noise**2 * low_pass.of_noise
    return (
        _mean_square(low_pass(change)) - 2.0 * noise < _mean_square(low_pass(run.deviation)) - noise
    )


def _mean_square(values: np.ndarray) -> float:
    return float(np.mean(np.sum(values**2, axis=1)))
