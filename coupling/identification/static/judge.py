"""The verdict on each parameter: identified, or why its start value is kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from coupling.identification.static.accuracy import ConfidenceIntervals
from coupling.identification.static.fit import StaticFit
from coupling.identification.static.separable import Separability
from coupling.identification.static.support import Evidence
from coupling.identification.verdict import ParameterVerdict


@dataclass(frozen=True)
class IdentifiedParameter(ParameterVerdict):
    """A parameter and what the measurements say of it: a stiffness [N m/rad], or a backlash.

    Attributes:
        support: F test and leave-one-out of a tilt or backlash; None for torsions.
    """

    support: Evidence | None

    @property
    def is_backlash(self) -> bool:
        """Whether its numbers are half widths of backlash [rad]."""
        return self.parameter.kind == "backlash"


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
        telling: What postures and loads identify.
    """
    own = fit.elasticity
    # Compliances turn round: the largest one is the smallest stiffness.
    ends = np.sort([own.in_units(sure.low), own.in_units(sure.high)], axis=0)
    numbers = np.array([own.in_units(fit.values), *ends]).T.tolist()
    found = []
    for j, parameter in enumerate(own.own):
        reason, tested = _reason(fit, sure, telling, j), supports.get(j)
        if not reason and tested is not None and not tested.supported:
            reason = tested.in_words()
        value, low, high = numbers[j]
        found.append(IdentifiedParameter(parameter, value, low, high, reason, tested))
    return tuple(found)


def _reason(fit: StaticFit, sure: ConfidenceIntervals, telling: Separability, j: int) -> str:
    name = fit.elasticity.names[j]
    if not fit.converged:
        return "the fit has not converged"
    if name in telling.silent:
        if fit.elasticity.own[j].kind in ("hysteresis", "slip_angle"):
            return "no loop turns the load of this gear back"
        if fit.elasticity.is_backlash[j]:
            return "no measurement moves it: no load takes this gear to another flank"
        return "no measurement moves it: no load turns it, or the measured point does not follow"
    if fit.rigid.held[j]:
        mixed = [d.in_words() for d in telling.unseen if name in d.names]
        return f"not distinguishable: {' and '.join(mixed)} change nothing measured"
    if sure.against[j] and fit.elasticity.own[j].kind == "hysteresis":
        return "its loops are narrower than none would be"
    if sure.against[j]:
        return "deflections go against its load: it would be negative"
    if not np.isfinite(sure.high[j]):
        return "as many unknowns as numbers measured: no error can be estimated"
    if sure.low[j] <= 0.0 and not fit.elasticity.is_compliance[j]:
        return "its interval reaches to none"
    if sure.low[j] <= 0.0:
        return "its interval reaches to rigid"
    return ""
