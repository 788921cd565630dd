"""Commands within a drive's limits: quadratic programs on the stretches where they bind."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import piqp
from scipy import sparse

from coupling.inverse.fit import Fit
from coupling.inverse.rows import Rows

# A stretch begins and ends so long before and after the limits bind [s]; doubled where no command
# within the limits joins the one outside.
_MARGIN = 0.1

# The programs keep this part of a limit back, so that their own rounding does not pass it.
_HAIR = 1e-7

# Unit of the programs' unknowns [rad].
_UNIT = 1e-6


@dataclass(frozen=True)
class DriveLimits:
    """What a drive can do, at all times; infinite where nothing is known.

    Attributes:
        joint: Number of the joint, from 1.
        lower: Lowest angle [rad].
        upper: Highest angle [rad].
        rate: Largest |q'| [rad/s].
        acceleration: Largest |q''| [rad/s^2].
    """

    joint: int
    lower: float = -np.inf
    upper: float = np.inf
    rate: float = np.inf
    acceleration: float = np.inf

    def bounds(self, order: int, cycle: float) -> tuple[float, float]:
        """Return what the differences of that order of a command's coefficients may be [rad].

        They are the control points of its derivative, times the cycle to that power: the derivative
        lies between the least and the largest of them, everywhere.
        """
        if order == 0:
            return self.lower, self.upper
        most = (self.rate, self.acceleration)[order - 1] * cycle**order
        return -most, most

    def excess(self, coefficients: np.ndarray, cycle: float, hair: float = 0.0) -> np.ndarray:
        """Return by how many parts of the limit each coefficient or a difference from it passes one."""
        worst = np.zeros(len(coefficients))
        for order in range(3):
            low, high = self.bounds(order, cycle)
            values = np.diff(coefficients, order)
            beyond = np.maximum(values - high, low - values)
            worst[: len(beyond)] = np.maximum(worst[: len(beyond)], beyond)
        return worst


class _NoStep(Exception):
    """No command within the limits joins what is held."""


def keep_within(
    fit: Fit, rows: Rows, limits: DriveLimits, coefficients: np.ndarray, misses: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return coefficients and misses of the best command within the limits, from the best without."""
    layout = fit.drive.layout
    margin = max(int(np.ceil(_MARGIN / rows.cycle)), 2 * rows.degree)
    while True:
        over = limits.excess(coefficients, rows.cycle) > 0.0
        if not over.any():
            return coefficients, misses
        stretches = _stretches(over, margin, layout.count, layout.degree)
        for begin, end in stretches:
            of_drive = slice(begin, end + layout.degree)
            of_miss = slice(begin * layout.parts, end * layout.parts + 1)
            program = _Program(fit.part(begin, end), limits)
            try:
                c, d = program.solve(coefficients[of_drive], misses[of_miss])
            except _NoStep:
                if end - begin == layout.count:
                    raise
                continue
            coefficients[of_drive], misses[of_miss] = c, d
        margin *= 2


def _stretches(over: np.ndarray, margin: int, count: int, degree: int) -> list[tuple[int, int]]:
    """Return the intervals (begin, end) of the rows around coefficients that pass a limit."""
    wide = np.zeros(count + 1, dtype=int)
    for k in np.flatnonzero(over):
        wide[max(0, k - degree - margin)] += 1
        wide[min(count, k + 2 + margin)] -= 1
    inside = np.concatenate([[0], np.cumsum(wide[:-1]) > 0, [0]]).astype(int)
    change = np.diff(inside)
    return list(zip(np.flatnonzero(change == 1), np.flatnonzero(change == -1), strict=True))


@dataclass(frozen=True)
class _Program:
    fit: Fit
    limits: DriveLimits

    def solve(self, coefficients, misses):
        layout, cycle = self.fit.drive.layout, self.fit.drive.cycle
        # The first step leads to where the limits hold, whatever it costs.
        change = self.step(coefficients, misses, 0.0)
        coefficients = coefficients + change[layout.coefficient]
        misses = misses + change[layout.miss]
        return self.fit.solve(coefficients, misses, self.step)

    def step(self, coefficients, misses, damping):
        fit = self.fit
        layout, cycle = fit.drive.layout, fit.drive.cycle
        free = np.flatnonzero(fit.free)
        number = -np.ones(layout.size, dtype=int)
        number[free] = np.arange(len(free))
        band, gradient = fit.objective(coefficients, misses, damping)
        # objective
        diagonals = [band[k, : layout.size - k] for k in range(layout.width) if band[k].any()]
        offsets = [k for k in range(layout.width) if band[k].any()]
        lower = sparse.diags(
            diagonals, [-k for k in offsets], shape=(layout.size,) * 2, format="csc"
        )
        upper = lower.T.tocsc()[free][:, free]
        # equations
        rows = fit.drive.gradient(coefficients, misses)
        n, m, w = rows.shape
        columns = (np.arange(n) * layout.stride)[:, None, None] + np.arange(w)
        columns = np.broadcast_to(columns, rows.shape)
        index = np.broadcast_to(np.arange(n * m).reshape(n, m, 1), rows.shape)
        A = sparse.csr_matrix(
            (rows.ravel(), (index.ravel(), columns.ravel())), (n * m, layout.size)
        )
        A.eliminate_zeros()
        b = -fit.drive.defects(coefficients, misses).ravel()
        ends = sparse.lil_matrix((len(fit.conditions), layout.size))
        for i, condition in enumerate(fit.conditions):
            place = layout.coefficient[condition.first : condition.first + layout.degree + 1]
            ends[i, place] = condition.weights
            b = np.append(b, -condition.error(coefficients))
        A = sparse.vstack([A, ends]).tocsr()[:, free]
        keep = np.diff(A.indptr) > 0
        A, b = A[keep], b[keep]
        # limits
        G, low, high = [], [], []
        count = len(coefficients)
        for order in range(3):
            lo, hi = self.limits.bounds(order, cycle)
            if not np.isfinite([lo, hi]).any():
                continue
            D = sparse.eye(count, format="csr")
            for _ in range(order):
                D = D[1:] - D[:-1]
            now = D @ coefficients
            wide = sparse.csr_matrix((count, layout.size)).tolil()
            pick = sparse.csr_matrix(
                (np.ones(count), (np.arange(count), layout.coefficient)), (count, layout.size)
            )
            rows_ = (D @ pick)[:, free].tocsr()
            touched = np.diff(rows_.indptr) > 0
            hair = _HAIR * (1.0 if order == 0 else hi)
            G.append(rows_[touched])
            low.append((lo + hair - now)[touched])
            high.append((hi - hair - now)[touched])
        G, low, high = sparse.vstack(G), np.concatenate(low), np.concatenate(high)
        solver = piqp.SparseSolver()
        st = solver.settings
        st.eps_abs, st.eps_rel = 1e-9, 1e-10
        solver.setup(
            upper.tocsc(),
            gradient[free] / _UNIT,
            A.tocsc(),
            b / _UNIT,
            G.tocsc(),
            low / _UNIT,
            high / _UNIT,
        )
        status = solver.solve()
        if status != piqp.PIQP_SOLVED:
            raise _NoStep(status)
        step = np.zeros(layout.size)
        step[free] = _UNIT * solver.result.x
        return step
