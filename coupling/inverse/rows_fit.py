"""A command on the controller's rows: the spline under which a motor, or a rigid joint, misses least.

What a command gives too much, eta, moves the motor by  omega / (s + omega)  of its rate loop, omega =
(Kp + b) / J, times  (kff s + Kv) / (s + Kv)  of its position loop.  Rows follow what is slower than
they are, so that only what is faster decides between splines.  For that the second factor may forget
sooner: the squares of W eta with

    W(s) = omega (kff s + omega) / (s + omega)^2

are summed over dense times, which makes one matrix for all rows, a narrow band.  Where a joint is
rigid and follows its command at once, W is 1.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import ceil

import numpy as np
from scipy import sparse
from scipy.linalg import solveh_banded

from coupling.inverse.drive_limits import DriveLimits
from coupling.inverse.lag import lagged
from coupling.inverse.limited_fit import solve_program
from coupling.inverse.rows import CommandRows
from coupling.inverse.spline import UniformSpline, stencil
from elastic_robot.drive import Drive

# Longest distance of the dense times [s], and how many of them an interval has at least.
_DENSE, _LEAST = 2.5e-4, 8
# Dense times that are looked at at once.
_CHUNK = 50_000
# What W has forgotten: exp(-omega t) t [1].
_FORGOTTEN = 16.0
# Rows, by the degree, over which a spline forgets a coefficient that is not there.
_ALONE = 12
# Weight of eta itself, that no part of a command is without any.
_ITSELF = 1e-3


def dense_times(rows: CommandRows) -> np.ndarray:
    """Return the times at which a servo's command is wanted [s], (parts * rows.count + 1,)."""
    return rows.start + rows.cycle / _parts(rows) * np.arange(_parts(rows) * rows.count + 1)


def dense_chunks(rows: CommandRows) -> Iterator[tuple[slice, np.ndarray]]:
    """Yield the places of some `dense_times` among all and these times [s], (k,), few at once."""
    step, size = rows.cycle / _parts(rows), _parts(rows) * rows.count + 1
    for first in range(0, size, _CHUNK):
        numbers = np.arange(first, min(first + _CHUNK, size))
        yield slice(first, first + len(numbers)), rows.start + step * numbers


def _parts(rows: CommandRows) -> int:
    return max(_LEAST, ceil(rows.cycle / _DENSE - 1e-9))


def _lag(drive: Drive) -> float:
    """Return 1 / omega [s]."""
    return drive.inertia / (drive.rate_gain + drive.viscous)


@dataclass(frozen=True)
class RowsFit:
    """Fit of a command on rows, seen through a servo or as it is.

    Attributes:
        drive: The drive; None where the joint is at its command.
        rows: The controller's rows.
        desired: Command at the `dense_times` [rad], (n,).
        begins: q [rad], q' and maybe q'' of the motor at the first time, with which the command begins.
        ends: q' [rad/s] and maybe q'' of the motor at the last time, none where it is at rest.
    """

    drive: Drive | None
    rows: CommandRows
    desired: np.ndarray
    begins: tuple[float, ...]
    ends: tuple[float, ...] = ()

    @property
    def _pad(self) -> int:
        """Rows beside the command's first and last one, over which W forgets."""
        alone = _ALONE * self.rows.degree
        return (
            alone
            if self.drive is None
            else alone + ceil(_FORGOTTEN * _lag(self.drive) / self.rows.cycle)
        )

    def _weighted(self, values: np.ndarray) -> np.ndarray:
        """Return W of values at dense times, at rest with the first before it."""
        if self.drive is None:
            return values
        step, lag = self.rows.cycle / _parts(self.rows), _lag(self.drive)
        once = lagged(values, step, lag, values[0])
        kff = self.drive.feed_forward
        blended = kff * once + (1.0 - kff) * lagged(once, step, lag, once[0])
        return blended

    @cached_property
    def _basis(self) -> tuple[np.ndarray, np.ndarray]:
        """One B-spline and W of it at dense times from its beginning, until W forgets it, (n,) each."""
        degree, parts = self.rows.degree, _parts(self.rows)
        forgets = 0 if self.drive is None else self._pad
        size = (forgets + degree + 1) * parts
        coefficients = np.zeros((forgets + 2 * degree + 1, 1))
        coefficients[degree] = 1.0
        spline = UniformSpline(0.0, 1.0, coefficients, degree).at(np.arange(size) / parts)[:, 0]
        return spline, self._weighted(spline)

    @cached_property
    def _hessian(self) -> np.ndarray:
        """Diagonals of the matrix of a spline without ends, the middle one first [1], (w,)."""
        parts, size = _parts(self.rows), len(self._basis[0])
        spline, weighted = self._basis
        return np.array(
            [
                weighted[k:] @ weighted[: size - k] + _ITSELF**2 * (spline[k:] @ spline[: size - k])
                for k in range(0, size, parts)
            ]
        )

    def _right(self) -> np.ndarray:
        """Return the right-hand side [rad], for all rows and those beside them."""
        parts, (spline, weighted) = _parts(self.rows), self._basis
        step, pad = self.rows.cycle / parts, self._pad
        time = step * np.arange(1, 3 * pad * parts + 1)
        angle, rate, bend = (*self.begins, 0.0)[:3]
        past = -time[: 2 * pad * parts][::-1]
        before = angle + rate * past + 0.5 * bend * past**2
        rate, bend = (*self.ends, 0.0, 0.0)[:2]
        behind = self.desired[-1] + rate * time + 0.5 * bend * time**2
        values = np.concatenate([before, self.desired, behind])

        def seen_by(splines: np.ndarray, signal: np.ndarray) -> np.ndarray:
            return np.lib.stride_tricks.sliding_window_view(signal, len(splines))[::parts] @ splines

        right = seen_by(weighted, self._weighted(values))
        alone = seen_by(spline[: (self.rows.degree + 1) * parts], values)  # it is zero behind
        right += _ITSELF**2 * alone[: len(right)]
        # Coefficient m begins at row m - degree, here behind 2 pad others; the first one is m = -pad.
        first, count = pad - self.rows.degree, self.rows.coefficients + 2 * pad
        return right[first : first + count]

    @cached_property
    def _conditions(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows and values of what the command does at its ends, (c, coefficients), (c,) [rad]."""
        rows, size = self.rows, self.rows.coefficients
        conditions = [(0, order, value) for order, value in enumerate(self.begins)]
        conditions += [(1, order, 0.0) for order in rows.still(1)]
        matrix = np.zeros((len(conditions), size))
        for row, (side, order, _) in zip(matrix, conditions, strict=True):
            first = 0 if side == 0 else rows.count - 1
            weights = stencil(np.array([float(side)]), rows.degree, order)[0]
            row[first : first + rows.degree + 1] = weights
        return matrix, np.array([value * rows.cycle**order for _, order, value in conditions])

    def best(self, limits: DriveLimits) -> np.ndarray:
        """Return the coefficients of the best command within limits [rad], (coefficients,).

        Raises:
            NoCommandError: If none keeps to them.
        """
        pad, size = self._pad, self.rows.coefficients
        right, (conditions, values) = self._right(), self._conditions
        columns = np.zeros((len(right), len(values)))
        columns[pad : pad + size] = conditions.T
        band = np.repeat(self._hessian[:, None], len(right), axis=1)
        solved = solveh_banded(band, np.column_stack([right, columns]), lower=True)[
            pad : pad + size
        ]
        free, by_condition = solved[:, 0], solved[:, 1:]
        pull = np.linalg.solve(conditions @ by_condition, values - conditions @ free)
        best: np.ndarray = free + by_condition @ pull

        def solve(now: np.ndarray, begin: int, end: int) -> np.ndarray | None:
            return self._limited(limits, best, now, slice(begin, end + self.rows.degree))

        return limits.keep(best, self._spline, solve)

    def missed(self, coefficients: np.ndarray) -> np.ndarray:
        """Return W of what a command gives too much, at the dense times [rad], (n,)."""
        given, missed = self._spline(coefficients), -self.desired
        for here, times in dense_chunks(self.rows):
            missed[here] += given.at(times)[:, 0]
        return self._weighted(missed)

    def _limited(
        self, limits: DriveLimits, best: np.ndarray, now: np.ndarray, part: slice
    ) -> np.ndarray | None:
        """Return coefficients that are nearest to the best ones where those of a part may change.

        None where none of them keep to the limits.
        """
        size, diagonals = part.stop - part.start, self._hessian
        offsets = range(min(len(diagonals), size))
        upper = sparse.diags_array(
            [np.full(size - k, diagonals[k]) for k in offsets], offsets=offsets
        )
        around = np.append(diagonals[:0:-1], diagonals)
        gradient = np.convolve(now - best, around)[len(diagonals) - 1 :][part]
        conditions = sparse.csr_array(self._conditions[0][:, part])
        rows, low, high = limits.rows(self._spline(now))
        none = np.zeros(conditions.shape[0])
        change = solve_program(upper, gradient, conditions, none, (rows[:, part], low, high))
        if change is None:
            return None
        changed = now.copy()
        changed[part] += change
        return changed

    def _spline(self, coefficients: np.ndarray) -> UniformSpline:
        rows = self.rows
        return UniformSpline(rows.start, rows.cycle, coefficients[:, None], rows.degree)
