"""Which parameters of a fit to recordings of a motion are identifiable."""

from __future__ import annotations

import numpy as np

from coupling.identification.motion.experiment import MotionExperiment
from coupling.identification.motion.fit import SUPPORTED, fit_roughly
from coupling.identification.motion.problem import MotionProblem

# An encoder's error is identifiable with an interval below this part of itself, or of its usual size,
# which shows that there is none.
_OF_ITSELF, _NARROW = 1.0, 0.3
# A fit from an end of an interval comes back as near as this part of its half.
_BACK = 0.3


def identifiable(fit: MotionExperiment) -> np.ndarray:
    """Return the mask of parameters of a fit that the recordings identify, (P,).

    What an interval does not bound to its usual size, or, of what is not negative, away from none, stays
    as in the start, the widest first; the others answer, to first order.  What is known before is not
    left out: it is between start and recordings.
    """
    has_prior = fit.problem.prior > 0.0
    chosen = np.ones(len(fit.x), dtype=bool)
    away = fit.problem.start - fit.x
    while chosen.any():
        blocks = fit.blocks.only(chosen, away)
        x = fit.x[chosen] + blocks.step
        width = blocks.half * blocks.deviation / _allowed(fit.problem.only(chosen), x)
        width[has_prior[chosen]] = 0.0
        worst = int(np.argmax(width))
        if width[worst] <= 1.0:
            break
        chosen[np.flatnonzero(chosen)[worst]] = False
    return chosen


def narrow(fit: MotionExperiment) -> np.ndarray:
    """Return the mask of parameters with an interval as narrow as `identifiable` asks, (P,)."""
    width = fit.blocks.half * fit.blocks.deviation / _allowed(fit.problem, fit.x)
    of_slow_error = [p.of_slow_error for p in fit.problem.parameters]
    return np.asarray(width <= 1.0) & ~np.array(of_slow_error, dtype=bool)


def returns(fit: MotionExperiment, chosen: np.ndarray) -> np.ndarray:
    """Return which parameters, (P,), stay if the fit is repeated from the ends of intervals.

    Where the squares are flat or rugged, or have other minima nearly as likely, it ends elsewhere: the
    value is one of several, and its interval is too narrow.

    Args:
        chosen: Mask of parameters whose intervals are tried, (P,).
    """
    half = fit.blocks.half * fit.blocks.deviation
    stays, least = np.ones(len(fit.x), dtype=bool), fit.minus_log_likelihood
    for k in np.flatnonzero(chosen):
        others = np.arange(len(fit.x)) != k
        for end in (-1.0, 1.0):
            x = np.where(others, fit.x, fit.x + end * half)
            x = np.clip(x, *fit.problem.bounds)
            x[others] += fit.blocks.only(others, x - fit.x).step
            back = fit_roughly(fit.problem, x)
            if back.minus_log_likelihood < least + SUPPORTED:
                stays &= np.abs(back.x - fit.x) <= _BACK * half
    return stays


def _allowed(problem: MotionProblem, x: np.ndarray) -> np.ndarray:
    """Return half of the widest interval of an identifiable parameter, (P,)."""
    allowed = np.where([p.signed for p in problem.parameters], 1.0, np.clip(x, 1e-9, 1.0))
    for k, p in enumerate(problem.parameters):
        if p.vanishes:
            allowed[k] = _NARROW
        if p.sensor:
            allowed[k] = max(_OF_ITSELF * abs(x[k]), _NARROW)
    return allowed
