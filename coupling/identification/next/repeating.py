"""What a robot does beyond its model and does again in every run, from the runs so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from coupling.identification.next.contraction import CUTOFFS
from coupling.identification.next.deviation_size import signal_filter
from coupling.identification.next.history import History
from coupling.identification.next.measured_run import MeasuredRun
from coupling.identification.next.possible_robot import PossibleRobot
from coupling.identification.next.repeatability import ComparedRuns, Hypotheses
from coupling.identification.next.smoother import Smoother
from coupling.identification.runs.measurement import SimulatedPath
from coupling.path.discrepancy import Discrepancy
from coupling.path.linear import interpolated

# Fewest steps of a path.
_LEAST = 8


@dataclass(frozen=True)
class RepeatablePart:
    """The part that repeats, as far as it is corrected, and what does not.

    Attributes:
        time: Even times over the whole path [s], (k,).
        deviation: Displacement [m] and rotation vector [rad] beyond the model, (k, 6).
        cutoff: Frequency of which half is in it [Hz]: the one that is expected to leave least.
        left: Rms of what it is expected to leave of what repeats: what is faster, and its own noise [m].
        weights: Weights of the measured runs in it, (runs,).
        own_noise: Part of the noise of the last of these measured runs that is in it.
    """

    time: np.ndarray
    deviation: np.ndarray
    cutoff: float
    left: float
    weights: tuple[float, ...]
    own_noise: float

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return displacement [m] and rotation vector [rad] at times [s] (n,), (n, 6)."""
        return interpolated(time, self.time, self.deviation)

    def discrepancy(self, history: History) -> Discrepancy:
        """Return it along the desired path, for a case; axes of the robot's base."""
        position = SimulatedPath(history.runs[0].desired).position(self.time)
        return Discrepancy(self.time, position, self.deviation)


def as_before(known: Discrepancy) -> RepeatablePart:
    """Return what a command corrected already, to be corrected once more."""
    return RepeatablePart(known.time, known.deviation, 0.0, 0.0, (), 0.0)


def repeating(
    history: History,
    model: PossibleRobot,
    numbers: Sequence[int],
    before: Hypotheses,
    gain: float | None = None,
) -> RepeatablePart:
    """Return what a robot does beyond a model in every measured run.

    How much each run counts follows from its noise, from what is new in it, and from how unsure the
    model is of what a change of the command does.  The cutoff is that of least expected error: what is
    faster is not corrected, what is slower has noise.

    Args:
        history: The measured runs.
        model: The robot, with the highest cutoff and gain that contract.
        numbers: The measured runs that count, in their order.
        before: Hypotheses on what is new in a measured run, before any is compared.
        gain: Gain of a measured run at most, where it is to be less than the model's.
    """
    limit, last = model.contraction.cutoff, history.runs[numbers[-1]]
    weights = compared(history, model, numbers, before, gain).weights
    beyond = history.beyond(numbers[-1], model.x)[:, :3]
    of_noise = 3.0 * last.noise**2 * float(np.sum(np.square(weights)))
    wide = signal_filter(last.measured.time)
    best, risk = limit, np.inf
    for cutoff in (limit, *(own for own in CUTOFFS if own < limit)):
        smoother = Smoother(last.measured.time, cutoff)
        bias = max(smoother.bias(beyond, last.noise, wide), 0.0)
        if bias + of_noise * smoother.of_noise < risk:
            best, risk = cutoff, bias + of_noise * smoother.of_noise
    slow = _SlowParts.of(history, model, numbers, best)
    return RepeatablePart(
        slow.time,
        np.einsum("p,pkc->kc", weights, np.array(slow.values)),
        best,
        float(np.sqrt(risk)),
        tuple(weights.tolist()),
        float(weights[-1]) * slow.smoothers[-1].trace,
    )


def compared(
    history: History,
    model: PossibleRobot,
    numbers: Sequence[int],
    before: Hypotheses,
    gain: float | None = None,
) -> ComparedRuns:
    """Return how much each run counts, and what the runs tell of what is new and of the model.

    Args:
        history: The measured runs.
        model: The robot.
        numbers: The measured runs that count, in their order.
        before: Hypotheses on what is new in a measured run, before any is compared.
        gain: Gain of a measured run at most, where it is to be less than the model's.
    """
    limit = model.contraction.cutoff
    slow = _SlowParts.of(history, model, numbers, limit)
    noise = [
        3.0 * run.noise**2 * own.of_noise
        for run, own in zip(slow.runs, slow.smoothers, strict=True)
    ]
    low = Smoother(slow.time, limit)
    changes = [0.0] + [_doubt(history, model, *pair, low) for pair in pairwise(numbers)]
    return ComparedRuns.of(
        slow.values, noise, changes, before, model.contraction.gain if gain is None else gain
    )


def _doubt(history: History, model: PossibleRobot, first: int, second: int, low: Smoother) -> float:
    """Return the mean square of what possible robots differ by in the change from run to run [m^2]."""

    def change(x: np.ndarray) -> np.ndarray:
        after, before = (history.simulated(own, x).position(low.samples) for own in (second, first))
        moved: np.ndarray = after - before
        return moved

    own = change(model.x)
    off = [low(change(x) - own) for x in model.close]
    return float(np.mean(np.sum(np.square(off), axis=2)))


@dataclass(frozen=True)
class _SlowParts:
    """What every measured run shows below a cutoff, at even times over the whole path.

    Attributes:
        runs: The measured runs.
        smoothers: Low-pass of each.
        time: The times [s], (k,).
        values: Displacement [m] and rotation vector [rad] of every measured run, (k, 6).
    """

    runs: list[MeasuredRun]
    smoothers: list[Smoother]
    time: np.ndarray
    values: list[np.ndarray]

    @classmethod
    def of(
        cls, history: History, model: PossibleRobot, numbers: Sequence[int], cutoff: float
    ) -> _SlowParts:
        """Return what measured runs tell beyond a model.

        Args:
            history: All measured runs.
            model: The model.
            numbers: Those that count.
            cutoff: Cutoff [Hz].
        """
        runs = [history.runs[number] for number in numbers]
        path = history.runs[0].desired.time
        smoothers = [Smoother(run.measured.time, cutoff) for run in runs]
        count = int(np.ceil(float(np.ptp(path)) / min(own.spacing for own in smoothers)))
        time = np.linspace(path[0], path[-1], max(count, _LEAST) + 1)
        values = []
        for smoother, number in zip(smoothers, numbers, strict=True):
            slow = smoother(history.beyond(number, model.x))
            values.append(interpolated(time, smoother.time, slow))
        return cls(runs, smoothers, time, values)
