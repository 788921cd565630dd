"""Least squares over a command's coefficients and the misses of its link: a band, by damped steps."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from coupling.inverse.gear_drive import DriveStruct, GearDrive
from coupling.inverse.rows import CommandRows, Layout, stretches
from coupling.inverse.spline import UniformSpline, stencil
from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, finite_numbers

# Acceleration of the command beyond that of the link, against the miss: (0.1 ms)^2, so that
# 10 rad/s^2 weigh like 0.1 microrad.  It keeps a command from ringing between its rows.
SMOOTHING = 1e-8

# Weights of equations in the normal equations, and in the value that a step must lower: there only so
# much that they count before the objective, lest rounding at the edges of a backlash decides.
_HEAVY = 1e4
_COUNTED = 1e2

# A gear without damper does not feel its drive within the backlash: a step changes nothing there that
# it need not, weighted by this square.
_IDLE = 1e-7

# Intervals between rows within which changes die out, at first.
_LAG = 256
# er_solved of desk/drive_fit.h.
_NOT_POSITIVE, _NO_MEMORY = 1, 2
_BEND = np.array([1.0, -2.0, 1.0])
_MOST_DAMPED = 1e6
_ITERATIONS = 40
# Where a step raises the value by less of it, the value stands at its least but for rounding.
_ROUNDING = 1e-7
# Largest change that is none [rad]: where the last step changed so little, the next one changes nothing.
# Intervals beside others in which it does.
_STILL, _BESIDE = 1e-13, 16


class _Fit(ctypes.Structure):
    """er_drive_fit of desk/drive_fit.h."""

    _fields_ = (
        ("drive", DriveStruct),
        *((n, ctypes.c_double) for n in ["cycle", "smoothing", "heavy", "counted", "idle"]),
        ("bend", ctypes.c_void_p),
        ("conditions", ctypes.c_int64),
        *((f"condition_{n}", ctypes.c_void_p) for n in ("first", "weights", "value")),
    )


@dataclass(frozen=True)
class EndCondition:
    """A derivative of the command at an end: weights @ coefficients[first :] = value.

    Attributes:
        first: Number of the first coefficient.
        weights: Weights of the coefficients, by the cycle where it is a derivative, (degree + 1,).
        value: Value of the derivative, by the cycle [rad].
    """

    first: int
    weights: np.ndarray
    value: float

    def error(self, coefficients: np.ndarray) -> float:
        """Return by how much coefficients (n,) miss the condition [rad]."""
        there = coefficients[self.first : self.first + len(self.weights)]
        return float(self.weights @ there - self.value)


def end_conditions(rows: CommandRows, start: float) -> list[EndCondition]:
    """Return the conditions of a command that starts at an angle [rad] and rests as its path does."""

    def at(side: int, order: int, value: float) -> EndCondition:
        first = 0 if side == 0 else rows.count - 1
        return EndCondition(first, stencil(np.array([float(side)]), rows.degree, order)[0], value)

    still = [at(side, order, 0.0) for side in (0, 1) for order in rows.still(side)]
    return [at(0, 0, start), *still]


@dataclass(frozen=True)
class SplineFit:
    """The sum of  delta^2 + (SMOOTHING (q'' - phi''))^2  over nodes and rows, under a drive's equations.

    Attributes:
        drive: Equations between command and miss.
        conditions: Conditions of the path's ends that are here.
        free: Mask of unknowns that may change, (size,).
    """

    drive: GearDrive
    conditions: list[EndCondition]
    free: np.ndarray

    @classmethod
    def whole(cls, drive: GearDrive, conditions: list[EndCondition]) -> SplineFit:
        """Return the fit of a whole path: all may change but the first miss, which is none."""
        layout = drive.layout
        free = np.zeros(layout.size, dtype=bool)
        free[layout.coefficient] = True
        free[layout.miss[1:]] = True
        return cls(drive, conditions, free)

    def part(self, begin: int, end: int) -> SplineFit:
        """Return the fit of the intervals begin to end of the rows, what meets others held."""
        layout = self.drive.layout
        drive = self.drive.part(begin, end)
        inner = drive.layout
        degree = layout.degree
        left, right = begin > 0, end < layout.count
        free = np.zeros(inner.size, dtype=bool)
        coefficients = slice(degree + 1 if left else 0, inner.count - 1 if right else None)
        misses = slice(2 if left else 1, inner.nodes - 2 if right else None)
        free[inner.coefficient[coefficients]] = True
        free[inner.miss[misses]] = True
        here = [
            replace(c, first=c.first - begin)
            for c in self.conditions
            if begin <= c.first and c.first + 1 <= end
        ]
        return SplineFit(drive, here, free)

    def command(self, coefficients: np.ndarray) -> UniformSpline:
        """Return the command of coefficients [rad], (n,), from time 0 here."""
        return UniformSpline(0.0, self.drive.cycle, coefficients[:, None], self.drive.layout.degree)

    @cached_property
    def _arrays(self) -> list[np.ndarray]:
        """The arrays that C reads, in its order; they stay as long as the fit."""
        layout, ends = self.drive.layout, self.conditions
        weights = np.array([end.weights for end in ends]).reshape(len(ends), layout.degree + 1)
        values = np.array([end.value for end in ends])
        return [
            finite_numbers("bends", self.drive.bend, (layout.count + layout.degree - 2,)),
            np.array([end.first for end in ends], dtype=np.int64),
            finite_numbers("conditions", weights, weights.shape),
            finite_numbers("conditions", values, values.shape),
        ]

    @cached_property
    def _struct(self) -> _Fit:
        bend, *ends = map(address, self._arrays)
        weights = self.drive.cycle, SMOOTHING, _HEAVY, _COUNTED, _IDLE
        return _Fit(self.drive.struct, *weights, bend, len(self.conditions), *ends)

    @property
    def whole_stretch(self) -> np.ndarray:
        """Numbers of the first interval between rows and of that behind the last one, (1, 2)."""
        return np.array([[0, self.drive.layout.count]])

    @cached_property
    def _bend_weights(self) -> np.ndarray:
        return SMOOTHING / self.drive.cycle**2 * _BEND

    def _bends(self, coefficients: np.ndarray) -> np.ndarray:
        return SMOOTHING * (np.diff(coefficients, 2) / self.drive.cycle**2 - self.drive.bend)

    def value(self, coefficients: np.ndarray, misses: np.ndarray, changing: np.ndarray) -> float:
        """Return half the sum of squares, equations included, in stretches [rad^2].

        Args:
            coefficients, misses: Unknowns [rad], (n,) and (nodes,).
            changing: Numbers of intervals, begin and end of each stretch, (k, 2).
        """
        value, ranges = loaded_library().er_drive_fit_value, self._ranges(changing)
        unknowns = self.drive.unknowns(coefficients, misses)
        count = ctypes.c_int64(len(ranges))
        return float(value(ctypes.byref(self._struct), count, *map(address, (ranges, *unknowns))))

    def _ranges(self, changing: np.ndarray) -> np.ndarray:
        ranges = np.ascontiguousarray(changing, dtype=np.int64).reshape(-1, 2)
        order = np.concatenate([[0], ranges.ravel(), [self.drive.layout.count]])
        if (np.diff(order) < 0).any():
            raise ValueError(f"expected rising stretches of the rows, got {ranges.tolist()}")
        return ranges

    def objective(
        self, coefficients: np.ndarray, misses: np.ndarray, damping: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return Hessian, lower diagonals (width, size), and gradient [rad], (size,); no equations."""
        layout = self.drive.layout
        band, gradient = np.zeros((layout.width, layout.size)), np.zeros(layout.size)
        band[0, layout.miss] = 1.0
        gradient[layout.miss] = misses
        for weight in (1.0, damping):
            _add_bends(band, layout, weight * self._bend_weights)
        bends, place = self._bends(coefficients), layout.coefficient
        for a, weight in enumerate(self._bend_weights):
            gradient[place[a : a + len(bends)]] += weight * bends
        return band, gradient

    def band_step(
        self, coefficients: np.ndarray, misses: np.ndarray, damping: float, changing: np.ndarray
    ) -> np.ndarray:
        """Return the step of all unknowns [rad], (size,), that solves the linearised least squares.

        Args:
            coefficients, misses: Start of the step [rad], (n,) and (nodes,).
            damping: Weight of the change of the command's bends.
            changing: Numbers of intervals, begin and end of each stretch; elsewhere nothing changes,
                (k, 2).

        Raises:
            LinAlgError: If the matrix is not positive definite.
            MemoryError: If a part of it does not fit into memory.
        """
        ranges, unknowns = self._ranges(changing), self.drive.unknowns(coefficients, misses)
        step = np.empty(self.drive.layout.size)
        solved = loaded_library().er_drive_fit_step(
            ctypes.byref(self._struct),
            ctypes.c_int64(len(ranges)),
            *map(address, (ranges, *unknowns)),
            ctypes.c_double(damping),
            ctypes.c_int64(_LAG),
            address(step),
        )
        if solved == _NOT_POSITIVE:
            raise np.linalg.LinAlgError("the equations of a drive are not positive definite")
        if solved == _NO_MEMORY:
            raise MemoryError("the equations of a drive do not fit into memory")
        return step

    def equations(
        self, coefficients: np.ndarray, misses: np.ndarray
    ) -> tuple[sparse.csr_array, np.ndarray]:
        """Return the matrix of all equations, end conditions last, (e, size), and errors [rad], (e,)."""
        layout = self.drive.layout
        blocks = self.drive.gradient(coefficients, misses)
        row, column = np.nonzero(blocks.reshape(-1, layout.width))
        entries = [blocks.reshape(-1, layout.width)[row, column]]
        columns = [row // layout.parts * layout.stride + column]
        rows, count = [row], layout.count * layout.parts
        for k, condition in enumerate(self.conditions):
            columns.append(layout.coefficient[condition.first :][: layout.degree + 1])
            rows.append(np.full(layout.degree + 1, count + k))
            entries.append(condition.weights)
        shape = (count + len(self.conditions), layout.size)
        place = np.concatenate(rows), np.concatenate(columns)
        equations = sparse.csr_array((np.concatenate(entries), place), shape=shape)
        equations.eliminate_zeros()
        errors = [condition.error(coefficients) for condition in self.conditions]
        return equations, np.append(self.drive.defects(coefficients, misses), errors)

    def along(self, coefficients: np.ndarray, misses: np.ndarray) -> SplineFit:
        """Return the fit about a motion [rad], (n,), (nodes,): itself where its drive keeps none."""
        drive = self.drive.along(coefficients, misses)
        return self if drive is self.drive else replace(self, drive=drive)

    def solve(self, coefficients: np.ndarray, misses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return coefficients (n,) and misses (nodes,) [rad] of the best command, from a start."""
        return self.descend(coefficients, misses, SplineFit.band_step, SplineFit.changing)

    def changing(self, change: np.ndarray, about: SplineFit) -> np.ndarray:
        """Return in which stretches the next step changes something: numbers of intervals, (k, 2).

        Args:
            change: Last step of all unknowns [rad], (size,).
            about: The fit about the motion behind that step.
        """
        layout = self.drive.layout
        moves = np.zeros(layout.count + layout.degree, dtype=bool)
        moves[np.flatnonzero(np.abs(change[layout.stride :]) > _STILL) // layout.stride] = True
        moves[layout.degree // 2 :][: layout.count] |= self.drive.torque_changes(
            about.drive, _STILL
        )
        return stretches(moves, _BESIDE, layout.count, layout.degree)

    def descend(
        self,
        coefficients: np.ndarray,
        misses: np.ndarray,
        step: Callable[[SplineFit, np.ndarray, np.ndarray, float, np.ndarray], np.ndarray],
        changing: Callable[[SplineFit, np.ndarray, SplineFit], np.ndarray],
    ) -> tuple[np.ndarray, np.ndarray]:
        """Go down by steps, damped where the torque curve bends away from them.

        Each step is taken about the motion before it, and what elements of a hysteresis then do changes
        the value once more.

        Args:
            coefficients, misses: A start that is feasible for `step` [rad], (n,) and (nodes,).
            step: Function that gives a step of all unknowns from fit, coefficients, misses, damping and
                the stretches that change.
            changing: Function that gives these from a fit, the step taken and the fit behind it.
        """
        layout, where = self.drive.layout, self.whole_stretch
        fit, damping = self.along(coefficients, misses), 0.0
        best = before = fit.value(coefficients, misses, where)
        for _ in range(_ITERATIONS):
            change = step(fit, coefficients, misses, damping, where)
            trial = coefficients + change[layout.coefficient], misses + change[layout.miss]
            gain = before - fit.value(*trial, where)
            if gain > 0.0:
                (coefficients, misses), best = trial, best - gain
                damping = damping / 3.0 if damping > 1.0 else 0.0
                about = self.along(coefficients, misses)
                where = changing(fit, change, about)
                if about is not fit:
                    promised, best = best, about.value(coefficients, misses, self.whole_stretch)
                    gain = max(gain, abs(best - promised))
                if gain < 1e-3 * best:
                    break
                fit, before = about, about.value(coefficients, misses, where)
            elif -gain <= _ROUNDING * best:
                break
            else:
                damping = max(2.0, 5.0 * damping)
                if damping > _MOST_DAMPED:
                    break
        return coefficients, misses


def _add_bends(band: np.ndarray, layout: Layout, weights: np.ndarray) -> None:
    """Add the normal equations of the weighted second differences of the coefficients."""
    count = layout.count + layout.degree - 2
    for a in range(3):
        for b in range(a + 1):
            place = layout.coefficient[b : b + count]
            band[(a - b) * layout.stride, place] += weights[a] * weights[b]
