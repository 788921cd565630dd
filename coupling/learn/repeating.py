"""What a robot does beyond its model and does again in every pass, from the passes so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from coupling.learn.contraction import CUTOFFS
from coupling.learn.history import History, MeasuredRun, seen_below
from coupling.learn.passes import Simulated
from coupling.learn.smoother import Smoother
from coupling.path.discrepancy import Discrepancy

# What the robot makes of a change of the command, wrong by this part of it: stiffness off by 15 % makes
# 10 % of it at half the lowest mode, and a gear that crosses later more.
_WRONG = 0.3
# Fewest passes from which it is told what does not repeat.
_FEWEST = 3
# Fewest steps of a path.
_LEAST = 8


@dataclass(frozen=True)
class Repeating:
    """The part that repeats, as far as it is corrected, and what does not.

    Attributes:
        time: Even times over the whole path [s], (k,).
        deviation: Displacement [m] and rotation vector [rad] beyond the model, (k, 6).
        cutoff: Frequency of which half is in it [Hz]: the one that is expected to leave least.
        left: Rms of what it is expected to leave of what repeats: what is faster, and its own noise [m].
        new: Rms of what is new in every pass [m]; 0 of fewer than three.
        weights: What every pass counts in it, (passes,).
        own_noise: Part of the noise of the last of these passes that is in it.
    """

    time: np.ndarray
    deviation: np.ndarray
    cutoff: float
    left: float
    new: float
    weights: tuple[float, ...]
    own_noise: float

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return it at times, (n, 6)."""
        return np.stack([np.interp(time, self.time, own) for own in self.deviation.T], axis=1)

    def discrepancy(self, history: History) -> Discrepancy:
        """Return it along the desired path, for a case; axes of the robot's base."""
        position = Simulated(history.runs[0].desired).position(self.time)
        return Discrepancy(self.time, position, self.deviation)


def as_before(known: Discrepancy) -> Repeating:
    """Return what a command corrected already, to be corrected once more."""
    return Repeating(known.time, known.deviation, 0.0, 0.0, 0.0, (), 0.0)


def repeating(
    history: History, x: np.ndarray, limit: float, gain: float, numbers: Sequence[int]
) -> Repeating:
    """Return what a robot does beyond a model in every pass.

    A Kalman filter over the passes finds how much each of them counts: it tells measured less simulated
    with its noise and with what is new in it, and between two passes what the model makes of the
    command's change is wrong by a part.  The cutoff is that of least expected error: what is faster is
    not corrected, what is slower has noise.

    Args:
        history: The passes.
        x: Log factors of the model, (P,).
        limit: Cutoff at most [Hz].
        gain: Gain of a pass at most.
        numbers: The passes that count, in their order.
    """
    beyond = [history.beyond(number, x) for number in numbers]
    runs = [history.runs[number] for number in numbers]
    told = _Told(history, runs, beyond, limit)
    noise = [
        3.0 * run.noise**2 * own.of_noise for run, own in zip(runs, told.smoothers, strict=True)
    ]
    moved = [history.simulated(number, x).position(told.time) for number in numbers]
    wrong = [0.0] + [
        _WRONG**2 * float(np.mean(np.sum((after - before) ** 2, axis=1)))
        for before, after in pairwise(moved)
    ]
    new = 0.0
    weights, surprises = _weights(told.values, noise, wrong, new, gain)
    if len(runs) >= _FEWEST:
        new = max(0.0, float(np.median(surprises)))
        weights, _ = _weights(told.values, noise, wrong, new, gain)
    of_noise = 3.0 * runs[-1].noise ** 2 * float(np.sum(np.square(weights)))
    seen = seen_below(runs[-1].seen.time)
    best, risk = limit, np.inf
    for cutoff in (limit, *(own for own in CUTOFFS if own < limit)):
        smoother = Smoother(runs[-1].seen.time, cutoff)
        bias = max(smoother.bias(beyond[-1][:, :3], runs[-1].noise, seen), 0.0)
        if bias + of_noise * smoother.of_noise < risk:
            best, risk = cutoff, bias + of_noise * smoother.of_noise
    told = _Told(history, runs, beyond, best)
    found = np.einsum("p,pkc->kc", weights, np.array(told.values))
    return Repeating(
        told.time,
        found,
        best,
        float(np.sqrt(risk)),
        float(np.sqrt(new)),
        tuple(weights),
        float(weights[-1]) * told.smoothers[-1].trace,
    )


class _Told:
    """What every pass tells below a cutoff, at even times over the whole path.

    Args:
        history: All passes.
        runs: Those that count.
        beyond: Measured less simulated poses of each, (n, 6).
        cutoff: [Hz].

    Attributes:
        smoothers: Of every pass.
        time: The times [s], (k,).
        values: Of every pass, (k, 6).
    """

    def __init__(
        self,
        history: History,
        runs: Sequence[MeasuredRun],
        beyond: Sequence[np.ndarray],
        cutoff: float,
    ) -> None:
        path = history.runs[0].desired.time
        self.smoothers = [Smoother(run.seen.time, cutoff) for run in runs]
        count = int(np.ceil(float(np.ptp(path)) / min(own.spacing for own in self.smoothers)))
        self.time = np.linspace(path[0], path[-1], max(count, _LEAST) + 1)
        self.values = []
        for smoother, own in zip(self.smoothers, beyond, strict=True):
            columns = [np.interp(self.time, smoother.time, slow) for slow in smoother(own).T]
            self.values.append(np.stack(columns, axis=1))


def _weights(
    told: Sequence[np.ndarray],
    noise: Sequence[float],
    wrong: Sequence[float],
    new: float,
    gain: float,
) -> tuple[np.ndarray, list[float]]:
    """Return weights of the passes, and by how much more than expected each surprised [m^2]."""
    found, surprises = gain * told[0], list[float]()
    weights, variance = np.array([gain]), noise[0] + new
    for own, of_noise, of_model in zip(told[1:], noise[1:], wrong[1:], strict=True):
        before = variance + of_model
        part = min(gain, before / max(before + of_noise + new, 1e-30))
        off = own - found
        square = float(np.mean(np.sum(off[:, :3] ** 2, axis=1)))
        surprises.append(0.5 * (square - of_model - 2.0 * of_noise))
        found = found + part * off
        weights = np.append((1.0 - part) * weights, part)
        variance = (1.0 - part) * before
    return weights, surprises
