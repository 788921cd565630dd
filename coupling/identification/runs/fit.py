"""Gauss-Newton fit of parameters, frame and clock to measured runs, in a growing fitting window.

A fit to a whole run has local minima: derivatives do not show that a gear crosses its backlash too late
or not at all, and a fit of everything but a few crossings takes these for outliers.  The error of a
crossing has decayed a second later, so the window is extended along the run as far as the residual is
explained, with a restart at other backlash and damping (`backlash_trials`) where it exceeds the noise.

Until then rows have a fifth of the weight of their noise, which smooths the cost.  They are whitened by
the likeliest spectrum of what the model does not describe, a slow one until the whole run is looked at:
a crossing at the wrong time is no such thing.  The last fit has rows weighted by noise and variance
inflation (`UnexplainedPart`): the most likely robot, and its covariance.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from coupling.identification.estimate import Estimate, estimate
from coupling.identification.intervals import quantile
from coupling.identification.runs.effect import in_parallel
from coupling.identification.runs.experiment import RunExperiment
from coupling.identification.runs.parameters import prior_of
from coupling.identification.runs.problem import FLOOR, FitProblem
from coupling.identification.runs.residual import UnexplainedPart, noise_of
from coupling.identification.runs.slow_part import SlowPart
from coupling.identification.runs.whitening import (
    NONE,
    SLOW_SPECTRA,
    SPECTRA,
    USUAL,
    UnmodelledSpectrum,
)
from coupling.robot.parameters import RobotParameter
from coupling.robot.robot_fmu import RobotFmu

# Changes of a log factor for differences, at most and at least: what is known well is looked at closely,
# as the valley is narrower than the local minima.
_CHANGE, _LEAST_CHANGE = 0.05, 0.002
# Steps of a fit at most, and fits by rows that count by their noise, each with a spectrum of its own.
_STEPS, _SETTLING = 30, 2
# A step that is predicted to make the measurement likelier by less ends a fit: noise explains 0.5 for
# every unknown.
_SETTLED = 0.15
# What is left is noise up to so many standard deviations of what noise leaves, or so many times it.
_SURE, _NEAR_NOISE = 2.0, 1.12
# Steps in backlash and damping of a gear, and their sizes by what was known before: local minima are
# narrow, and the first iterations may have led to the wrong side of what was known.
_STEPS_ASIDE = ((1.0, -1.0), (-1.0, 1.0), (0.0, 1.0), (0.0, -1.0))
_SIZES = (1.0 / 3.0, 2.0 / 3.0)
# What is looked at first [s], by how much more at least, and how far behind where noise ends.
_FIRST, _LEAST, _BEHIND = 1.0, 0.5, 0.5
# By which part more at least where what was looked at stays unexplained, as where a gear is in its
# backlash without load: else a fit that comes to nothing takes longest.
_STRIDE = 0.2
# Means over so long [s] that are so many times noise are no longer explained.
_OVER, _FAR = 0.2, 2.0


@dataclass(frozen=True)
class ParameterFit(Estimate[RunExperiment]):
    """The most likely robot, and how sure it is.

    Attributes:
        covariance: Covariance matrix of all unknowns, in products of their units, (U, U), with rows
            that count by noise and by what is left over it; of each parameter by the derivatives that
            give the wider interval.
        left_over: Discrepancy beyond noise and spectrum.
    """

    covariance: np.ndarray
    left_over: UnexplainedPart

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviations of the errors of log factors [1], (P,)."""
        prior = prior_of(self.experiment.problem.parameters)
        return np.minimum(np.sqrt(np.diag(self.covariance)[: len(prior)]), prior)

    @property
    def half(self) -> np.ndarray:
        """Half widths of their 95 % intervals [1], (P,)."""
        # What is left has a scale of as many independent values as there are identifiable parameters.
        return quantile(max(self.left_over.effective, 1.0)) * self.deviation

    @property
    def noise(self) -> float:
        """Standard deviation of a measured coordinate's noise [m]."""
        return noise_of([rows[:, :3] for rows in self.experiment.residuals])


def fit_runs(
    problem: FitProblem,
    start: np.ndarray,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> ParameterFit:
    """Return the most likely parameters.

    Args:
        problem: The problem.
        start: Log factors to begin at [1], (P,).
        progress: Function called with the milliseconds of the runs that are fitted, and all.
    """
    longest = round(1e3 * max(float(np.ptp(mean.time)) for mean in problem.slow))
    now = RunExperiment.behind_frame(problem, start)
    seconds = _window(now, 0.0)
    # A run that a robot explains already has nothing that the model does not describe.
    spectrum = USUAL if seconds < np.inf else NONE
    while seconds < np.inf:
        part = replace(problem.until(seconds), spectrum=spectrum)
        here = _restarted(RunExperiment.of(part, now.x))
        spectrum = here.likeliest_spectrum(SLOW_SPECTRA)
        now = RunExperiment.of(replace(problem, spectrum=spectrum), here.x)
        progress(min(round(1e3 * seconds), longest), 2 * longest)
        seconds = _window(now, seconds, _is_noise(here))
    progress(longest, 2 * longest)
    return _settled(_restarted(now))


def _settled(now: RunExperiment) -> ParameterFit:
    """Return the most likely robot near what was found, and how sure it is."""
    for _ in range(_SETTLING):
        spectrum = now.likeliest_spectrum(SPECTRA)
        over = _left_over(_counted(now, spectrum, 1.0)).over
        counted = _with_secants(_counted(now, spectrum, over))
        fit = estimate(counted, _free(counted.problem), _STEPS, _SETTLED)
        now = fit.experiment
    left_over = _left_over(_counted(now, spectrum, 1.0))
    covariance = _covariance(_counted(now, spectrum, left_over.over))
    return ParameterFit(now, fit.converged, covariance, left_over)


def _counted(now: RunExperiment, spectrum: UnmodelledSpectrum, over: float) -> RunExperiment:
    """Return the same with rows weighted by their noise, its variance times a factor."""
    variance = max(over * now.problem.noise(now.residuals) ** 2 / 3.0, FLOOR**2)
    return now.weighted(spectrum, variance)


def _left_over(now: RunExperiment) -> UnexplainedPart:
    """Return what is left over noise, by rows that are weighted by that."""
    problem = now.problem
    variance = max(problem.noise(now.residuals) ** 2 / 3.0, FLOOR**2)
    parts = list(zip(problem.slow, now.whitened, strict=True))
    squares = sum(mean.independent * float(np.sum(rows**2)) for mean, rows in parts)
    count = sum(mean.independent * rows.size for mean, rows in parts)
    data = now.equations[0] - np.diag(problem.prior**-2.0)
    return UnexplainedPart.of(squares / variance, count, data, problem.prior)


def _covariance(now: RunExperiment) -> np.ndarray:
    """Return the covariance of all unknowns, by the derivatives that give the wider interval.

    An unloaded gear leaves its flank at another time when anything is changed, which differences of
    simulations take for knowledge of that; the gears' equation knows what it moves on its flanks,
    but not what other gears do meanwhile.
    """
    problem = now.problem
    by_secants, by_equation = (
        np.linalg.inv(replace(now, slopes=now.slopes_by(derivatives)).equations[0])
        for derivatives in (problem.secants(_CHANGE), problem.effects)
    )
    wider = np.sqrt(np.maximum(1.0, np.diag(by_equation) / np.diag(by_secants)))
    wider[len(problem.parameters) :] = 1.0
    covariance: np.ndarray = wider[:, None] * by_secants * wider
    return covariance


def _window(now: RunExperiment, before: float, explained: bool = True) -> float:
    """Return how far to look next [s]."""
    problem = now.problem
    noise = problem.noise(now.residuals)
    return fitting_window(now.whitened, problem.slow, noise, before, explained)


def _free(problem: FitProblem) -> tuple[np.ndarray, np.ndarray]:
    """Return no bounds, for all unknowns in their units, (U,) each."""
    high = np.full(problem.size, np.inf)
    return -high, high


def _refined(start: RunExperiment) -> RunExperiment:
    """Return what is found from some unknowns on."""
    # Far from the solution derivatives of the gears' equation lead towards it.
    here = replace(start, slopes=start.slopes_by(start.problem.effects))
    return estimate(_with_secants(here), _free(start.problem), _STEPS, _SETTLED).experiment


def _restarted(start: RunExperiment) -> RunExperiment:
    """Return what is found from some unknowns and, if that leaves more than noise, beside them."""
    here = _refined(start)
    restart = None if _is_noise(here) else _best_restart(here)
    if restart is None:
        return here
    aside, x = restart
    fitted = aside.at(x)
    if fitted is not None and fitted.cost(here) < aside.cost(here):
        aside = replace(fitted, scale=here.scale)
    other = _refined(aside)
    return other if other.cost(here) < here.cost(here) - _SETTLED else here


def _with_secants(now: RunExperiment) -> RunExperiment:
    """Return the same with derivatives by differences of simulations, computed when asked for.

    Differences are as large as the standard deviations of the parameters by the derivatives so far.
    """
    variance = np.diag(np.linalg.inv(now.equations[0]))
    change = np.sqrt(variance[: len(now.problem.parameters)]).clip(_LEAST_CHANGE, _CHANGE)
    return replace(now, derivatives=now.problem.secants(change), reach=change, exact_at=None)


def _is_noise(now: RunExperiment) -> bool:
    """Whether hardly more is left than noise, by how much chance there is in that."""
    means = sum(3.0 * mean.independent * len(mean.time) for mean in now.problem.slow)
    chance = 1.0 + _SURE / float(np.sqrt(2.0 * means))
    return now.over_noise <= max(_NEAR_NOISE, chance)


def _best_restart(now: RunExperiment) -> tuple[RunExperiment, np.ndarray] | None:
    """Return where to try again: beside what was found, in backlash and damping of one gear.

    All else is fitted to these with derivatives that are known, which tells the best gear and side.

    Returns:
        The runs around unknowns of which these were changed; and those with the others fitted to them
        [1, m, rad, s], (U,).
    """
    problem = now.problem
    shown = {int(k) for secant in problem.secants(_CHANGE) for k in secant.shown}

    def fit_others(fmu: RobotFmu, step: np.ndarray) -> tuple[float, RunExperiment, np.ndarray]:
        """Return a step of log factors, the others fitted to it, and the cost that is predicted."""
        x = now.x.copy()
        x[: len(step)] += step
        after = replace(RunExperiment.of(problem, x, fmu), scale=now.scale, slopes=now.slopes)
        free = np.setdiff1d(np.arange(len(x)), np.flatnonzero(step))
        matrix, right = after.equations
        change = np.linalg.solve(matrix[np.ix_(free, free)], right[free])
        fitted = x.copy()
        fitted[free] += change
        return after.cost(after) - 0.5 * float(right[free] @ change), after, fitted

    restarts = in_parallel(problem.fmus, backlash_trials(problem.parameters, shown), fit_others)
    best = min(restarts, key=lambda restart: restart[0], default=None)
    return None if best is None else best[1:]


def backlash_trials(
    parameters: Sequence[RobotParameter], shown: Collection[int]
) -> list[np.ndarray]:
    """Return steps of log factors to both sides, for every gear whose backlash is shown.

    What a gear's crossing takes is 2 B d: its backlash and its damping pull against each other, and
    along that local minima lie one behind the other.  So a gear is taken to both sides along it, and in
    its damping alone.

    Args:
        parameters: Parameters that are learned.
        shown: Numbers of the parameters with a significant effect.

    Returns:
        Steps of the gears whose backlash and damping have a significant effect [1], (P,).
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
        for size, signs in product(_SIZES, _STEPS_ASIDE):
            step = np.zeros(len(parameters))
            step[pair] = size * prior[pair] * signs
            trials.append(step)
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
