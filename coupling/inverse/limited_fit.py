"""The best command within limits: quadratic programs on the stretches where they bind."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import piqp
from scipy import sparse

from coupling.inverse.drive_limits import DriveLimits
from coupling.inverse.fit import SplineFit

# Unit of the programs' unknowns [rad], and how well they keep their equations and limits in it.
_UNIT = 1e-6
_ACCURACY = 1e-9


def keep_within(
    fit: SplineFit, limits: DriveLimits, coefficients: np.ndarray, misses: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return coefficients and misses of the best command within limits [rad], (n,) and (nodes,).

    Args:
        fit: Sum of squares of a command.
        coefficients, misses: The best command without limits [rad], (n,) and (nodes,).

    Raises:
        NoCommandError: If there is none.
    """
    layout = fit.drive.layout

    def solve(
        unknowns: tuple[np.ndarray, np.ndarray], begin: int, end: int
    ) -> tuple[np.ndarray, np.ndarray] | None:
        coefficients, misses = unknowns[0].copy(), unknowns[1].copy()
        drive = slice(begin, end + layout.degree)
        link = slice(begin * layout.parts, end * layout.parts + 1)
        stretch = LimitedFit(fit.along(coefficients, misses).part(begin, end), limits)
        solved = stretch.solve(coefficients[drive], misses[link])
        if solved is None:
            return None
        coefficients[drive], misses[link] = solved
        return coefficients, misses

    return limits.keep((coefficients, misses), lambda unknowns: fit.command(unknowns[0]), solve)


@dataclass(frozen=True)
class LimitedFit:
    """A fit of a stretch whose steps keep to limits.

    Attributes:
        fit: Fit of the stretch; what meets others is held.
        limits: Limits of its command.
    """

    fit: SplineFit
    limits: DriveLimits

    def solve(
        self, coefficients: np.ndarray, misses: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Return coefficients (n,) and misses (nodes,) [rad] of the best command, from any one.

        None where no command keeps to the limits.
        """
        layout = self.fit.drive.layout
        change = self._program(self.fit, coefficients, misses, 0.0)
        if change is None:
            return None
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
        change = solve_program(
            lower[free][:, free].T,
            gradient[free],
            equations[:, free],
            -errors,
            ((rows @ place)[:, free], low, high),
        )
        if change is None:
            return None
        step = np.zeros(layout.size)
        step[free] = change
        return step


def solve_program(
    hessian: sparse.sparray,
    gradient: np.ndarray,
    equations: sparse.csr_array,
    target: np.ndarray,
    within: tuple[sparse.csr_array, np.ndarray, np.ndarray],
) -> np.ndarray | None:
    """Return the x that minimises x^T H x / 2 + g^T x [rad], (n,); None where none is feasible.

    Args:
        hessian, gradient: Upper triangle of H [1], (n, n), and g [rad], (n,).
        equations, target: A [1], (e, n), and b [rad], (e,), with A x = b.
        within: D [1], (r, n), and the ends of D x [rad], (r,) each.
    """
    rows, low, high = within
    met, kept = (np.diff(matrix.indptr) > 0 for matrix in (equations, rows))
    solver = piqp.SparseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = _ACCURACY
    solver.setup(
        sparse.csc_matrix(hessian),
        gradient / _UNIT,
        sparse.csc_matrix(equations[met]),
        target[met] / _UNIT,
        sparse.csc_matrix(rows[kept]),
        low[kept] / _UNIT,
        high[kept] / _UNIT,
    )
    if solver.solve() != piqp.PIQP_SOLVED:
        return None
    x: np.ndarray = _UNIT * solver.result.x
    return x
