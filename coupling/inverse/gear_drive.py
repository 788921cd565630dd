"""A link behind its gear: by how much it misses its motion under a command."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.inverse.rows import Layout, Rows
from coupling.inverse.spline import UniformSpline, stencil
from elastic_robot.torque_curves import TorqueCurve

# Where the slope of the curve changes within half a step, the torque is integrated over so many points.
FINE_POINTS = 32

_SIMPSON = np.array([1.0, 4.0, 1.0]) / 6.0
_QUARTERS = 0.25 * np.arange(5)


@dataclass(frozen=True)
class GearTask:
    """What a gear has to carry so that its link moves as wanted.

    Attributes:
        link: Angle phi of the link over time [rad], one column.
        time: Even fine times [s], (k,).
        torque: T that the gear has to carry there [N m], (k,).
        twist: e0 = phi - q there that carries it: d e0' + S(e0) = T [rad], (k,).
        curve: S, of this gear alone.
        damping: d [N m s/rad], >= 0.
        inertia: M against which an error of the torque works there [kg m^2], (k,): 1 / (M^-1)_gg of
            the robot's mass matrix, the other coordinates free to yield as they are for what is
            faster than the robot's modes.
    """

    link: UniformSpline
    time: np.ndarray
    torque: np.ndarray
    twist: np.ndarray
    curve: TorqueCurve
    damping: float
    inertia: np.ndarray


@dataclass(frozen=True)
class GearDrive:
    """The scalar robot of one gear,  M delta'' + d x' + S(x) = T  with twist  x = phi - q + delta.

    In steps of length h, the miss delta straight between the nodes: the momentum that the gear gives
    to the link from the middle of a step to the middle of the next is that which moves it,

        M (delta[n+1] - delta[n]) / h - M (delta[n] - delta[n-1]) / h + integral of d x' + S(x) - T = 0 .

    Nothing is sampled: what counts between two middles is the impulse alone.

    Attributes:
        layout: Order of the unknowns.
        start: First time [s].
        cycle: Distance of the rows [s].
        first: Whether the path begins here.
        task: The gear and its link.
        link: phi at the quarters of the steps [rad].
        bend: phi'' where the coefficients of the command's acceleration stand [rad/s^2].
        impulse: Integral of T over half steps [N m s].
        inertia: M of each step [kg m^2].
        link_rate: phi' at the first time [rad/s].
    """

    layout: Layout
    start: float
    cycle: float
    first: bool
    task: GearTask
    link: np.ndarray
    bend: np.ndarray
    impulse: np.ndarray
    inertia: np.ndarray
    link_rate: float

    @classmethod
    def of(cls, task: GearTask, rows: Rows) -> GearDrive:
        """Return the drive of a gear along all rows."""
        layout = Layout.of(rows)
        step = rows.cycle / layout.parts
        quarters = rows.start + 0.25 * step * np.arange(4 * layout.nodes - 3)
        halves = quarters[::2]
        inside = np.clip(halves, task.time[0], task.time[-1])
        beyond = task.torque[-1] * (halves - inside)
        impulse = np.diff(CubicSpline(task.time, task.torque).antiderivative()(inside) + beyond)
        middles = halves[1::2]
        # No step can follow what is faster than it: a light link is taken for one that it can.
        lightest = (0.5 * step) ** 2 * float(task.curve.flank_slope(np.zeros(1))[0])
        inertia = np.maximum(np.interp(middles, task.time, task.inertia), lightest)
        return cls(
            layout,
            rows.start,
            rows.cycle,
            True,
            task,
            _values(task.link, quarters),
            wanted_bend(task.link, rows),
            impulse,
            inertia,
            float(_values(task.link, quarters[:1], 1)[0]),
        )

    def part(self, begin: int, end: int) -> GearDrive:
        """Return the drive along the intervals begin to end of the rows."""
        parts, degree = self.layout.parts, self.layout.degree
        a, b = begin * parts, end * parts
        return replace(
            self,
            layout=replace(self.layout, count=end - begin),
            start=self.start + begin * self.cycle,
            first=self.first and begin == 0,
            link=self.link[4 * a : 4 * b + 1],
            bend=self.bend[begin : end + degree - 2],
            impulse=self.impulse[2 * a : 2 * b],
            inertia=self.inertia[a:b],
        )

    @property
    def step(self) -> float:
        """Distance of the nodes [s]."""
        return self.cycle / self.layout.parts

    @cached_property
    def scale(self) -> np.ndarray:
        """Angle that an impulse is worth [rad/(N m s)], by step."""
        stiffness = float(self.task.curve.flank_slope(np.zeros(1))[0])
        return 1.0 / (self.inertia / self.step + self.task.damping + stiffness * self.step)

    @cached_property
    def _value(self) -> np.ndarray:
        """Weights of an interval's coefficients at the quarters of its steps, (parts, 5, degree + 1)."""
        parts = self.layout.parts
        place = (np.arange(parts)[:, None] + _QUARTERS) / parts
        return stencil(place, self.layout.degree, 0)

    @cached_property
    def _fine(self) -> tuple[np.ndarray, np.ndarray]:
        """Points in the halves of a step (2, points), and the coefficients' weights there."""
        parts = self.layout.parts
        inner = (np.arange(FINE_POINTS) + 0.5) / FINE_POINTS
        place = 0.5 * (np.arange(2)[:, None] + inner)
        weights = stencil((np.arange(parts)[:, None, None] + place) / parts, self.layout.degree, 0)
        return place, weights

    @cached_property
    def _start_row(self) -> np.ndarray:
        return stencil(np.zeros(1), self.layout.degree, 1)[0] / self.cycle

    def defects(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return by how much the equation is missed from every node on, as an angle [rad], (n, parts)."""
        _, halves, _, _ = self._halves(coefficients, misses)
        momentum = self.inertia / self.step * np.diff(misses)
        impulse = momentum + halves[..., 0].ravel()
        impulse[1:] += halves[..., 1].ravel()[:-1] - momentum[:-1]
        if self.first:
            # It starts in equilibrium with its twist at rest, so delta' = q' - phi'.
            rate = self._start_row @ coefficients[: self.layout.degree + 1] - self.link_rate
            impulse[0] -= self.inertia[0] * rate
        else:
            impulse[0] = 0.0  # the step before is not here
        return (self.scale * impulse).reshape(-1, self.layout.parts)

    def _halves(self, coefficients: np.ndarray, misses: np.ndarray):  # type: ignore[no-untyped-def]
        """Return what integrals over half steps need: slopes, impulse errors, the fine places and slopes."""
        n, m, k = self.layout.count, self.layout.parts, self.layout.degree
        task = self.task
        local = np.lib.stride_tricks.sliding_window_view(coefficients, k + 1)
        drive = (local @ self._value.reshape(-1, k + 1).T).reshape(n, m, 5)
        before, after = misses[:-1].reshape(n, m, 1), misses[1:].reshape(n, m, 1)
        link = np.lib.stride_tricks.sliding_window_view(self.link, 5)[::4].reshape(n, m, 5)
        twist = link - drive + before + (after - before) * _QUARTERS
        torque, slope = task.curve.torque(twist), task.curve.slope(twist)
        half = 0.5 * self.step
        error = half * np.stack([torque[..., :3] @ _SIMPSON, torque[..., 2:] @ _SIMPSON], axis=-1)
        bends = np.stack(
            [
                (slope[..., 0] != slope[..., 1]) | (slope[..., 1] != slope[..., 2]),
                (slope[..., 2] != slope[..., 3]) | (slope[..., 3] != slope[..., 4]),
            ],
            axis=-1,
        )
        where = np.nonzero(bends)
        i, j, side = where
        places, weights = self._fine
        right, basis = places[side], weights[j, side]
        times = self.start + ((i * m + j)[:, None] + right) * self.step
        fine = _values(task.link, times.ravel()).reshape(times.shape)
        fine -= np.einsum("pfk,pk->pf", basis, local[i])
        fine += before[i, j] + (after - before)[i, j] * right
        error[where] = half / FINE_POINTS * task.curve.torque(fine).sum(axis=1)
        error += task.damping * np.diff(twist[..., ::2], axis=-1)
        error -= self.impulse.reshape(n, m, 2)
        return slope, error, where, half / FINE_POINTS * task.curve.slope(fine)

    def gradient(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return the derivatives of `defects` by the unknowns of their blocks, (n, parts, width)."""
        layout, d = self.layout, self.task.damping
        n, m, k = layout.count, layout.parts, layout.degree
        slope, _, where, fine = self._halves(coefficients, misses)
        half = 0.5 * self.step
        weighted = half * np.stack([slope[..., :3] * _SIMPSON, slope[..., 2:] * _SIMPSON], axis=2)
        hats = np.stack([_QUARTERS[:3], _QUARTERS[2:]])
        spots = np.stack([self._value[:, :3], self._value[:, 2:]], axis=1)
        total, after = weighted.sum(axis=-1), (weighted * hats).sum(axis=-1)
        by_drive = -np.einsum("nmhp,mhpk->nmhk", weighted, spots, optimize=True)
        places, weights = self._fine
        total[where] = fine.sum(axis=1)
        after[where] = (fine * places[where[2]]).sum(axis=1)
        by_drive[where] = -np.einsum("pf,pfk->pk", fine, weights[where[1:]])
        by_drive -= d * np.diff(self._value[:, ::2], axis=1)
        by_miss = np.stack([total - after - 0.5 * d, after + 0.5 * d], axis=-1)
        rows = np.zeros((n, m, layout.width))
        of_drive, of_miss = layout.block_coefficient, layout.block_miss
        rows[:, :, of_drive[1:]] += by_drive[:, :, 0]
        rows[:, 1:, of_drive[1:]] += by_drive[:, :-1, 1]
        rows[1:, 0, of_drive[:-1]] += by_drive[:-1, -1, 1]
        g = self.inertia / self.step
        flat = by_miss.reshape(n * m, 2, 2)
        now = np.stack([flat[:, 0, 0] - g, flat[:, 0, 1] + g], axis=-1)
        before = np.zeros((n * m, 2))
        before[1:, 0] = flat[:-1, 1, 0] + g[:-1]
        before[1:, 1] = flat[:-1, 1, 1] - g[:-1]
        now, before = now.reshape(n, m, 2), before.reshape(n, m, 2)
        for j in range(m):
            rows[:, j, of_miss[j : j + 2]] += before[:, j]
            rows[:, j, of_miss[j + 1 : j + 3]] += now[:, j]
        if self.first:
            rows[0, 0, of_drive[1:]] -= self.inertia[0] * self._start_row
        else:
            rows[0, 0] = 0.0
        rows *= self.scale.reshape(n, m, 1)
        return rows


def wanted_bend(link: UniformSpline, rows: Rows) -> np.ndarray:
    """Return phi'' at the averages of the knots of each coefficient of the command's acceleration."""
    spots = rows.start + rows.cycle * (np.arange(rows.coefficients - 2) - 0.5 * (rows.degree - 3))
    return _values(link, np.clip(spots, rows.start, rows.end), 2)


def _values(spline: UniformSpline, times: np.ndarray, order: int = 0) -> np.ndarray:
    values: np.ndarray = spline.at(times, order)[:, 0]
    return values
