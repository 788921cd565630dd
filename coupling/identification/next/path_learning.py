"""Iterative learning control along the path: d_(k+1) = d_b + g Q (y_b - s_b - d_b) [Bristow2006].

The inverse of the robot's model takes the desired path less a correction d.  y_b is the measured tool,
s_b the model's under the command of run b, Q a low-pass of zero phase and g the gain.  Where the model
is on its path, s_b + d_b is the desired path and y_b - s_b - d_b the measured deviation; as s_b is
simulated, a model whose parameters were learned later takes its part off: nothing is corrected twice.

b and g are chosen at every time of the path: what a friction that changes its sign, or an outlier of one
run, makes worse at one place is taken back there, and learning goes on elsewhere.  A constant is no
command's fault, as R is 1 at rest, but that of a tool, a part or a zero that has changed: it is learned
from the last run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from coupling.identification.next.command_model import CommandModel
from coupling.identification.next.deviation_size import signal_filter
from coupling.identification.next.history import History
from coupling.identification.next.learning_filter import low_passed, weight_of_sample, width_in_time
from coupling.identification.next.measured_run import MeasuredRun
from coupling.identification.next.options import NextOptions
from coupling.identification.runs.measurement import SimulatedPath
from coupling.identification.runs.slow_part import SlowPart
from coupling.path.deviation import less_constant
from coupling.path.discrepancy import Discrepancy
from coupling.path.linear import interpolate_rows
from coupling.results.next_result import DeviationSize, LearningStep

# A run is worse than another by this factor of the rms, and by so many standard deviations of chance.
_WORSE, _DEVIATIONS = 1.1, 2.0
# Independent values of what differs from run to run: a shift and a drift in three directions.
_VALUES = 6.0
# Cutoffs of the first correction and of all [Hz]: above these has a correction more noise than signal.
_FIRST_CUTOFF, _LAST_CUTOFF = 1.5, 3.0
# A place is worse where its mean square is so many times the best one's, and converges where it is such
# a part of that; least gain.
_WORSE_PLACE, _CONVERGES, _LEAST_GAIN = 2.0, 0.5, 0.25
# Standard deviation of the mean over the time around a place [s].
_AROUND = 0.2
# What a command does to a place comes within so much time [s].
_AFTER = 1.0
# Steps per standard deviation of the filter in time, fewest of them, and steps between a table's rows.
_STEPS, _FEWEST_STEPS, _TABLE = 8, 32, 4


@dataclass(frozen=True)
class PathCorrection:
    """Correction along the path beyond the model.

    Attributes:
        time: Even times over the whole path [s], (k,).
        deviation: Displacement [m] and rotation vector [rad] beyond the model, (k, 6).
        cutoff: Cutoff of the low-pass Q [Hz].
        gain: Mean of the gain g along the path.
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


def mean_around(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return means of values (n, ...) around even times [s], (n,)."""
    width = _AROUND / float(time[1] - time[0])
    mean: np.ndarray = gaussian_filter1d(values, width, axis=0, mode="nearest")
    return mean


def is_worse(size: DeviationSize, best: DeviationSize, options: NextOptions) -> bool:
    """Return whether a run left more than the best one, beyond noise and repeatability.

    It is not worse by a constant alone.

    Args:
        size: Measured deviation of the run.
        best: Measured deviation of the best one.
        options: Repeatability, and whether the constant counts.
    """
    random = options.random

    def exceeds(rms: float, best_rms: float) -> bool:
        # A vector r and a random n of few components have the square r^2 + n^2 + 2 r n.
        chance = (2.0 * best_rms + random) * random / np.sqrt(_VALUES)
        doubt = float(np.hypot(np.hypot(best.doubt, size.doubt), chance))
        return rms**2 > (_WORSE * best_rms) ** 2 + _DEVIATIONS * doubt

    return exceeds(options.rms_of(size), options.rms_of(best)) and exceeds(
        size.rms_less_constant, best.rms_less_constant
    )


def learning_step(sizes: Sequence[DeviationSize], options: NextOptions) -> LearningStep:
    """Return how the last run compares with the best one, and up to which frequency to learn.

    The cutoff doubles after every run that is not worse, and is halved after one that is.

    Args:
        sizes: Measured deviation of every run.
        options: Repeatability, and whether the constant counts.

    Example:
        >>> def size(rms): return DeviationSize(rms, rms, rms, rms)
        >>> runs = [size(4e-4), size(4e-5), size(9e-5)]
        >>> learning_step(runs, NextOptions())
        LearningStep(base=1, worse=True, cutoff=1.5)
    """
    best, worse = 0, False
    cutoff, highest = _FIRST_CUTOFF, _LAST_CUTOFF
    if options.cutoff is not None:
        cutoff = highest = options.cutoff
    for run, size in enumerate(sizes):
        if run:
            worse = is_worse(size, sizes[best], options)
            cutoff = 0.5 * cutoff if worse else min(2.0 * cutoff, highest)
        if options.rms_of(size) < options.rms_of(sizes[best]):
            best = run
    return LearningStep(best if worse else len(sizes) - 1, worse, cutoff)


def learn_path(
    history: History,
    model: CommandModel,
    cutoff: float,
    options: NextOptions,
    is_last_worse: bool = False,
) -> PathCorrection:
    """Return the next correction along the path.

    Args:
        history: All measured runs.
        model: The robot's model.
        cutoff: Cutoff, at most that of the model [Hz].
        options: Repeatability.
        is_last_worse: Whether the last run left more than the best one, as a whole.
    """
    last, cutoff = history.runs[-1], min(cutoff, model.highest_cutoff)
    start, end = last.desired.time[[0, -1]]
    count = max(int(np.ceil(_STEPS * (end - start) / width_in_time(cutoff))), _FEWEST_STEPS)
    time = np.linspace(start, end, count - count % _TABLE + _TABLE + 1)
    unmodelled = np.stack(
        [_unmodelled_at(time, history, k, model.x) for k in range(len(history.runs))], axis=1
    )
    squares = np.stack(
        [
            squares_around(time, run, share_that_repeats(shift, options.random) * shift, options)
            for run, shift in zip(
                history.runs, shifts_since_the_run_before(unmodelled), strict=True
            )
        ],
        axis=1,
    )
    reach = int(_AFTER / (time[1] - time[0])) if is_last_worse else None
    base, gain = learning_gain(squares, options.random**2, reach)
    before = np.stack([corrected(run, time) for run in history.runs], axis=1)
    change = low_passed(float(time[1] - time[0]), unmodelled - before, cutoff)
    constant, constant_change = np.median(before, axis=0), np.median(change, axis=0)
    samples = last.measured.time
    noise_share = weight_of_sample(float(np.ptp(samples)) / (len(samples) - 1), cutoff)
    # From the correction of one run to that of another one without a jump.
    chosen = base[:, None] == np.arange(len(history.runs))
    weight = mean_around(time, chosen.astype(float))[:, :, None]
    gain = mean_around(time, gain)
    varying = before - constant + gain[:, None, None] * (change - constant_change)
    gain_mean, rows = float(gain.mean()), slice(None, None, _TABLE)
    share = max(gain_mean, share_that_repeats(constant_change[-1, :3], options.random))
    deviation = np.sum(weight * varying, axis=1) + constant[-1] + share * constant_change[-1]
    return PathCorrection(time[rows], deviation[rows], cutoff, gain_mean, gain_mean * noise_share)


def learning_gain(
    squares: np.ndarray, random: float, reach: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return the run that every place goes on from, and with which gain.

    A place that is no better than in the best run is learned with half the gain, which averages what
    does not repeat [Butcher2008]; a worse one goes back to that run, which counts twice as much each
    time, so that a robot that has changed is learned anew.

    Args:
        squares: Mean squares of the deviation around every place in every run [m^2], (n, runs).
        random: Mean square of what differs from run to run [m^2].
        reach: Number of places before and behind a worse one that go back with it and are not learned,
            where the last run is worse as a whole, as a gear that is kicked off its flank lands later.

    Returns:
        Numbers of the runs (n,), and gains [1], (n,).

    Example:
        >>> squares = np.array([[9.0, 1.0, 0.9], [9.0, 1.0, 1.1], [9.0, 1.0, 4.0]])
        >>> base, gain = learning_gain(squares, 0.0)
        >>> base.tolist(), gain.tolist()
        ([2, 2, 1], [1.0, 0.5, 0.5])
        >>> base, gain = learning_gain(squares, 0.0, reach=1)
        >>> base.tolist(), gain.tolist()
        ([2, 1, 1], [1.0, 0.0, 0.0])
    """
    best, base, gain = squares[:, 0], np.zeros(len(squares), dtype=int), np.ones(len(squares))
    trusted = best_run = base
    worse = np.zeros(len(squares), dtype=bool)
    for run, now in enumerate(squares.T[1:], start=1):
        worse, better = now > _WORSE_PLACE * (best + random), now < best
        gain = np.where(now < _CONVERGES * best, np.minimum(2.0 * gain, 1.0), gain)
        gain = np.where(better, gain, np.maximum(0.5 * gain, _LEAST_GAIN))
        base = np.where(worse, trusted, run)
        best_run, trusted = trusted, np.where(better, run, trusted)
        best = np.where(worse, 2.0 * best, np.minimum(best, now))
    if reach is None:
        return base, gain
    goes_back = maximum_filter1d(worse, 2 * reach + 1)
    return np.where(goes_back, best_run, base), np.where(goes_back, 0.0, gain)


def shifts_since_the_run_before(unmodelled: np.ndarray) -> np.ndarray:
    """Return by which constant each run has moved as a whole [m], (runs, 3); 0 of the first.

    Args:
        unmodelled: Deviations that the model does not explain, of every run [m, rad], (n, runs, 6).
    """
    shifts: np.ndarray = np.median(np.diff(unmodelled, axis=1, prepend=unmodelled[:, :1]), axis=0)
    return shifts[:, :3]


def share_that_repeats(constant: np.ndarray, random: float) -> float:
    """Return which share of a constant (3,) [m] repeats, beside a random rms [m] from run to run.

    Example:
        >>> [round(share_that_repeats(np.array([c, 0.0, 0.0]), 1e-5), 2) for c in (1e-4, 1e-5, 0.0)]
        [0.99, 0.5, 0.0]
    """
    square = float(constant @ constant)
    return square / (square + random**2) if square else 0.0


def squares_around(
    time: np.ndarray, run: MeasuredRun, shift: np.ndarray, options: NextOptions
) -> np.ndarray:
    """Return mean squares of a run's deviation below the modes around even times (n,) [m^2], (n,).

    Args:
        time: The times [s], (n,).
        run: The run.
        shift: Constant that does not count, as no command is its cause [m], (3,).
        options: Whether the constant counts.
    """
    low_pass = SlowPart.of(run.measured.time)
    slow = low_pass(run.deviation) - shift
    if not options.absolute:
        slow = less_constant(low_pass.time, slow)
    squares: np.ndarray = np.sum(interpolate_rows(time, low_pass.time, slow) ** 2, axis=1)
    return mean_around(time, squares)


def _unmodelled_at(time: np.ndarray, history: History, number: int, x: np.ndarray) -> np.ndarray:
    """Return what a robot with log factors x [1], (P,), does not explain of a run [m, rad], (n, 6)."""
    low_pass = signal_filter(history.runs[number].measured.time)
    return interpolate_rows(time, low_pass.time, low_pass(history.unmodelled(number, x)))


def corrected(run: MeasuredRun, time: np.ndarray) -> np.ndarray:
    """Return what a run's command corrected along the path at times (n,) [m, rad], (n, 6)."""
    discrepancy = run.source.discrepancy
    return np.zeros((len(time), 6)) if discrepancy is None else discrepancy.at(time)
