"""The verdict on each parameter: identified, or why its start value is kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from coupling.identify.accuracy import ConfidenceIntervals
from coupling.identify.fit import StaticFit
from coupling.identify.separable import Separability
from coupling.identify.support import Evidence


@dataclass(frozen=True)
class IdentifiedParameter:
    """A parameter and what the measurements tell of it.

    Attributes:
        name: As the FMU names it.
        is_backlash: Whether its numbers are half widths [rad]; else they are stiffnesses [N m/rad].
        start, value: Of the start file and of the fit.
        low, high: 95 % interval; infinite where nothing bounds it.
        identified: Whether the value may be written.
        reason: Why not, in words; "" if it may.
        support: Of a tilt or backlash: what the tests say.
    """

    name: str
    is_backlash: bool
    start: float
    value: float
    low: float
    high: float
    identified: bool
    reason: str
    support: Evidence | None


def judged(
    fit: StaticFit,
    sure: ConfidenceIntervals,
    supports: Mapping[int, Evidence],
    telling: Separability,
) -> tuple[IdentifiedParameter, ...]:
    """Return the verdicts on all parameters.

    Args:
        fit: The fit.
        sure: Intervals.
        supports: Tests of tilts and backlashes by their number.
        telling: What postures and loads can tell.
    """
    own = fit.elasticity
    value, start = own.in_units(fit.values), own.in_units(own.start)
    # Compliances turn round: the largest one is the smallest stiffness.
    first, last = own.in_units(sure.low), own.in_units(sure.high)
    found = []
    for j, name in enumerate(own.names):
        reason = _reason(fit, sure, telling, j)
        tested = supports.get(j)
        if not reason and tested is not None and not tested.supported:
            reason = tested.in_words()
        low, high = sorted((float(first[j]), float(last[j])))
        found.append(
            IdentifiedParameter(
                name,
                bool(own.is_backlash[j]),
                float(start[j]),
                float(value[j]),
                low,
                high,
                not reason,
                reason,
                tested,
            )
        )
    return tuple(found)


def _reason(fit: StaticFit, sure: ConfidenceIntervals, telling: Separability, j: int) -> str:
    name = fit.elasticity.names[j]
    if not fit.converged:
        return "the fit has not converged"
    if name in telling.silent:
        if fit.elasticity.is_backlash[j]:
            return "no measurement moves it: no load takes this gear to another flank"
        return "no measurement moves it: no load turns it, or the measured point does not follow"
    if fit.rigid.held[j]:
        mixed = [d.in_words() for d in telling.unseen if name in d.names]
        return f"cannot be told apart: {' and '.join(mixed)} change nothing measured"
    if sure.against[j]:
        return "deflections go against its load: it would be negative"
    if not np.isfinite(sure.high[j]):
        return "as many unknowns as numbers measured: no error can be told"
    if sure.low[j] <= 0.0 and fit.elasticity.is_backlash[j]:
        return "its interval reaches to none"
    if sure.low[j] <= 0.0:
        return "its interval reaches to rigid"
    return ""
