"""Noise in the forces of a process, and its removal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from coupling.process.base import ProcessRequest, ProcessResponse
from coupling.process.noise_filter import AdaptiveLowPass, ForceFilter
from coupling.results.repeatability import ForceNoise, Repeatability

# Second answer of a process to the path of a first one; None where it takes too long or fails.
SecondAnswer = Callable[[ProcessRequest], ProcessResponse | None]

# Noise below this part of the largest force is rounding, or the unevenness of a computed one.
_COUNTS = 1e-3
# A difference of third order: what a parabola through three neighbours leaves of the fourth.
_ORDER = 3
# Median of the magnitude of a normal variable over its standard deviation.
_MEDIAN = 0.6744897501960817


def noise_level(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the standard deviation of white noise in a history.

    A divided difference of third order, d = sum_j w_j y_j over four neighbours with
    w_j = 1 / prod_(i != j) (t_j - t_i), is zero for every parabola, whatever the steps.  With the w_j of
    a row scaled to sum_j w_j^2 = 1 it has the standard deviation of the noise, which is estimated from
    the median of its magnitude, sigma = median |d| / 0.6745: jumps and corners in some rows do not
    count.  Variance from differences of neighbours is that of [VonNeumann1941], scaled ones for uneven
    steps, there of second order, are those of [Gasser1986].

    Noise that is filtered shows less, a history that is constant for more than half of its samples
    none.

    Args:
        time: Rising times [s], (n,).
        values: (n,) or (n, k), in any unit.

    Returns:
        The standard deviation of each column, in the unit of `values`, (k,) or (); 0 of fewer than four
        samples, of which nothing can be said.

    Example:
        >>> time = np.linspace(0.0, 10.0, 2001)
        >>> noise = np.random.default_rng(1).normal(0.0, 15.0, time.shape)
        >>> bool(14.0 < noise_level(time, 300.0 * np.sin(time) + noise) < 16.0)
        True
    """
    values = np.asarray(values, dtype=float)
    if len(time) <= _ORDER:
        return np.zeros(values.shape[1:])
    rows = np.arange(len(time) - _ORDER)[:, None] + np.arange(_ORDER + 1)
    apart = time[rows][:, :, None] - time[rows][:, None, :]
    # Over the mean step, so that no product of short ones gets out of range.
    apart /= np.ptp(time[rows], axis=1)[:, None, None] / _ORDER
    apart[:, np.arange(_ORDER + 1), np.arange(_ORDER + 1)] = 1.0
    weights = 1.0 / apart.prod(axis=2)
    weights /= np.linalg.norm(weights, axis=1)[:, None]
    difference = np.einsum("nj,nj...->n...", weights, values[rows])
    return np.median(np.abs(difference), axis=0) / _MEDIAN


def _is_significant(level: np.ndarray, peak: float) -> bool:
    """Return whether noise of a level (tools, 6) [N], [N m] counts beside the largest force [N]."""
    return float(level[:, :3].max()) > _COUNTS * peak


def force_noise(
    level: np.ndarray, filter_: ForceFilter | None, peak: float, unexplained: float = 0.0
) -> ForceNoise:
    """Return the noise in forces, with what is done about it in words.

    Args:
        level: Standard deviation of white noise in them, (tools, 6) [N], [N m].
        filter_: Filter that takes it off; None: nothing does.
        peak: Largest force [N].
        unexplained: Level of noise that forces as uneven may have, where no second answer says whether
            it is noise [N]; `level` is then zero.
    """
    force, significant = float(level[:, :3].max()), _is_significant(level, peak)
    adaptive = isinstance(filter_, AdaptiveLowPass)
    is_filtered = filter_ is not None and (significant or not adaptive)
    treatment = f"{filter_}, without delay" if is_filtered else "not filtered"
    what = f"of about {force:.3g} N" if significant else "that is negligible"
    sentence = f"The forces of the process have noise {what}; they are {treatment}."
    if unexplained > 0.0:
        sentence = (
            f"The forces of the process are uneven, as with noise of about {unexplained:.3g} N;"
            " whether it is noise is not known without a second evaluation of the same path, which"
            f" takes too long or failed; they are {treatment}. Give cutoff_Hz in [process]: a"
            ' frequency where it is noise, "none" where it is not.'
        )
    return ForceNoise(
        force=force,
        cutoff=None if filter_ is None else filter_.cutoff,
        adaptive=adaptive,
        significant=significant,
        sentence=sentence,
    ).with_level(level, is_unsure=unexplained > 0.0 and filter_ is not None)


class NoiseRemoval:
    """Removal of the noise in a process's answers.

    Noise is what two answers to one path differ by.  What is uneven in a record is noise; what is uneven
    in a computed answer may be what the path asks for, as where nodes of a mesh come into contact, so
    that the process is evaluated a second time before anything is taken off.  Periodic answers are left
    as they are: what is fast in them is meant.

    Args:
        filter_: Filter that takes the noise off; None leaves it.
        second_answer: Function that evaluates a path again; None where what is uneven is noise.

    Attributes:
        noise: Noise in the last answer; None before, and where it was periodic.
        repeatability: Difference of both answers; None where there is no second one.
    """

    def __init__(
        self, filter_: ForceFilter | None, second_answer: SecondAnswer | None = None
    ) -> None:
        self._filter, self._second_answer = filter_, second_answer
        self.noise: ForceNoise | None = None
        self.repeatability: Repeatability | None = None
        self._is_compared = False
        self._is_noise: bool | None = None

    def smoothed(self, request: ProcessRequest) -> ProcessResponse:
        """Return an answer, its wrenches without their noise, and how much there was."""
        response = request.response
        if response.period is not None:
            return response
        wrench = response.wrench
        level = _level(wrench.instants, wrench.before)
        self.noise = force_noise(level, self._filter, wrench.peak_force)
        if self._second_answer is not None and self.noise.significant:
            self._compare(request, self._second_answer)
            if not self._is_noise:
                unexplained = self.noise.force if self._is_noise is None else 0.0
                level = np.zeros_like(level)
                self.noise = force_noise(level, self._filter, wrench.peak_force, unexplained)
        significant = level if self.noise.significant else np.zeros_like(level)
        filtered = wrench if self._filter is None else self._filter.of(wrench, significant)
        return replace(response, wrench=filtered, noise=float(significant[:, :3].max()))

    def _compare(self, request: ProcessRequest, ask_again: SecondAnswer) -> None:
        """Find from a second answer whether what is uneven is noise, once.

        The level of noise stays that of the first answer, so that a run on stored answers is the same.
        """
        if self._is_compared:
            return
        self._is_compared = True
        second, first = ask_again(request), request.response
        if second is None:
            return
        self.repeatability = Repeatability.of(first.wrench, second.wrench)
        difference = second.wrench.before - first.wrench.before
        # The variance of a difference is twice that of one answer.
        level = _level(first.wrench.instants, difference) / np.sqrt(2.0)
        self._is_noise = _is_significant(level, first.wrench.peak_force)


def _level(time: np.ndarray, wrenches: np.ndarray) -> np.ndarray:
    """Return the level of noise in wrenches of all tools [N, N m], (tools, 6)."""
    return np.stack([noise_level(time, wrench) for wrench in wrenches])
