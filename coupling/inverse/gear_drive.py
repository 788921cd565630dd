"""A link behind its gear: by how much it misses its motion under a command."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.interpolate import CubicSpline

from coupling.inverse.gear_elements import NO_ELEMENTS, GearElements
from coupling.inverse.rows import CommandRows, Layout
from coupling.inverse.spline import UniformSpline, stencil
from elastic_robot.kinematic_errors import NO_ERRORS, KinematicErrors
from elastic_robot.torque_curves import TorqueCurve

# Places in a step at which the gear is looked at: its start, which has no weight, and Gauss points of
# both halves; and their weights in the mean over each half.
_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_PLACES = np.concatenate([[0.0], 0.25 * (1.0 + _GAUSS), 0.5 + 0.25 * (1.0 + _GAUSS)])
_HALVES = np.zeros((2, 9))
_HALVES[0, 1:5] = _HALVES[1, 5:] = 0.5 * _WEIGHTS


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
        wind_up: x at the places of the steps [rad], (n, parts, 9).
        torque: Torque of the elements there [N m], (n, parts, 9).
        slope: Stiffness of those that stick [N m/rad], (n, parts, 9).
        start: Elongations at the first time of each interval [rad], (n, e).
    """

    wind_up: np.ndarray
    torque: np.ndarray
    slope: np.ndarray
    start: np.ndarray

    def part(self, begin: int, end: int) -> Memory:
        """Return what they do along the intervals begin to end of the rows."""
        here = slice(begin, end)
        return Memory(self.wind_up[here], self.torque[here], self.slope[here], self.start[here])


@dataclass(frozen=True)
class _Motion:
    """Motion of a gear at the places of the steps: (n, parts, 9) each.

    Attributes:
        wind_up, wind_up_rate: x [rad] and x' [rad/s].
        output_rate: u' [rad/s].
        rise: 1 + eps', du by dq [1].
        bend: eps'' q', du' by dq [1/s].
    """

    wind_up: np.ndarray
    wind_up_rate: np.ndarray
    output_rate: np.ndarray
    rise: np.ndarray
    bend: np.ndarray


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
        link: phi [rad] and phi' [rad/s] at the places of the steps, (2, n, parts, 9).
        bend: phi'' where the coefficients of the command's acceleration stand [rad/s^2], (c,).
        torque: T there [N m], (n, parts, 9).
        inertia: M of each step [kg m^2], (n parts,).
        memory: What the gear's elements do along the motion of `along`; None without any.
    """

    layout: Layout
    start: float
    cycle: float
    first: bool
    task: GearTask
    link: np.ndarray
    bend: np.ndarray
    torque: np.ndarray
    inertia: np.ndarray
    memory: Memory | None = None

    @classmethod
    def of(cls, task: GearTask, rows: CommandRows) -> GearDrive:
        """Return the drive of a gear along all rows."""
        layout = Layout.of(rows)
        step = rows.cycle / layout.parts
        steps = rows.start + step * np.arange(layout.nodes - 1)
        places = (steps[:, None] + step * _PLACES).reshape(layout.count, layout.parts, -1)
        link = np.stack([_values(task.link, places.ravel(), order) for order in range(2)])
        inside = np.clip(places, task.time[0], task.time[-1])
        # No step can follow what is faster than it: a light link is taken for one that it can.
        lightest = (0.5 * step) ** 2 * task.stiffness
        inertia = np.interp(steps + 0.5 * step, task.time, task.inertia)
        return cls(
            layout,
            rows.start,
            rows.cycle,
            True,
            task,
            link.reshape(2, *places.shape),
            wanted_bend(task.link, rows),
            CubicSpline(task.time, task.torque)(inside),
            np.maximum(inertia, lightest),
        )

    def part(self, begin: int, end: int) -> GearDrive:
        """Return the drive along the intervals begin to end of the rows."""
        parts, degree = self.layout.parts, self.layout.degree
        return replace(
            self,
            layout=replace(self.layout, count=end - begin),
            start=self.start + begin * self.cycle,
            first=self.first and begin == 0,
            link=self.link[:, begin:end],
            bend=self.bend[begin : end + degree - 2],
            torque=self.torque[begin:end],
            inertia=self.inertia[begin * parts : end * parts],
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
        x = self._motion(coefficients, misses).wind_up
        a, before = elements.slip_angle, self.memory
        start = np.clip(x[0, 0, 0], -a, a) if before is None else before.start[0]
        elongation = elements.along(x.ravel(), start).reshape(*x.shape, -1)
        torque, slope = elements.torque(elongation), elements.slope(elongation)
        return replace(self, memory=Memory(x, torque, slope, elongation[:, 0, 0]))

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
    def _basis(self) -> np.ndarray:
        """Weights of an interval's coefficients in q and q' at its steps, (2, parts, 9, degree + 1)."""
        parts, degree = self.layout.parts, self.layout.degree
        place = (np.arange(parts)[:, None] + _PLACES) / parts
        return np.stack([stencil(place, degree, order) / self.cycle**order for order in range(2)])

    def defects(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return by how much the equation is missed at every node but the last, as angles [rad].

        Args:
            coefficients: Coefficients of the command [rad], (count + degree,).
            misses: At the nodes [rad], (nodes,).

        Returns:
            (count, parts).
        """
        motion = self._motion(coefficients, misses)
        halves = self._impulses(motion)
        momentum = self.inertia / self.step * np.diff(misses)
        impulse = momentum + halves[..., 0].ravel()
        impulse[1:] += halves[..., 1].ravel()[:-1] - momentum[:-1]
        if self.first:
            # It starts in equilibrium with its wind-up at rest, so delta' = u' - phi'.
            beside = motion.output_rate[0, 0, 0] - self.link[1, 0, 0, 0]
            impulse[0] -= self.inertia[0] * beside
        else:
            impulse[0] = 0.0  # the step before is not here
        return (self.scale * impulse).reshape(-1, self.layout.parts)

    def _motion(self, coefficients: np.ndarray, misses: np.ndarray) -> _Motion:
        shape = self.layout.count, self.layout.parts, len(_PLACES)
        # A copy, as products of overlapping rows are not BLAS's.
        local = np.array(sliding_window_view(coefficients, self.layout.degree + 1))
        q, rate = (
            (local @ weights.reshape(-1, weights.shape[-1]).T).reshape(shape)
            for weights in self._basis
        )
        eps, slope, bend = np.zeros((3, *shape))
        if self.task.errors.count:
            eps, slope, bend, _ = self.task.errors.derivatives(q[..., None])[..., 0]
        change = np.diff(misses)[:, None]
        output_rate = (1.0 + slope) * rate
        return _Motion(
            self.link[0] + (misses[:-1, None] + change * _PLACES).reshape(shape) - q - eps,
            self.link[1] + (change / self.step).reshape(*shape[:2], 1) - output_rate,
            output_rate,
            1.0 + slope,
            bend * rate,
        )

    def _impulses(self, motion: _Motion) -> np.ndarray:
        """Return the integrals of d x' + S(x) - T over half steps [N m s], (n, parts, 2)."""
        x, memory = motion.wind_up, self.memory
        pull = self.task.curve.torque(x) + self.task.damping * motion.wind_up_rate - self.torque
        if memory is not None:
            pull = pull + memory.torque + memory.slope * (x - memory.wind_up)
        impulses: np.ndarray = 0.5 * self.step * pull @ _HALVES.T
        return impulses

    def gradient(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return the derivatives of `defects` by their blocks' unknowns [rad/rad], (n, parts, width)."""
        layout = self.layout
        n, m = layout.count, layout.parts
        motion, d = self._motion(coefficients, misses), self.task.damping
        slope = self.task.curve.slope(motion.wind_up)
        if self.memory is not None:
            slope = slope + self.memory.slope
        each = 0.5 * self.step * _HALVES
        by_angle, by_rate = slope * motion.rise + d * motion.bend, d * motion.rise
        by_drive = -sum(
            np.einsum("njp,hp,jpc->njhc", by, each, basis, optimize=True)
            for by, basis in zip((by_angle, by_rate), self._basis, strict=True)
        )
        by_miss = (slope[:, :, None] * each) @ np.stack([1.0 - _PLACES, _PLACES], axis=-1)
        by_miss += 0.5 * d * np.array([-1.0, 1.0])
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
            rise, bend = motion.rise[0, 0, 0], motion.bend[0, 0, 0]
            by_start = rise * self._basis[1, 0, 0] + bend * self._basis[0, 0, 0]
            rows[0, 0, of_drive[1:]] -= self.inertia[0] * by_start
        else:
            rows[0, 0] = 0.0
        rows *= self.scale.reshape(n, m, 1)
        return rows


def wanted_bend(link: UniformSpline, rows: CommandRows) -> np.ndarray:
    """Return phi'' where the coefficients of the command's acceleration stand [rad/s^2], (n,)."""
    spots = rows.start + rows.cycle * (np.arange(rows.coefficients - 2) - 0.5 * (rows.degree - 3))
    return _values(link, np.clip(spots, rows.start, rows.end), 2)


def _values(spline: UniformSpline, times: np.ndarray, order: int = 0) -> np.ndarray:
    values: np.ndarray = spline.at(times, order)[:, 0]
    return values
