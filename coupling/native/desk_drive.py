"""The scalar robot of a gear and the least squares of its command, in C (`desk/drive_fit.h`)."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, finite_numbers, numbers

_QUARTERS, _FINE, _HALVES = 5, 16, 2
# Misses of which an equation knows.
_MISSES = 3
# Intervals between rows within which changes die out, at first.
_LAG = 256
# Samples that a spline goes through at least.
_FEWEST_SAMPLES = 4
# er_solved of desk/drive_fit.h.
_NOT_POSITIVE, _NO_MEMORY = 1, 2


@dataclass(frozen=True)
class CubicPieces:
    """A torque curve as cubics.

    Attributes:
        knots: Rising angles, the last ones of their pieces [rad], (p - 1,).
        origins: Angle from which each piece counts [rad], (p,).
        cubics: Coefficients of 1, t, t^2, t^3 [N m], t from a piece's origin [rad], (p, 4).
    """

    knots: np.ndarray
    origins: np.ndarray
    cubics: np.ndarray


@dataclass(frozen=True)
class HeldElements:
    """What elements of a hysteresis do about a motion, in n steps.

    Attributes:
        wind_up: Wind-up at the quarters [rad], (n, 5).
        impulse: Integral of their torque over halves [N m s], (n, 2).
        slope: Its derivatives by the wind-up at the quarters [N m s/rad], (n, 2, 5).
    """

    wind_up: np.ndarray
    impulse: np.ndarray
    slope: np.ndarray


@dataclass(frozen=True)
class DriveNumbers:
    """The numbers of a drive, with n = count parts steps.

    Attributes:
        count, parts, degree: Intervals between rows, steps in one, degree of the command.
        first: Whether the path begins here.
        step, damping: Length of a step [s], damping of the gear [N m s/rad].
        link_rate: Rate of the link at the first time [rad/s].
        curve: Torque curve.
        sines: Amplitudes, orders and phases of the kinematic error [rad, 1, rad], (3, s).
        value: Weights of an interval's coefficients at the quarters, (parts, 5, degree + 1).
        start_row: Weights of the first coefficients in the first rate [1/s], (degree + 1,).
        fine: Weights of the quarters at the fine points of both halves, (2, 16, 5).
        link: Angle of the link at the quarters [rad], (4 n + 1,).
        impulse: Impulse of the torque over halves [N m s], (2 n,).
        inertia, scale: Inertia [kg m^2] and worth of an impulse [rad/(N m s)] of each step, (n,).
        held: Elements of its hysteresis, or None.
    """

    count: int
    parts: int
    degree: int
    first: bool
    step: float
    damping: float
    link_rate: float
    curve: CubicPieces
    sines: np.ndarray
    value: np.ndarray
    start_row: np.ndarray
    fine: np.ndarray
    link: np.ndarray
    impulse: np.ndarray
    inertia: np.ndarray
    scale: np.ndarray
    held: HeldElements | None = None


class _SampledTorque(ctypes.Structure):
    """er_sampled_torque of desk/impulse.h."""

    _fields_ = (
        ("count", ctypes.c_int64),
        ("spacing", ctypes.c_double),
        ("torque", ctypes.c_void_p),
        ("work", ctypes.c_void_p),
    )


def torque_impulses(spacing: float, torque: np.ndarray, steps: int, length: float) -> np.ndarray:
    """Return the impulses of a torque over steps from its first sample on [N m s], (steps,).

    Args:
        spacing: Distance of the samples [s].
        torque: Samples of the torque, four or more [N m], (k,); a cubic spline goes through them, and
            behind the last one it stays.
        steps: Number of steps.
        length: Length of a step [s].

    Raises:
        ValueError: If there are fewer than four samples, or one is not finite.

    Example:
        >>> torque_impulses(0.5, np.array([0.0, 0.25, 1.0, 2.25, 4.0]), 2, 1.0).round(12).tolist()
        [0.333333333333, 2.333333333333]
    """
    samples = finite_numbers("torque", torque, (len(torque),))
    if len(samples) < _FEWEST_SAMPLES:
        raise ValueError(f"expected {_FEWEST_SAMPLES} samples or more, got {len(samples)}")
    work, impulse = np.empty_like(samples), np.empty(steps)
    sampled = _SampledTorque(len(samples), spacing, address(samples), address(work))
    loaded_library().er_impulses(
        ctypes.byref(sampled), ctypes.c_int64(steps), ctypes.c_double(length), address(impulse)
    )
    return impulse


class _Drive(ctypes.Structure):
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
                *(
                    "knots",
                    "origins",
                    "cubics",
                    "amplitude",
                    "order",
                    "phase",
                    "value",
                    "start_row",
                ),
                *("fine", "link", "impulse", "inertia", "scale"),
                *("held_wind_up", "held_impulse", "held_slope"),
            )
        ),
    )


class DeskDrive:
    """The scalar robot of a gear.

    Args:
        of: Its numbers.

    Raises:
        ValueError: If an array has another shape than the others ask for, or is not finite.
    """

    def __init__(self, of: DriveNumbers) -> None:
        width, steps, pieces = of.degree + 1, of.count * of.parts, len(of.curve.origins)
        sines = finite_numbers("sines", of.sines, (3, of.sines.shape[1]))
        arrays = [
            finite_numbers("knots", of.curve.knots, (pieces - 1,)),
            finite_numbers("origins", of.curve.origins, (pieces,)),
            finite_numbers("cubics", of.curve.cubics, (pieces, 4)),
            *sines,
            finite_numbers("weights", of.value, (of.parts, _QUARTERS, width)),
            finite_numbers("weights of the first rate", of.start_row, (width,)),
            finite_numbers("weights of fine points", of.fine, (_HALVES, _FINE, _QUARTERS)),
            finite_numbers("link", of.link, (4 * steps + 1,)),
            finite_numbers("impulses", of.impulse, (_HALVES * steps,)),
            finite_numbers("inertia", of.inertia, (steps,)),
            finite_numbers("scale", of.scale, (steps,)),
        ]
        places: list[ctypes.c_void_p | None] = [None, None, None]
        if of.held is not None:
            held = [
                finite_numbers("wind-up of elements", of.held.wind_up, (steps, _QUARTERS)),
                finite_numbers("impulse of elements", of.held.impulse, (steps, _HALVES)),
                finite_numbers("slope of elements", of.held.slope, (steps, _HALVES, _QUARTERS)),
            ]
            places, arrays = [address(values) for values in held], arrays + held
        self.of, self._library = of, loaded_library()
        # The arrays stay as long as C reads them.
        self._read = arrays
        own = [address(values) for values in arrays[:13]]
        counts = of.count, of.parts, of.degree, of.first, pieces, sines.shape[1]
        self.struct = _Drive(*counts, of.step, of.damping, of.link_rate, *own, *places)

    def unknowns(self, coefficients: np.ndarray, misses: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return coefficients [rad], (count + degree,), and misses [rad], (n + 1,), as C reads them."""
        of = self.of
        return (
            numbers("coefficients", coefficients, (of.count + of.degree,)),
            numbers("misses", misses, (of.count * of.parts + 1,)),
        )

    def wind_ups(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return the wind-up at the quarters [rad], (count, parts, 5); unknowns [rad] as `unknowns`."""
        shape = self.of.count, self.of.parts, _QUARTERS
        return self._filled("er_gear_wind_ups", coefficients, misses, shape)

    def defects(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return the defects of all nodes but the last [rad], (count, parts); unknowns as `unknowns`."""
        shape = self.of.count, self.of.parts
        return self._filled("er_gear_defects", coefficients, misses, shape)

    def rows(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return their derivatives [rad/rad], (count, parts, degree + 5); unknowns as `unknowns`.

        Those by coefficients i - 1 to i + degree, then by the misses of the node before, at it, behind.
        """
        shape = self.of.count, self.of.parts, self.of.degree + 2 + _MISSES
        return self._filled("er_gear_rows", coefficients, misses, shape)

    def held(
        self, elements: ctypes.Structure, wind_up: np.ndarray, start: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return what elements of a hysteresis do along a motion, and about it.

        Args:
            elements: The elements as C has them, e of them.
            wind_up: Wind-up at the quarters [rad], (count, parts, 5).
            start: Elongations at the first of them [rad], (e,).

        Returns:
            Integral of their torque over halves [N m s], (count, parts, 2); its derivatives by the
            wind-up at the quarters [N m s/rad], (count, parts, 2, 5); elongations at the starts of the
            steps [rad], (count, parts, e).
        """
        shape, count = (self.of.count, self.of.parts), len(start)
        path = numbers("wind-ups", wind_up, (*shape, _QUARTERS))
        begin = numbers("elongations", start, (count,))
        filled = np.empty((*shape, _HALVES)), np.empty((*shape, _HALVES, _QUARTERS))
        elongation, room = np.empty((*shape, count)), np.empty(2 * count)
        self._library.er_elements_hold(
            ctypes.byref(self.struct),
            ctypes.byref(elements),
            *map(address, (path, begin, *filled, elongation, room)),
        )
        return (*filled, elongation)

    def _filled(
        self, name: str, coefficients: np.ndarray, misses: np.ndarray, shape: tuple[int, ...]
    ) -> np.ndarray:
        unknowns, filled = self.unknowns(coefficients, misses), np.empty(shape)
        call = getattr(self._library, name)
        call(ctypes.byref(self.struct), *map(address, unknowns), address(filled))
        return filled


class _Fit(ctypes.Structure):
    """er_drive_fit of desk/drive_fit.h."""

    _fields_ = (
        ("drive", _Drive),
        *((name, ctypes.c_double) for name in ("cycle", "smoothing", "heavy", "counted", "idle")),
        ("bend", ctypes.c_void_p),
        ("conditions", ctypes.c_int64),
        *(
            (name, ctypes.c_void_p)
            for name in ("condition_first", "condition_weights", "condition_value")
        ),
    )


@dataclass(frozen=True)
class FitWeights:
    """Weights of the least squares.

    Attributes:
        smoothing: Weight of the command's acceleration beyond that of the link [s^2].
        heavy, counted: Weights of equations in a step, and in the value.
        idle: Part of the diagonal for coefficients.
    """

    smoothing: float
    heavy: float
    counted: float
    idle: float


class DeskFit:
    """The least squares of a command.

    Args:
        drive: The drive.
        cycle: Distance of the rows [s].
        weights: Weights.
        bend: Acceleration of the link where the command's has its coefficients [rad/s^2],
            (count + degree - 2,).
        ends: First coefficient, weights (degree + 1,) and value [rad] of each condition at an end.

    Raises:
        ValueError: If an array has another shape than the others ask for, or is not finite.
    """

    def __init__(
        self,
        drive: DeskDrive,
        cycle: float,
        weights: FitWeights,
        bend: np.ndarray,
        ends: list[tuple[int, np.ndarray, float]],
    ) -> None:
        of, width = drive.of, drive.of.degree + 1
        self._size = (of.count + of.degree + 1) * (of.parts + 1)
        first = np.array([end[0] for end in ends], dtype=np.int64)
        if not ((first >= 0) & (first < of.count)).all():
            raise ValueError("expected conditions on coefficients")
        weights_of_ends = np.array([end[1] for end in ends]).reshape(len(ends), width)
        arrays = (
            finite_numbers("bends", bend, (of.count + of.degree - 2,)),
            first,
            finite_numbers("conditions", weights_of_ends, (len(ends), width)),
            finite_numbers("conditions", np.array([end[2] for end in ends]), (len(ends),)),
        )
        self._drive, self._read, self._library = drive, arrays, loaded_library()
        bends, *of_ends = map(address, arrays)
        of_weights = weights.smoothing, weights.heavy, weights.counted, weights.idle
        self._struct = _Fit(drive.struct, cycle, *of_weights, bends, len(ends), *of_ends)

    def value(self, coefficients: np.ndarray, misses: np.ndarray, stretches: np.ndarray) -> float:
        """Return half the sum of squares of what is in stretches [rad^2].

        Args:
            coefficients, misses: Unknowns [rad], as of the drive, (n,) each.
            stretches: Numbers of the first interval and of that behind the last one, rising, (k, 2).
        """
        value = self._library.er_drive_fit_value
        unknowns = self._drive.unknowns(coefficients, misses)
        ranges = self._ranges(stretches)
        count = ctypes.c_int64(len(ranges))
        return float(value(ctypes.byref(self._struct), count, *map(address, (ranges, *unknowns))))

    def step(
        self, coefficients: np.ndarray, misses: np.ndarray, damping: float, stretches: np.ndarray
    ) -> np.ndarray:
        """Return the step of all unknowns that solves the linearised least squares [rad], (size,).

        Args:
            coefficients, misses: Start of the step [rad], as of the drive, (n,) each.
            damping: Weight of the change of the command's bends.
            stretches: Numbers of the first interval and of that behind the last one, rising, (k, 2);
                nothing changes outside.

        Raises:
            LinAlgError: If the matrix is not positive definite.
            MemoryError: If a part of it does not fit into memory.
        """
        unknowns, step = self._drive.unknowns(coefficients, misses), np.empty(self._size)
        ranges = self._ranges(stretches)
        solved = self._library.er_drive_fit_step(
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

    def _ranges(self, stretches: np.ndarray) -> np.ndarray:
        ranges = np.ascontiguousarray(stretches, dtype=np.int64).reshape(-1, 2)
        order = np.concatenate([[0], ranges.ravel(), [self._drive.of.count]])
        if (np.diff(order) < 0).any():
            raise ValueError(f"expected rising stretches of the rows, got {ranges.tolist()}")
        return ranges
