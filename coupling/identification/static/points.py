"""Whether the load acted, or was measured, elsewhere on the tool than the table says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.identification.static.fit import StaticFit
from coupling.identification.static.measurements import Measurements
from coupling.identification.static.prediction import point_columns
from coupling.identification.static.support import Evidence, support

# A shift of a point that is worth a word [m].
_SIZE = 1e-3
_NAMES = ("measured point", "load point")


@dataclass(frozen=True)
class MovedPoint:
    """A shift common to all rows, beside all parameters.

    Attributes:
        name: "measured point" or "load point".
        shift: In the TCP's frame [m], (3,), to first order.
        support: Whether the data support it: three numbers together.
    """

    name: str
    shift: tuple[float, ...]
    support: Evidence

    def suspicion(self) -> str:
        """Return what is to be suspected, in words; "" for nothing."""
        if not self.support.supported:
            return ""
        place = ", ".join(f"{value:.3f}" for value in self.shift)
        return (
            f"the {self.name} seems to be [{place}] m from where the table has it, in the TCP's frame"
            f" and to first order ({self.support.in_words()}): look where it was"
        )


def moved_points(fit: StaticFit, measured: Measurements) -> list[MovedPoint]:
    """Return the shifts of both points that fit best, one point at a time.

    Args:
        fit: The fit.
        measured: The measurements.
    """
    columns = point_columns(fit.elasticity, measured, fit.values)
    found = []
    for name, own in zip(_NAMES, columns, strict=True):
        problem = fit.problem
        for column in np.moveaxis(fit.white @ own, 2, 0):
            problem = problem.also(column, _SIZE, signed=True)
        tested = np.arange(len(problem.start)) >= len(fit.values)
        shift = problem.weighted(fit.weight).solve()[tested]
        own_support = support(problem, tested, fit.weight, len(_NAMES))
        found.append(MovedPoint(name, tuple(shift.tolist()), own_support))
    return found
