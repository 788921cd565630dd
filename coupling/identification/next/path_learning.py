"""Iterative learning along the path: what the robot does beyond its model, learned from run to run.

The inverse of the robot's model takes the desired path less a correction d.  After run k

    d_(k+1) = d_k + g_k Q (y_k - s_k - d_k),

y_k the measured tool, s_k the model's under the same command, Q a low-pass of zero phase, g_k the gain
[Bristow2006].  Where the model follows its path, s_k + d_k is the desired path, and y_k - s_k - d_k the
measured deviation; as s_k is simulated, a model whose parameters were learned later takes its own part
off, and nothing is corrected twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coupling.identification.next.contraction import CUTOFFS
from coupling.identification.next.deviation_size import signal_filter
from coupling.identification.next.history import History
from coupling.identification.next.measured_run import MeasuredRun
from coupling.identification.next.options import NextOptions
from coupling.identification.next.possible_robot import PossibleRobot
from coupling.identification.next.smoother import Smoother
from coupling.identification.runs.measurement import SimulatedPath
from coupling.path.discrepancy import Discrepancy
from coupling.path.linear import interpolated
from coupling.results.next_result import DeviationSize, RunComparison

# A run that leaves more than this part of the one before: from there runs are averaged.
_STAGNANT = 0.7
# A run is worse than another by this factor of the rms, and by so many standard deviations of chance.
_WORSE, _DOUBTS = 1.1, 2.0
# Independent values of what differs from run to run: a shift and a drift in three directions.
_VALUES = 6.0
# Intervals of the grid, at least.
_FEWEST_INTERVALS = 8


@dataclass(frozen=True)
class PathCorrection:
    """What is corrected along the path beyond the model.

    Attributes:
        time: Even times over the whole path [s], (k,).
        deviation: Displacement [m] and rotation vector [rad] beyond the model, (k, 6).
        cutoff: Cutoff of the low-pass Q [Hz].
        left: Rms of what Q does not let through, and of the noise that it does [m].
        weights: Weights of the measured runs, (runs,).
        noise_share: Part of the noise variance of the last run that is in the correction.
    """

    time: np.ndarray
    deviation: np.ndarray
    cutoff: float
    left: float
    weights: tuple[float, ...]
    noise_share: float

    def discrepancy(self, history: History) -> Discrepancy:
        """Return it along the desired path, for a case; axes of the robot's base."""
        position = SimulatedPath(history.runs[0].desired).position(self.time)
        return Discrepancy(self.time, position, self.deviation)


def compare_runs(sizes: Sequence[DeviationSize], options: NextOptions) -> RunComparison:
    """Return the last of some runs beside the best one.

    Args:
        sizes: Measured deviation of every run.
        options: Repeatability, and whether the constant counts.
    """
    rms, random = [options.rms_of(size) for size in sizes], options.random
    best, last = int(np.argmin(rms)), len(rms) - 1
    # A vector r and a random n of few components have the square r^2 + n^2 + 2 r n.
    chance = (2.0 * rms[best] + random) * random / np.sqrt(_VALUES)
    doubt = float(np.hypot(np.hypot(sizes[best].doubt, sizes[last].doubt), chance))
    return RunComparison(best, last, rms[last] ** 2 > (_WORSE * rms[best]) ** 2 + _DOUBTS * doubt)


def weigh_runs(
    comparisons: Sequence[RunComparison], rms: Sequence[float], gain: float
) -> np.ndarray:
    """Return the weights of the measured runs in the next correction, (runs,).

    While the deviation shrinks, the gain is g.  What does not shrink is not learned or differs from run
    to run, and of that a mean has the least: g / 2, g / 3, .. [Butcher2008].  A run that is worse than
    the best one does not count; the next command is the best one's with half of its last correction,
    and later gains are halved, as in a line search.

    Args:
        comparisons: Every run beside the best one until then.
        rms: Measured deviation of every run [m].
        gain: g.

    Example:
        >>> runs = [RunComparison(0, 0, False), RunComparison(1, 1, False), RunComparison(1, 2, False)]
        >>> weigh_runs(runs, [400.0, 40.0, 39.0], 1.0)
        array([0. , 0.5, 0.5])
        >>> weigh_runs([*runs[:2], RunComparison(1, 2, True)], [400.0, 40.0, 90.0], 1.0)
        array([0.5, 0.5, 0. ])
    """
    commanded, gains, averaged, best = [np.zeros(len(rms))], [], 1, rms[0]
    for run, measured in zip(comparisons, rms, strict=True):
        if run.worse:
            gain *= 0.5
        elif run.last and measured > _STAGNANT * best:
            averaged += 1
        gains.append(gain / averaged)
        best = min(best, measured)
        start = run.best if run.worse else run.last
        weights = (1.0 - gains[-1]) * commanded[start]
        weights[start] += gains[-1]
        commanded.append(weights)
    return commanded[-1]


def learn_path(history: History, model: PossibleRobot, weights: np.ndarray) -> PathCorrection:
    """Return the correction that measured runs tell beyond a model.

    Args:
        history: All measured runs.
        model: The robot's model, with the highest cutoff that contracts.
        weights: Weights of the runs, (runs,).
    """
    numbers = np.flatnonzero(weights).tolist()
    beyond = [history.beyond(number, model.x) for number in numbers]
    cutoff, error = _best_cutoff(history, model, numbers[-1], float(np.sum(weights**2)))
    filters = [Smoother(history.runs[number].measured.time, cutoff) for number in numbers]
    path = history.runs[0].desired.time
    spacing = min(low.spacing for low in filters)
    count = max(int(np.ceil(float(np.ptp(path)) / spacing)), _FEWEST_INTERVALS)
    time = np.linspace(path[0], path[-1], count + 1)
    slow = [interpolated(time, q.time, q(off)) for q, off in zip(filters, beyond, strict=True)]
    deviation = np.einsum("p,pkc->kc", weights[numbers], np.array(slow))
    share = float(weights[numbers[-1]]) * filters[-1].trace
    return PathCorrection(time, deviation, cutoff, error, tuple(weights.tolist()), share)


def _best_cutoff(
    history: History, model: PossibleRobot, number: int, share: float
) -> tuple[float, float]:
    """Return the cutoff of least expected error [Hz], and the rms of that [m].

    It is at most the one at which the iteration contracts. What is faster is not corrected; of what is
    slower the correction has a share of the noise [Stein1981].

    Args:
        history: All measured runs.
        model: The robot's model.
        number: The run from which it is told.
        share: Sum of the squares of the runs' weights.
    """
    run, highest = history.runs[number], model.contraction.cutoff
    beyond, wide = history.beyond(number, model.x)[:, :3], signal_filter(run.measured.time)
    errors = {}
    for cutoff in (highest, *(lower for lower in CUTOFFS if lower < highest)):
        low = Smoother(run.measured.time, cutoff)
        bias = max(low.bias(beyond, run.noise, wide), 0.0)
        errors[cutoff] = float(np.sqrt(bias + 3.0 * share * run.noise**2 * low.of_noise))
    best = min(errors, key=errors.__getitem__)
    return best, errors[best]


def correction_of(run: MeasuredRun) -> PathCorrection | None:
    """Return what a run's command corrected, to be corrected once more; None: nothing."""
    known = run.source.discrepancy
    if known is None:
        return None
    return PathCorrection(known.time, known.deviation, 0.0, 0.0, (), 0.0)


def is_repeated(history: History, model: PossibleRobot) -> bool:
    """Return whether what is left of the last run is more than by what the last two runs differ.

    Args:
        history: The runs.
        model: The robot's model: what the change of the command did is taken off.
    """
    if len(history.runs) == 1:
        return True
    last = history.runs[-1]
    low = Smoother(last.measured.time, model.contraction.cutoff)
    noise = 3.0 * last.noise**2 * low.of_noise
    change = _mean_square(low(_change(history, model.x))) - 2.0 * noise
    return change < _mean_square(low(last.deviation)) - noise


def _change(history: History, x: np.ndarray) -> np.ndarray:
    """Return what a robot does beyond a model in the last run and not in the one before [m], (n, 3)."""
    last = len(history.runs) - 1
    time, before = (history.runs[number].measured.time for number in (last, last - 1))
    earlier = interpolated(time, before, history.beyond(last - 1, x))
    change: np.ndarray = (history.beyond(last, x) - earlier)[:, :3]
    return change


def _mean_square(values: np.ndarray) -> float:
    return float(np.mean(np.sum(values**2, axis=1)))
