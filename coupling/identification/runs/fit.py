"""Gauss-Newton fit of parameters, frame and clock to measured runs, in a growing fitting window.

A fit to a whole run has local minima: derivatives do not show that a gear crosses its backlash too late
or not at all, and a fit of everything but a few crossings takes these for outliers.  The error of a
crossing has decayed a second later, so the window is extended along the run as far as the residual is
explained, with restarts at other backlash and damping (`backlash_trials`) where it exceeds the noise.

Until then rows have a fifth of the weight of their noise, which smooths the cost.  The last fit has rows
weighted by noise and variance inflation (`UnexplainedPart`): the most likely robot, and its covariance.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from coupling.identification.runs.descent import (
    FLOOR,
    MOST_ITERATIONS,
    SETTLED,
    Descent,
    DescentPoint,
)
from coupling.identification.runs.effect import SecantEffect, in_parallel
from coupling.identification.runs.parameters import prior_of
from coupling.identification.runs.problem import FitProblem
from coupling.identification.runs.residual import UnexplainedPart
from coupling.identification.runs.slow_part import SlowPart
from coupling.robot.parameters import RobotParameter
from coupling.robot.robot_fmu import RobotFmu

# Changes of a log factor for differences, one after the other: the valley is narrower than the local
# minima; and those on its ground.
_CHANGES, _SMALL_CHANGES = (0.05, 0.01), (0.01, 0.002)
# Rows count by what the search has left over noise, then by what that leaves.
_COUNTED = 2
# Iterations of a fit to a part, tries from beside where it ends in a local minimum, of a part and of the
# whole, and of so many gears' best sides.
_LED, _PART_TRIES, _TRIES, _RESTART_GEARS = 6, 1, 2, 2
# What is left is noise up to so many standard deviations of what noise leaves, or so many times it.
_SURE, _NEAR_NOISE = 2.0, 1.12
# Steps in backlash and damping of a gear, and their sizes by what was known before: local minima are
# narrow, and the first iterations may have led to the wrong side of what was known.
_STEPS = ((1.0, -1.0), (-1.0, 1.0), (0.0, 1.0), (0.0, -1.0))
_SIZES = (1.0 / 3.0, 2.0 / 3.0)
# What is looked at first [s], by how much more at least, and how far behind where noise ends.
_FIRST, _LEAST, _BEHIND = 1.0, 0.5, 0.5
# By which part more at least where what was looked at stays unexplained, as where a gear is in its
# backlash without load: else a fit that comes to nothing takes longest.
_STRIDE = 0.5
# Means over so long [s] that are so many times noise are no longer explained.
_OVER, _FAR = 0.2, 2.0


@dataclass(frozen=True)
class ParameterFit(DescentPoint):
    """The most likely robot, and how sure it is.

    Attributes:
        covariance: Covariance matrix of all unknowns, in products of their units, (U, U), with rows
            that count by noise and by what is left over it; of each parameter by the derivatives that
            give the wider interval.
        converged: Whether the last step explained next to nothing.
        left_over: Discrepancy beyond noise.
    """

    covariance: np.ndarray
    converged: bool
    left_over: UnexplainedPart


class Fitter:
    """Fits one problem, also to other measurements at the same times.

    Args:
        problem: The problem.
    """

    def __init__(self, problem: FitProblem) -> None:
        self.problem = problem
        self._whole = self._descent(problem)

    def fit(self, start: np.ndarray) -> ParameterFit:
        """Return the most likely parameters.

        Args:
            start: Log factors to begin at [1], (P,).
        """
        whole, now = self._whole, self._whole.framed(start)
        before, seconds = 0.0, self._window(now, 0.0)
        while seconds < np.inf:
            part = self._descent(self.problem.until(seconds))
            here = part.at(now.z)
            if before == 0.0:
                here, _ = part.descended(here, part.problem.effects)
            here, _ = self._refined(part, here, _LED, _PART_TRIES)
            now, before = whole.at(here.z), seconds
            seconds = self._window(now, before, _is_noise(part, here))
        now, _ = self._refined(whole, now, MOST_ITERATIONS, _TRIES)
        return self._settled(now)

    def without(self, x: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the slow parts of what given parameters leave, behind the frame that fits them best.

        Args:
            x: Log factors [1], (P,).

        Returns:
            Slow parts of every measured run [m], (k, 3) or (k, 6), + c of motors.
        """
        return self._whole.framed(x).slow

    def noise(self, residuals: Sequence[np.ndarray]) -> float:
        """Return the rms of slow parts that residuals (n, 3 or more) have by noise alone [m]."""
        return self._whole.noise(residuals)

    def _settled(self, now: DescentPoint) -> ParameterFit:
        """Return the most likely robot near what was found, and how sure it is."""
        left_over, converged = self._left_over(now), False
        for _ in range(_COUNTED):
            counted = left_over.over
            descent = self._counted(now, counted)
            now = descent.at(now.z)
            for change in _SMALL_CHANGES:
                now, converged = descent.descended(now, self.problem.secants(change))
            left_over = self._left_over(now)
            if counted == 1.0:
                break
        covariance = self._covariance(self._counted(now, left_over.over), now)
        return ParameterFit(
            **vars(now), covariance=covariance, converged=converged, left_over=left_over
        )

    def _counted(self, now: DescentPoint, over: float) -> Descent:
        """Return the method with rows weighted by their noise, its variance times a factor."""
        variance = over * self._whole.noise(now.residuals) ** 2 / 3.0
        return Descent(self.problem, self._whole.slow, max(variance, FLOOR**2))

    def _left_over(self, now: DescentPoint) -> UnexplainedPart:
        """Return what is left over noise."""
        variance = max(self._whole.noise(now.residuals) ** 2 / 3.0, FLOOR**2)
        parts = list(zip(self._whole.slow, now.slow, strict=True))
        squares = sum(
            mean.independent * float(np.sum(rows_of_run**2)) for mean, rows_of_run in parts
        )
        rows = sum(mean.independent * rows_of_run.size for mean, rows_of_run in parts)
        data = self._counted(now, 1.0).equations(now, self.problem.effects)[0]
        data = data - np.diag(self.problem.prior**-2.0)
        return UnexplainedPart.of(squares / variance, rows, data, self.problem.prior)

    def _covariance(self, counted: Descent, now: DescentPoint) -> np.ndarray:
        """Return the covariance of all unknowns, by the derivatives that give the wider interval.

        An unloaded gear leaves its flank at another time when anything is changed, which differences of
        simulations take for knowledge of that; the gears' equation knows what it moves on its flanks,
        but not what other gears do meanwhile.
        """
        secants = self.problem.secants(_CHANGES[0])
        by_secants, by_equation = (
            np.linalg.inv(counted.equations(now, derivatives)[0])
            for derivatives in (secants, self.problem.effects)
        )
        wider = np.sqrt(np.maximum(1.0, np.diag(by_equation) / np.diag(by_secants)))
        wider[len(self.problem.parameters) :] = 1.0
        covariance: np.ndarray = wider[:, None] * by_secants * wider
        return covariance

    def _descent(self, problem: FitProblem) -> Descent:
        slow = [SlowPart.of(run.measured.time) for run in problem.runs]
        return Descent(problem, slow)

    def _window(self, now: DescentPoint, before: float, explained: bool = True) -> float:
        """Return how far to look next [s]."""
        whole = self._whole
        return fitting_window(now.slow, whole.slow, whole.noise(now.residuals), before, explained)

    def _refined(
        self, part: Descent, start: DescentPoint, most: int, tries: int
    ) -> tuple[DescentPoint, bool]:
        """Return what is found of a part, from some unknowns and beside them, and whether for good."""
        secants = [part.problem.secants(change) for change in _CHANGES]

        def refined(now: DescentPoint) -> tuple[DescentPoint, bool]:
            now, settled = part.descended(now, secants[0], most)
            if not _is_noise(part, now):
                now, settled = part.descended(now, secants[1], most)
            return now, settled

        now, converged = refined(start)
        restarts = _restart_points(part, now, secants[0])
        for _ in range(tries):
            neighbour = None if _is_noise(part, now) else next(restarts, None)
            if neighbour is None:
                break
            other, settled = refined(neighbour)
            if part.costed(other.z, other.slow, now.scale)[1] < now.cost - SETTLED:
                now, converged = other, settled
                restarts = _restart_points(part, now, secants[0])
        return now, converged


def _is_noise(part: Descent, now: DescentPoint) -> bool:
    """Whether hardly more is left than noise, by how much chance there is in that."""
    means = sum(3.0 * mean.independent * len(mean.time) for mean in part.slow)
    chance = 1.0 + _SURE / float(np.sqrt(2.0 * means))
    return part.over_noise(now) <= max(_NEAR_NOISE, chance)


def _restart_points(
    part: Descent, now: DescentPoint, secants: Sequence[SecantEffect]
) -> Iterator[DescentPoint]:
    """Yield where to try again: beside what was found, in backlash and damping of one gear each.

    All else is fitted to these with derivatives that are known, which tells a gear's best side.
    """
    problem, count = part.problem, len(part.problem.parameters)
    times = [
        run.measured.time + problem.frame_values(now.z, k)[6] for k, run in enumerate(problem.runs)
    ]
    x = now.z[:count]
    values = [derivatives(x, time) for derivatives, time in zip(secants, times, strict=True)]
    constant = [lambda x, time, derivatives=derivatives: derivatives for derivatives in values]
    shown = {int(k) for derivatives in secants for k in derivatives.shown}
    gears = backlash_trials(problem.parameters, shown)

    def tried(fmu: RobotFmu, step: np.ndarray) -> DescentPoint:
        return part.fitted_beside(now, constant, step, fmu)

    all_steps = [step for steps in gears for step in steps]
    ordered = iter(in_parallel(problem.fmus, all_steps, tried))
    candidates = [
        min((next(ordered) for _ in steps), key=lambda point: point.cost) for steps in gears
    ]
    yield from sorted(candidates, key=lambda point: point.cost)[:_RESTART_GEARS]


def backlash_trials(
    parameters: Sequence[RobotParameter], shown: Collection[int]
) -> list[list[np.ndarray]]:
    """Return steps of log factors to both sides, for every gear whose backlash is shown.

    What a gear's crossing takes is 2 B d: its backlash and its damping pull against each other, and
    along that local minima lie one behind the other.  So a gear is taken to both sides along it, and in
    its damping alone.

    Args:
        parameters: Parameters that are learned.
        shown: Numbers of the parameters with a significant effect.

    Returns:
        Steps of each gear whose backlash and damping have a significant effect [1], (P,).
    """
    of = {
        (parameter.gear, parameter.kind): k for k, parameter in enumerate(parameters) if k in shown
    }
    prior = prior_of(tuple(parameters))
    trials = []
    for gear in sorted({parameter.gear for parameter in parameters if parameter.gear is not None}):
        pair = [of[gear, kind] for kind in ("backlash", "damping") if (gear, kind) in of]
        if len(pair) < 2:
            continue
        steps = []
        for size, signs in product(_SIZES, _STEPS):
            step = np.zeros(len(parameters))
            step[pair] = size * prior[pair] * signs
            steps.append(step)
        trials.append(steps)
    return trials


def fitting_window(
    slow: Sequence[np.ndarray],
    means: Sequence[SlowPart],
    noise: float,
    before: float,
    explained: bool = True,
) -> float:
    """Return how far to look next [s], of every run; infinite where all is explained or looked at.

    Args:
        slow: Slow parts of what is left of the measured runs [m], (k, 3) or (k, 6), + c of motors.
        means: Their times.
        noise: Rms that noise alone would leave of them [m].
        before: Time up to which was looked before [s]; 0 in the beginning.
        explained: Whether that was explained.
    """
    least = _LEAST if explained else max(_LEAST, _STRIDE * before)
    ends = [_explained(rows, mean, noise, before) for rows, mean in zip(slow, means, strict=True)]
    if min(ends) == np.inf:
        return np.inf
    seconds = max(min(ends) + _BEHIND, before + least, _FIRST)
    longest = max(float(np.ptp(mean.time)) for mean in means)
    return seconds if seconds < longest else np.inf


def _explained(rows: np.ndarray, mean: SlowPart, noise: float, before: float) -> float:
    """Return when more than noise is left of a run for the first time behind what was looked at [s]."""
    since = mean.time - mean.time[0]
    squares = np.sum(rows[:, :3] ** 2, axis=1)
    count = max(1, round(_OVER * len(since) / max(float(since[-1]), _OVER)))
    over = np.convolve(squares, np.ones(count) / count, mode="same") > (_FAR * noise) ** 2
    late = over & (since > before)
    return float(since[np.argmax(late)]) if late.any() else np.inf
