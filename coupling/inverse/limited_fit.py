"""The best command within limits: quadratic programs on the stretches where they bind."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
import piqp
from scipy import sparse

from coupling.inverse.fit import SplineFit
from coupling.inverse.limits import DriveLimits
from coupling.inverse.rows import stretches

# A stretch begins and ends so long before and after the limits bind [s]; doubled where no command
# within the limits joins the one outside.
_MARGIN = 0.2

# Unit of the programs' unknowns [rad], and how well they keep their equations and limits in it.
_UNIT = 1e-6
_ACCURACY = 1e-9


class NoCommandError(Exception):
    """No command within the limits leads from one end to the other."""


def keep_within(
    fit: SplineFit, limits: DriveLimits, coefficients: np.ndarray, misses: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return coefficients and misses of the best command within limits [rad], (n,) and (nodes,).

    Args:
        fit: Sum of squares of a command.
        limits: Limits of the drive.
        coefficients, misses: The best command without limits [rad], (n,) and (nodes,).

    Raises:
        NoCommandError: If there is none.
    """
    layout, cycle = fit.drive.layout, fit.drive.cycle
    margin = max(ceil(_MARGIN / cycle), 4 * layout.degree)
    coefficients, misses = coefficients.copy(), misses.copy()
    whole = False  # tried as one stretch
    while True:
        over = limits.excess(fit.command(coefficients)) > 0.0
        if not over.any():
            return coefficients, misses
        if whole:
            raise NoCommandError
        whole = margin >= layout.count
        for begin, end in stretches(over, margin, layout.count, layout.degree).tolist():
            drive = slice(begin, end + layout.degree)
            link = slice(begin * layout.parts, end * layout.parts + 1)
            about = fit.along(coefficients, misses)
            stretch = LimitedFit(about.part(begin, end), limits)
            try:
                coefficients[drive], misses[link] = stretch.solve(coefficients[drive], misses[link])
            except NoCommandError:
                if end - begin == layout.count:
                    raise
        margin *= 2


@dataclass(frozen=True)
class LimitedFit:
    """A fit of a stretch whose steps keep to limits.

    Attributes:
        fit: Fit of the stretch; what meets others is held.
        limits: Limits of its command.
    """

    fit: SplineFit
    limits: DriveLimits

    def solve(self, coefficients: np.ndarray, misses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return coefficients (n,) and misses (nodes,) [rad] of the best command, from any one.

        Raises:
            NoCommandError: If none keeps to them.
        """
        layout = self.fit.drive.layout
        change = self._program(self.fit, coefficients, misses, 0.0)
        if change is None:
            raise NoCommandError
        coefficients = coefficients + change[layout.coefficient]
        misses = misses + change[layout.miss]
        return self.fit.descend(coefficients, misses, self._step, lambda *_: self.fit.whole_stretch)

    def _step(
        self,
        fit: SplineFit,
        coefficients: np.ndarray,
        misses: np.ndarray,
        damping: float,
        changing: np.ndarray,
    ) -> np.ndarray:
        change = self._program(fit, coefficients, misses, damping)
        # Where rounding leaves no way on, a step of nothing ends the search.
        return np.zeros(self.fit.drive.layout.size) if change is None else change

    def _program(
        self, fit: SplineFit, coefficients: np.ndarray, misses: np.ndarray, damping: float
    ) -> np.ndarray | None:
        """Return the step to the least objective under the linearised equations, within limits."""
        layout = fit.drive.layout
        free = np.flatnonzero(fit.free)
        band, gradient = fit.objective(coefficients, misses, damping)
        lower = sparse.dia_array((band, -np.arange(len(band))), shape=(layout.size,) * 2).tocsc()
        equations, errors = fit.equations(coefficients, misses)
        rows, low, high = self.limits.rows(fit.command(coefficients))
        place = sparse.csr_array(
            (np.ones(len(coefficients)), (np.arange(len(coefficients)), layout.coefficient)),
            shape=(len(coefficients), layout.size),
        )
        met, kept = _touched(equations[:, free]), _touched((rows @ place)[:, free])
        solver = piqp.SparseSolver()
        solver.settings.eps_abs = solver.settings.eps_rel = _ACCURACY
        solver.setup(
            sparse.csc_matrix(lower[free][:, free].T),
            gradient[free] / _UNIT,
            sparse.csc_matrix(equations[:, free][met]),
            -errors[met] / _UNIT,
            sparse.csc_matrix((rows @ place)[:, free][kept]),
            low[kept] / _UNIT,
            high[kept] / _UNIT,
        )
        if solver.solve() != piqp.PIQP_SOLVED:
            return None
        step = np.zeros(layout.size)
        step[free] = _UNIT * solver.result.x
        return step


def _touched(rows: sparse.csr_array) -> np.ndarray:
    """Return the mask of rows that have entries."""
    touched: np.ndarray = np.diff(rows.indptr) > 0
    return touched
