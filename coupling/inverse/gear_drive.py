"""A link behind its gear: by how much it misses its motion under a command."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from coupling.inverse.gear_elements import NO_ELEMENTS, GearElements
from coupling.inverse.gear_path import cubic_pieces
from coupling.inverse.rows import CommandRows, Layout
from coupling.inverse.spline import UniformSpline, stencil
from coupling.inverse.torque_impulses import torque_impulses
from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, finite_numbers, numbers
from elastic_robot.kinematic_errors import NO_ERRORS, KinematicErrors
from elastic_robot.torque_curves import TorqueCurve

# Angles of the link that are computed at once.
_CHUNK = 50_000
# The wind-up is known at the quarters of a step; the polynomial through them at points of each half.
_QUARTERS = 0.25 * np.arange(5)
_FINE = np.array(
    [
        np.linalg.solve(np.vander(_QUARTERS, 5).T, np.vander(places, 5).T).T
        for places in np.split((np.arange(32) + 0.5) / 32, 2)
    ]
)
# Misses of which an equation knows.
_MISSES = 3


class DriveStruct(ctypes.Structure):
    """er_gear_drive of desk/gear_drive.h."""

    _fields_ = (
        *(
            (name, ctypes.c_int64)
            for name in ("count", "parts", "degree", "first", "pieces", "sines")
        ),
        *((name, ctypes.c_double) for name in ("step", "damping", "link_rate")),
        *(
            (name, ctypes.c_void_p)
            for name in (
                *("knots", "origins", "cubics", "amplitude", "order", "phase"),
                *("value", "start_row", "fine", "link", "impulse", "inertia", "scale"),
                *("held_wind_up", "held_impulse", "held_slope"),
            )
        ),
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
        inertia_time: Rising times [s], (i,).
        inertia: M against which an error of the torque works there [kg m^2], (i,), straight in between:
            1 / (M^-1)_gg of the robot's mass matrix, the other coordinates free to yield as they are for
            what is faster than the robot's modes.
        elements: Elements of the gear's hysteresis, which come to e0 from unloaded.
        errors: Its kinematic error, by which its output is at u(q).
    """

    link: UniformSpline
    time: np.ndarray
    torque: np.ndarray
    wind_up: np.ndarray
    curve: TorqueCurve
    damping: float
    inertia_time: np.ndarray
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
        link = np.empty(4 * layout.nodes - 3)
        for first in range(0, len(link), _CHUNK):
            numbers = np.arange(first, min(first + _CHUNK, len(link)))
            link[numbers] = _values(task.link, rows.start + 0.25 * step * numbers)
        spacing = float(task.time[-1] - task.time[0]) / (len(task.time) - 1)
        impulse = torque_impulses(spacing, task.torque, 2 * layout.nodes - 2, 0.5 * step)
        middles = rows.start + step * (np.arange(layout.nodes - 1) + 0.5)
        # No step can follow what is faster than it: a light link is taken for one that it can.
        lightest = (0.5 * step) ** 2 * task.stiffness
        inertia = np.maximum(np.interp(middles, task.inertia_time, task.inertia), lightest)
        return cls(
            layout,
            rows.start,
            rows.cycle,
            True,
            task,
            link,
            wanted_bend(task.link, rows),
            impulse,
            inertia,
            float(_values(task.link, np.array([rows.start]), 1)[0]),
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
        layout, count, before = self.layout, elements.count, self.memory
        shape = layout.count, layout.parts
        wind_up = self._filled("er_gear_wind_ups", coefficients, misses, 5)
        a = elements.slip_angle
        start = np.clip(wind_up[0, 0, 0], -a, a) if before is None else before.elongation[0, 0]
        begin, room = numbers("elongations", start, (count,)), np.empty(2 * count)
        memory = Memory(
            wind_up, np.empty((*shape, 2)), np.empty((*shape, 2, 5)), np.empty((*shape, count))
        )
        filled = memory.impulse, memory.by_wind_up, memory.elongation
        loaded_library().er_elements_hold(
            ctypes.byref(self.struct),
            ctypes.byref(elements.struct),
            *map(address, (wind_up, begin, *filled, room)),
        )
        return replace(self, memory=memory)

    def torque_changes(self, other: GearDrive, least: float) -> np.ndarray:
        """Return in which intervals elements do otherwise than was held of them, (count,).

        Args:
            other: The drive about another motion.
            least: Angle that a change of their torque is worth at least [rad].
        """
        if self.memory is None or other.memory is None:
            return np.zeros(self.layout.count, dtype=bool)
        moved = other.memory.wind_up - self.memory.wind_up
        held = self.memory.impulse + np.einsum("nphq,npq->nph", self.memory.by_wind_up, moved)
        missing = np.abs(other.memory.impulse - held).max(axis=2) * self.scale.reshape(
            held.shape[:2]
        )
        changes: np.ndarray = missing.max(axis=1) > least
        return changes

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
    def _arrays(self) -> list[np.ndarray]:
        """The arrays that C reads, in its order; they stay as long as the drive."""
        layout, errors, pieces = self.layout, self.task.errors, cubic_pieces(self.task.curve)
        steps, count = layout.count * layout.parts, len(pieces[1])
        place = (np.arange(layout.parts)[:, None] + _QUARTERS) / layout.parts
        start_row = stencil(np.zeros(1), layout.degree, 1)[0] / self.cycle
        sines = errors.amplitude, errors.order, errors.phase
        arrays = [
            *map(finite_numbers, ("knots", "origins", "cubics"), pieces, _piece_shapes(count)),
            *(finite_numbers("sines", values, (len(errors.order),)) for values in sines),
            numbers("weights", stencil(place, layout.degree, 0), (*place.shape, layout.degree + 1)),
            numbers("weights of the first rate", start_row, (layout.degree + 1,)),
            _FINE,
            finite_numbers("link", self.link, (4 * steps + 1,)),
            finite_numbers("impulses", self.impulse, (2 * steps,)),
            finite_numbers("inertia", self.inertia, (steps,)),
            finite_numbers("scale", self.scale, (steps,)),
        ]
        if (memory := self.memory) is None:
            return arrays
        return [*arrays, memory.wind_up, memory.impulse, memory.by_wind_up]

    @cached_property
    def struct(self) -> DriveStruct:
        """The drive as C has it."""
        layout, task, arrays = self.layout, self.task, self._arrays
        counts = layout.count, layout.parts, layout.degree, self.first
        return DriveStruct(
            *(*counts, len(arrays[1]), len(arrays[3])),
            *(self.step, task.damping, self.link_rate),
            *map(address, arrays),
        )

    def unknowns(self, coefficients: np.ndarray, misses: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return coefficients [rad], (count + degree,), and misses [rad], (nodes,), as C reads them."""
        layout = self.layout
        return (
            numbers("coefficients", coefficients, (layout.count + layout.degree,)),
            numbers("misses", misses, (layout.nodes,)),
        )

    def _filled(
        self, name: str, coefficients: np.ndarray, misses: np.ndarray, *width: int
    ) -> np.ndarray:
        """Return what a function of the library tells of a motion, (count, parts, *width)."""
        unknowns = self.unknowns(coefficients, misses)
        filled = np.empty((self.layout.count, self.layout.parts, *width))
        call = getattr(loaded_library(), name)
        call(ctypes.byref(self.struct), *map(address, unknowns), address(filled))
        return filled

    def defects(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return by how much the equation is missed at every node but the last, as angles [rad].

        Args:
            coefficients: Coefficients of the command [rad], (count + degree,).
            misses: At the nodes [rad], (nodes,).

        Returns:
            (count, parts).
        """
        return self._filled("er_gear_defects", coefficients, misses)

    def gradient(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return the derivatives of `defects` by their blocks' unknowns [rad/rad], (n, parts, width)."""
        layout = self.layout
        of_drive, of_miss = layout.block_coefficient, layout.block_miss
        # By coefficients i - 1 to i + degree, then by the misses of the node before, at it, behind.
        width = len(of_drive) + _MISSES
        rows = self._filled("er_gear_rows", coefficients, misses, width)
        blocks = np.zeros((layout.count, layout.parts, layout.width))
        blocks[:, :, of_drive] = rows[:, :, : len(of_drive)]
        for j in range(layout.parts):
            blocks[:, j, of_miss[j : j + 3]] = rows[:, j, len(of_drive) :]
        return blocks


def _piece_shapes(count: int) -> tuple[tuple[int, ...], ...]:
    return (count - 1,), (count,), (count, 4)


def wanted_bend(link: UniformSpline, rows: CommandRows) -> np.ndarray:
    """Return phi'' where the coefficients of the command's acceleration stand [rad/s^2], (n,)."""
    spots = rows.start + rows.cycle * (np.arange(rows.coefficients - 2) - 0.5 * (rows.degree - 3))
    return _values(link, np.clip(spots, rows.start, rows.end), 2)


def _values(spline: UniformSpline, times: np.ndarray, order: int = 0) -> np.ndarray:
    values: np.ndarray = spline.at(times, order)[:, 0]
    return values
