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

from coupling.identification.estimate import estimate
from coupling.identification.runs.effect import in_parallel
from coupling.identification.runs.linearisation import (
    FLOOR,
    FitObjective,
    FitPoint,
    Restart,
    RunLinearisation,
)
from coupling.identification.runs.parameters import prior_of
from coupling.identification.runs.problem import FitProblem
from coupling.identification.runs.residual import UnexplainedPart
from coupling.identification.runs.slow_part import SlowPart
from coupling.identification.runs.whitening import (
    NONE,
    SLOW_SPECTRA,
    SPECTRA,
    USUAL,
    UnmodelledSpectrum,
    WhitenedRun,
    likeliest_spectrum,
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
class ParameterFit(FitPoint):
    """The most likely robot, and how sure it is.

    Attributes:
        covariance: Covariance matrix of all unknowns, in products of their units, (U, U), with rows
            that count by noise and by what is left over it; of each parameter by the derivatives that
            give the wider interval.
        converged: Whether another step would explain next to nothing.
        left_over: Discrepancy beyond noise and spectrum.
        spectrum: Spectrum of what the model does not describe.
    """

    covariance: np.ndarray
    converged: bool
    left_over: UnexplainedPart
    spectrum: UnmodelledSpectrum


class Fitter:
    """Fits one problem, also to other measurements at the same times.

    Args:
        problem: The problem.
    """

    def __init__(self, problem: FitProblem) -> None:
        self.problem = problem
        self._whole = FitObjective(problem, NONE)

    def fit(
        self, start: np.ndarray, progress: Callable[[int, int], None] = lambda done, total: None
    ) -> ParameterFit:
        """Return the most likely parameters.

        Args:
            start: Log factors to begin at [1], (P,).
            progress: Function called with the milliseconds of the runs that are fitted, and all.
        """
        longest = round(1e3 * max(float(np.ptp(mean.time)) for mean in self._whole.slow))
        whole, now = self._whole, self._whole.framed(start)
        seconds = _window(whole, now, 0.0)
        # A run that a robot explains already has nothing that the model does not describe.
        spectrum = USUAL if seconds < np.inf else NONE
        while seconds < np.inf:
            part = FitObjective(self.problem.until(seconds), spectrum)
            here = _restarted(part, part.at(now.z))
            spectrum = _likeliest(here, SLOW_SPECTRA)
            whole = FitObjective(self.problem, spectrum)
            now = whole.at(here.point.z)
            progress(min(round(1e3 * seconds), longest), 2 * longest)
            seconds = _window(whole, now, seconds, _is_noise(part, here.point))
        progress(longest, 2 * longest)
        return self._settled(_restarted(FitObjective(self.problem, spectrum), now))

    def at(self, x: np.ndarray, spectrum: UnmodelledSpectrum) -> FitPoint:
        """Return what given parameters leave, behind the frame that fits them best.

        Args:
            x: Log factors [1], (P,).
            spectrum: Spectrum of what the model does not describe.
        """
        return FitObjective(self.problem, spectrum).framed(x)

    def noise(self, residuals: Sequence[np.ndarray]) -> float:
        """Return the rms of slow parts that residuals (n, 3 or more) have by noise alone [m]."""
        return self._whole.noise(residuals)

    def _settled(self, now: RunLinearisation) -> ParameterFit:
        """Return the most likely robot near what was found, and how sure it is."""
        for _ in range(_SETTLING):
            spectrum = _likeliest(now, SPECTRA)
            over = self._left_over(self._counted(now, spectrum, 1.0)).over
            counted = _with_secants(self._counted(now, spectrum, over))
            fit = estimate(counted, _free(counted.objective), _STEPS, _SETTLED)
            now = fit.experiment
        left_over = self._left_over(self._counted(now, spectrum, 1.0))
        covariance = self._covariance(self._counted(now, spectrum, left_over.over))
        return ParameterFit(
            **vars(now.point),
            covariance=covariance,
            converged=fit.converged,
            left_over=left_over,
            spectrum=spectrum,
        )

    def _counted(
        self, now: RunLinearisation, spectrum: UnmodelledSpectrum, over: float
    ) -> RunLinearisation:
        """Return the same with rows weighted by their noise, its variance times a factor."""
        variance = max(over * self._whole.noise(now.point.residuals) ** 2 / 3.0, FLOOR**2)
        objective = FitObjective(self.problem, spectrum, variance)
        return replace(now, objective=objective, point=objective.at(now.x))

    def _left_over(self, now: RunLinearisation) -> UnexplainedPart:
        """Return what is left over noise, by rows that are weighted by that."""
        objective, point = now.objective, now.point
        variance = max(self._whole.noise(point.residuals) ** 2 / 3.0, FLOOR**2)
        parts = list(zip(objective.slow, point.rows, strict=True))
        squares = sum(mean.independent * float(np.sum(rows**2)) for mean, rows in parts)
        count = sum(mean.independent * rows.size for mean, rows in parts)
        data = objective.equations(point, now.slopes)[0] - np.diag(self.problem.prior**-2.0)
        return UnexplainedPart.of(squares / variance, count, data, self.problem.prior)

    def _covariance(self, now: RunLinearisation) -> np.ndarray:
        """Return the covariance of all unknowns, by the derivatives that give the wider interval.

        An unloaded gear leaves its flank at another time when anything is changed, which differences of
        simulations take for knowledge of that; the gears' equation knows what it moves on its flanks,
        but not what other gears do meanwhile.
        """
        secants = self.problem.secants(_CHANGE)
        by_secants, by_equation = (
            np.linalg.inv(
                now.objective.equations(now.point, now.objective.slopes(now.x, derivatives))[0]
            )
            for derivatives in (secants, self.problem.effects)
        )
        wider = np.sqrt(np.maximum(1.0, np.diag(by_equation) / np.diag(by_secants)))
        wider[len(self.problem.parameters) :] = 1.0
        covariance: np.ndarray = wider[:, None] * by_secants * wider
        return covariance


def _likeliest(now: RunLinearisation, spectra: Sequence[UnmodelledSpectrum]) -> UnmodelledSpectrum:
    """Return the likeliest spectrum of what the model does not describe."""
    objective, runs = now.objective, []
    for number, run in enumerate(objective.problem.runs):
        poses = run.coordinates
        rows = now.point.slow[number][:, :poses]
        columns = np.zeros((*rows.shape, objective.problem.size))
        of_run = objective.columns(now.point, number, now.slopes[number])[:, :poses]
        columns[:, :, objective.unknowns_of(number)] = of_run
        runs.append(WhitenedRun(objective.whitening[number], rows, columns))
    return likeliest_spectrum(runs, now.x, objective.problem.prior, spectra)


def _window(whole: FitObjective, now: FitPoint, before: float, explained: bool = True) -> float:
    """Return how far to look next [s]."""
    return fitting_window(now.rows, whole.slow, whole.noise(now.residuals), before, explained)


def _free(objective: FitObjective) -> tuple[np.ndarray, np.ndarray]:
    """Return no bounds, for all unknowns in their units, (U,) each."""
    high = np.full(objective.problem.size, np.inf)
    return -high, high


def _refined(objective: FitObjective, start: FitPoint) -> RunLinearisation:
    """Return what is found from some unknowns on.

    Args:
        objective: Sum of squares of the runs, or of a part of them.
        start: Unknowns to begin at.
    """
    # Far from the solution derivatives of the gears' equation lead towards it.
    slopes = objective.slopes(start.z, objective.problem.effects)
    here = RunLinearisation(objective, start, (), np.zeros(0), slopes)
    return estimate(_with_secants(here), _free(objective), _STEPS, _SETTLED).experiment


def _restarted(objective: FitObjective, start: FitPoint) -> RunLinearisation:
    """Return what is found from some unknowns and, if that leaves more than noise, beside them."""
    here = _refined(objective, start)
    now = here.point
    restart = None if _is_noise(objective, now) else _best_restart(here)
    if restart is None:
        return here
    aside, fitted = restart.point, objective.try_at(restart.z, now.scale)
    if fitted is not None and fitted.cost < aside.cost:
        aside = fitted
    other = _refined(objective, aside)
    there = other.point
    cost = 0.5 * objective.rescaled(there.z, there.rows, now.scale)[1]
    return other if cost < now.cost - _SETTLED else here


def _with_secants(now: RunLinearisation) -> RunLinearisation:
    """Return the same with derivatives by differences of simulations, computed when asked for.

    Differences are as large as the standard deviations of the parameters by the derivatives so far.
    """
    problem = now.objective.problem
    variance = np.diag(np.linalg.inv(now.objective.equations(now.point, now.slopes)[0]))
    change = np.sqrt(variance[: len(problem.parameters)]).clip(_LEAST_CHANGE, _CHANGE)
    return replace(now, derivatives=problem.secants(change), reach=change, exact_at=None)


def _is_noise(part: FitObjective, now: FitPoint) -> bool:
    """Whether hardly more is left than noise, by how much chance there is in that."""
    means = sum(3.0 * mean.independent * len(mean.time) for mean in part.slow)
    chance = 1.0 + _SURE / float(np.sqrt(2.0 * means))
    return part.over_noise(now) <= max(_NEAR_NOISE, chance)


def _best_restart(now: RunLinearisation) -> Restart | None:
    """Return where to try again: beside what was found, in backlash and damping of one gear.

    All else is fitted to these with derivatives that are known, which tells the best gear and side.
    """
    problem = now.objective.problem
    shown = {int(k) for secant in problem.secants(_CHANGE) for k in secant.shown}

    def tried(fmu: RobotFmu, step: np.ndarray) -> Restart:
        return now.objective.fit_others(now.point, now.slopes, step, fmu)

    restarts = in_parallel(problem.fmus, backlash_trials(problem.parameters, shown), tried)
    return min(restarts, key=lambda restart: restart.cost, default=None)


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
