"""A link behind its gear: by how much it misses its motion under a command."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.inverse.gear_elements import NO_ELEMENTS, GearElements
from coupling.inverse.rows import CommandRows, Layout
from coupling.inverse.spline import UniformSpline, stencil
from elastic_robot.kinematic_errors import NO_ERRORS, KinematicErrors
from elastic_robot.torque_curves import TorqueCurve

# The wind-up is known at the quarters of a step.  Over each half: its mean by Simpson's rule, its rise,
# and, where the slope of the torque curve changes, the polynomial through them at many points.
_QUARTERS = 0.25 * np.arange(5)
_SIMPSON = np.array([[1.0, 4.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 4.0, 1.0]]) / 6.0
_RISE = np.array([[-1.0, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0, 1.0]])
_FINE = np.array(
    [
        np.linalg.solve(np.vander(_QUARTERS, 5).T, np.vander(places, 5).T).T
        for places in np.split((np.arange(32) + 0.5) / 32, 2)
    ]
)


@dataclass(frozen=True)
class GearTask:
    """Loads of a gear under which its link moves as wanted.

    Attributes:
        link: Angle phi of the link over time [rad], one column.
        time: Even fine times [s], (k,).
        torque: T that the gear has to carry there [N m], (k,).
        wind_up: e0 = phi - u(q) there that carries it: d e0' + S(e0) = T [rad], (k,).
        curve: S, of this gear alone.
        damping: d [N m s/rad], >= 0.
        inertia: M against which an error of the torque works there [kg m^2], (k,): 1 / (M^-1)_gg of
            the robot's mass matrix, the other coordinates free to yield as they are for what is
            faster than the robot's modes.
        elements: Elements of the gear's hysteresis, which come to e0 from unloaded.
        errors: Its kinematic error, by which its output is at u(q).
    """

    link: UniformSpline
    time: np.ndarray
    torque: np.ndarray
    wind_up: np.ndarray
    curve: TorqueCurve
    damping: float
    inertia: np.ndarray
    elements: GearElements = NO_ELEMENTS
    errors: KinematicErrors = NO_ERRORS

    @property
    def stiffness(self) -> float:
        """Largest stiffness [N m/rad]: on a flank, its elements sticking."""
        flank = float(self.curve.flank_slope(np.zeros(1))[0])
        return flank + float(self.elements.stiffness.sum())


@dataclass(frozen=True)
class Memory:
    """What the elements of a gear do along a motion, and about it, as far as they go on as they did.

    Attributes:
        wind_up: x at the quarters of the steps [rad], (n, parts, 5).
        impulse: Integral of the elements' torque over half steps [N m s], (n, parts, 2).
        by_wind_up: Its derivatives by x at the quarters [N m s/rad], (n, parts, 2, 5).
        elongation: Elongations at the nodes but the last [rad], (n, parts, e).
    """

    wind_up: np.ndarray
    impulse: np.ndarray
    by_wind_up: np.ndarray
    elongation: np.ndarray

    def about(self, wind_up: np.ndarray) -> np.ndarray:
        """Return the integrals over half steps near the motion [N m s], (n, parts, 2).

        Args:
            wind_up: At the quarters of the steps [rad], (n, parts, 5).
        """
        change: np.ndarray = (self.by_wind_up @ (wind_up - self.wind_up)[..., None])[..., 0]
        return self.impulse + change

    def part(self, begin: int, end: int) -> Memory:
        """Return what they do along the intervals begin to end of the rows."""
        here = slice(begin, end)
        return Memory(
            self.wind_up[here], self.impulse[here], self.by_wind_up[here], self.elongation[here]
        )


@dataclass(frozen=True)
class GearDrive:
    """The scalar robot of one gear,  M delta'' + d x' + S(x) = T  with wind-up  x = phi - u(q) + delta.

    In steps of length h, the miss delta straight between the nodes: the momentum that the gear gives
    to the link from the middle of a step to the middle of the next is that which moves it,

        M (delta[n+1] - delta[n]) / h - M (delta[n] - delta[n-1]) / h + integral of d x' + S(x) - T = 0 .

    Nothing is sampled: what counts between two middles is the impulse alone.  The torque of the elements
    of a hysteresis is beside S(x) that about a known motion.

    Attributes:
        layout: Order of the unknowns.
        start: First time [s].
        cycle: Distance of the rows [s].
        first: Whether the path begins here.
        task: The gear and its link.
        link: phi at the quarters of the steps [rad], (4 n + 1,).
        bend: phi'' where the coefficients of the command's acceleration stand [rad/s^2], (c,).
        impulse: Integral of T over half steps [N m s], (2 n,).
        inertia: M of each of n steps [kg m^2], (n,).
        link_rate: phi' at the first time [rad/s].
        memory: What the gear's elements do along the motion of `along`; None without any.
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
    memory: Memory | None = None

    @classmethod
    def of(cls, task: GearTask, rows: CommandRows) -> GearDrive:
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
        lightest = (0.5 * step) ** 2 * task.stiffness
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
            memory=self.memory and self.memory.part(begin, end),
        )

    def along(self, coefficients: np.ndarray, misses: np.ndarray) -> GearDrive:
        """Return the drive with what its elements do along a motion; as it is without any.

        Args:
            coefficients: Coefficients of the command [rad], (count + degree,).
            misses: At the nodes [rad], (nodes,).
        """
        elements = self.task.elements
        if not elements.count:
            return self
        wind_up = self._wind_ups(coefficients, misses)
        n, parts, _ = wind_up.shape
        fine = np.einsum("npq,hfq->nphf", wind_up, _FINE).reshape(n, parts, -1)
        path = np.concatenate([wind_up[..., :1], fine], axis=2)
        a, before = elements.slip_angle, self.memory
        start = np.clip(path[0, 0, 0], -a, a) if before is None else before.elongation[0, 0]
        elongation = elements.along(path.ravel(), start).reshape(*path.shape, -1)
        inside = elongation[:, :, 1:].reshape(n, parts, 2, -1, elements.count)
        half, share = 0.5 * self.step, 1.0 / inside.shape[3]
        slope = half * share * elements.slope(inside)
        memory = Memory(
            wind_up,
            half * elements.torque(inside).mean(axis=-1),
            np.einsum("nphf,hfq->nphq", slope, _FINE),
            elongation[:, :, 0],
        )
        return replace(self, memory=memory)

    @property
    def step(self) -> float:
        """Distance of the nodes [s]."""
        return self.cycle / self.layout.parts

    @cached_property
    def scale(self) -> np.ndarray:
        """Angle that an impulse is worth [rad/(N m s)], by step, (n,)."""
        stiffness = self.task.stiffness * self.step
        return 1.0 / (self.inertia / self.step + self.task.damping + stiffness)

    @cached_property
    def _value(self) -> np.ndarray:
        """Weights of an interval's coefficients at the quarters of its steps, (parts, 5, degree + 1)."""
        parts = self.layout.parts
        place = (np.arange(parts)[:, None] + _QUARTERS) / parts
        return stencil(place, self.layout.degree, 0)

    @cached_property
    def _start_row(self) -> np.ndarray:
        return stencil(np.zeros(1), self.layout.degree, 1)[0] / self.cycle

    def defects(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return by how much the equation is missed at every node but the last, as angles [rad].

        Args:
            coefficients: Coefficients of the command [rad], (count + degree,).
            misses: At the nodes [rad], (nodes,).

        Returns:
            (count, parts).
        """
        halves = self._impulses(coefficients, misses)
        momentum = self.inertia / self.step * np.diff(misses)
        impulse = momentum + halves[..., 0].ravel()
        impulse[1:] += halves[..., 1].ravel()[:-1] - momentum[:-1]
        if self.first:
            # It starts in equilibrium with its wind-up at rest, so delta' = u' - phi'.
            impulse[0] -= self.inertia[0] * (self._start(coefficients)[0] - self.link_rate)
        else:
            impulse[0] = 0.0  # the step before is not here
        return (self.scale * impulse).reshape(-1, self.layout.parts)

    def _wind_ups(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return x at the quarters of the steps, (n, parts, 5)."""
        shape = self.layout.count, self.layout.parts, 5
        drive = self._drive(coefficients)
        link = np.lib.stride_tricks.sliding_window_view(self.link, 5)[::4]
        miss = misses[:-1, None] + np.diff(misses)[:, None] * _QUARTERS
        outputs = self.task.errors.output_angle(drive[..., None])[..., 0]
        wind_ups: np.ndarray = (link + miss).reshape(shape) - outputs
        return wind_ups

    def _drive(self, coefficients: np.ndarray) -> np.ndarray:
        """Return q at the quarters of the steps, (n, parts, 5)."""
        local = np.lib.stride_tricks.sliding_window_view(coefficients, self.layout.degree + 1)
        local = np.ascontiguousarray(local)  # products of rows that overlap are not BLAS's
        drive = local @ self._value.reshape(-1, self.layout.degree + 1).T
        return drive.reshape(self.layout.count, self.layout.parts, 5)

    def _start(self, coefficients: np.ndarray) -> tuple[float, np.ndarray]:
        """Return u' at the first time [rad/s] and its derivatives by the first coefficients [1/s]."""
        first = coefficients[: self.layout.degree + 1]
        q, rate = self._value[0, 0] @ first, self._start_row @ first
        _, slope, bend, _ = self.task.errors.derivatives(np.array([q]))[:, 0]
        by = (1.0 + slope) * self._start_row + bend * rate * self._value[0, 0]
        return float((1.0 + slope) * rate), by

    def _impulses(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return the integrals of d x' + S(x) - T over half steps [N m s], (n, parts, 2)."""
        curve, half = self.task.curve, 0.5 * self.step
        wind_up = self._wind_ups(coefficients, misses)
        impulse = half * curve.torque(wind_up) @ _SIMPSON.T
        bends = _bends(curve.slope(wind_up))
        fine = np.einsum("bp,bfp->bf", wind_up[bends[:2]], _FINE[bends[2]])
        impulse[bends] = half * curve.torque(fine).mean(axis=1)
        impulse += self.task.damping * np.diff(wind_up[..., ::2], axis=-1)
        impulse -= self.impulse.reshape(impulse.shape)
        return impulse if self.memory is None else impulse + self.memory.about(wind_up)

    def _by_wind_up(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return the derivatives of `_impulses` by the wind_ups at the quarters, (n, parts, 2, 5)."""
        curve, half = self.task.curve, 0.5 * self.step
        wind_up = self._wind_ups(coefficients, misses)
        slope = curve.slope(wind_up)
        by_wind_up = half * slope[:, :, None] * _SIMPSON
        bends = _bends(slope)
        places = _FINE[bends[2]]
        fine = curve.slope(np.einsum("bp,bfp->bf", wind_up[bends[:2]], places))
        by_wind_up[bends] = half / _FINE.shape[1] * np.einsum("bf,bfp->bp", fine, places)
        by_wind_up += self.task.damping * _RISE
        return by_wind_up if self.memory is None else by_wind_up + self.memory.by_wind_up

    def gradient(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return the derivatives of `defects` by their blocks' unknowns [rad/rad], (n, parts, width)."""
        layout = self.layout
        n, m, k = layout.count, layout.parts, layout.degree
        by_wind_up = self._by_wind_up(coefficients, misses)
        by_drive = np.empty((n, m, 2, k + 1))
        rise = self.task.errors.slope(self._drive(coefficients)[..., None])[..., 0]
        by_quarter = by_wind_up * rise[:, :, None]
        for j in range(m):
            by_drive[:, j] = -(by_quarter[:, j].reshape(-1, 5) @ self._value[j]).reshape(
                n, 2, k + 1
            )
        by_miss = by_wind_up @ np.stack([1.0 - _QUARTERS, _QUARTERS], axis=-1)
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
        for j in range(m):
            rows[:, j, of_miss[j : j + 2]] += before[j::m]
            rows[:, j, of_miss[j + 1 : j + 3]] += now[j::m]
        if self.first:
            rows[0, 0, of_drive[1:]] -= self.inertia[0] * self._start(coefficients)[1]
        else:
            rows[0, 0] = 0.0
        rows *= self.scale.reshape(n, m, 1)
        return rows


def _bends(slope: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return the half steps with several slopes, as indices (interval, part, half)."""
    change = np.diff(slope, axis=-1) != 0.0
    return np.nonzero(change[..., ::2] | change[..., 1::2])


def wanted_bend(link: UniformSpline, rows: CommandRows) -> np.ndarray:
    """Return phi'' where the coefficients of the command's acceleration stand [rad/s^2], (n,)."""
    spots = rows.start + rows.cycle * (np.arange(rows.coefficients - 2) - 0.5 * (rows.degree - 3))
    return _values(link, np.clip(spots, rows.start, rows.end), 2)


def _values(spline: UniformSpline, times: np.ndarray, order: int = 0) -> np.ndarray:
    values: np.ndarray = spline.at(times, order)[:, 0]
    return values
