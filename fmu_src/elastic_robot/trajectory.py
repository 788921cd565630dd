"""Joint motion of the drives: q, q', q'' over time, from samples or from held commands."""

from __future__ import annotations

import zipfile
from bisect import bisect_right
from math import inf
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from scipy.interpolate import CubicSpline, PPoly

from elastic_robot.errors import TrajectoryError
from elastic_robot.settings import SETTINGS


class Drives(Protocol):
    """Motion of the drives over time."""

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return q, q', q'' [rad, rad/s, rad/s^2] at times (k,) [s], (3, k, n)."""

    def next_kink(self, time: float, jump: float) -> float:
        """Return the first time after `time` of a jump of the third derivative.

        Jumps up to `jump` [rad/s^3] do not count; infinity if there is none.
        """


class HeldCommand(NamedTuple):
    """Drives from the command at a step's start: q + q' s + q'' s^2 / 2, s seconds later.

    Attributes:
        start: Time of the step's start [s].
        q, qd, qdd: Command there [rad, rad/s, rad/s^2], (n,).
    """

    start: float
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return q, q', q'' [rad, rad/s, rad/s^2] at times (k,) [s], (3, k, n)."""
        s = (times - self.start)[:, None]
        motion = np.empty((3, len(times), len(self.q)))
        motion[0] = self.q + (self.qd + 0.5 * self.qdd * s) * s
        motion[1] = self.qd + self.qdd * s
        motion[2] = self.qdd
        return motion

    def next_kink(self, time: float, jump: float) -> float:
        """Return infinity: the command is a polynomial."""
        del time, jump
        return inf


class Trajectory:
    """Drives from samples.

    With rates and accelerations the motion is the quintic Hermite spline of the samples, else the
    C2 cubic spline through them with zero rate at both ends.

    Args, kept as attributes but for the rates:
        time: Rising [s], (k,), at least 2.
        q: Angles [rad], (k, n).
        qd: Rates [rad/s], (k, n), or None.
        qdd: Accelerations [rad/s^2], (k, n), or None; given if and only if qd is.

    Raises:
        TrajectoryError: If sizes do not agree, a value is not finite or beyond the setting
            `most_sample`, or samples are closer than `closest_samples`.
    """

    def __init__(
        self,
        time: np.ndarray,
        q: np.ndarray,
        qd: np.ndarray | None = None,
        qdd: np.ndarray | None = None,
    ) -> None:
        _require_samples(time, q, qd, qdd)
        # Since the start, whose own size would leave no digits to a late trajectory's seconds.
        seconds = time - time[0]
        if qd is not None and qdd is not None:
            position = _quintic_hermite(seconds, q, qd, qdd)
        else:
            position = CubicSpline(seconds, q, bc_type="clamped")
        # One polynomial for q, q' and q'' side by side: evaluated in one call.
        derivatives = [position.c, position.derivative(1).c, position.derivative(2).c]
        padded = [np.pad(c, ((len(position.c) - len(c), 0), (0, 0), (0, 0))) for c in derivatives]
        self._polynomial = PPoly(np.concatenate(padded, axis=2), position.x)
        self._starts, self._coefficients = self._polynomial.x, self._polynomial.c
        self._exponents = np.arange(len(position.c))[::-1]
        self._joint_count = q.shape[1]
        self._jumps = _jumps_of_third_derivative(position)
        self._kinks: dict[tuple[float, float], list[float]] = {}
        self.time, self.q = time, q
        self.start = float(time[0])
        self.end = float(time[-1])

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return q, q', q'' [rad, rad/s, rad/s^2] at rising times (k,) [s], (3, k, n).

        Raises:
            TrajectoryError: If a time is outside the samples by more than `Settings.slack_at`.
        """
        return self._at(times - self.start)

    def _at(self, seconds: np.ndarray) -> np.ndarray:
        lowest, highest = seconds[0], seconds[-1]
        last = self.end - self.start
        slack = SETTINGS.slack_at(max(abs(self.start), abs(self.end)))
        if not (-slack <= lowest and highest <= last + slack):
            outside = self.start + (lowest if lowest < 0.0 else highest)
            raise TrajectoryError(
                f"time: expected {self.start:.9g} to {self.end:.9g} s, the trajectory's, got"
                f" {outside:.9g} s"
            )
        times = seconds if lowest >= 0.0 and highest <= last else np.clip(seconds, 0.0, last)
        values = self._polynomial(times) if len(times) > 1 else self._at_one(float(times[0]))
        return values.reshape(len(times), 3, self._joint_count).swapaxes(0, 1)

    def _at_one(self, seconds: float) -> np.ndarray:
        """Return q, q', q'' at one time side by side, (3 n,), for which a PPoly's call takes longer."""
        piece = self._starts[1:-1].searchsorted(seconds, side="right")
        powers = (seconds - self._starts[piece]) ** self._exponents
        return powers @ self._coefficients[:, piece]

    def since(self, time: float) -> TrajectorySince:
        """Return the same motion over the seconds since a time."""
        return TrajectorySince(self, self.start - time)

    def next_kink(self, time: float, jump: float) -> float:
        """Return the first time after `time` of a jump of the third derivative.

        Jumps up to `jump` [rad/s^3] do not count; infinity if there is none.
        """
        return self._next_kink(time, jump, self.start)

    def _next_kink(self, time: float, jump: float, start: float) -> float:
        """Return the next jump where the first sample's time is `start`."""
        kinks = self._kinks.get((jump, start))
        if kinks is None:
            inner = self._starts[1:-1] + start
            kinks = [*inner[self._jumps > jump].tolist(), inf]
            self._kinks = {(jump, start): kinks}
        return kinks[bisect_right(kinks, time)]


class TrajectorySince(NamedTuple):
    """A trajectory over the seconds since some time.

    Attributes:
        trajectory: The motion.
        start: Seconds from that time to its first sample.
    """

    trajectory: Trajectory
    start: float

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the motion as `Trajectory.at`."""
        return self.trajectory._at(times - self.start)

    def next_kink(self, time: float, jump: float) -> float:
        """As `Trajectory.next_kink`."""
        return self.trajectory._next_kink(time, jump, self.start)


def _jumps_of_third_derivative(position: PPoly) -> np.ndarray:
    """Return the largest jump over all joints at each inner sample [rad/s^3], (k - 2,)."""
    third = position.derivative(3)
    length = np.diff(third.x)[:-1, None]
    ends = np.zeros_like(third.c[0, :-1])
    for coefficient in third.c:
        ends = ends * length + coefficient[:-1]
    return np.abs(third.c[-1, 1:] - ends).max(axis=1, initial=0.0)


def _require_samples(
    time: np.ndarray, q: np.ndarray, qd: np.ndarray | None, qdd: np.ndarray | None
) -> None:
    if time.ndim != 1 or len(time) < 2:
        raise TrajectoryError(f"trajectory: expected at least 2 samples, got {np.size(time)}")
    if (qd is None) != (qdd is None):
        alone = "qd" if qdd is None else "qdd"
        raise TrajectoryError(
            f"trajectory: expected qd and qdd, or none of them, got {alone} alone"
        )
    most = SETTINGS.most_sample
    for name, values in (("time", time), ("q", q), ("qd", qd), ("qdd", qdd)):
        if values is None:
            continue
        if (name != "time" and values.shape != q.shape) or len(values) != len(time):
            raise TrajectoryError(f"trajectory: {name} has shape {values.shape}, time {time.shape}")
        # NaN is not at most anything.
        bad = np.flatnonzero(~(np.abs(values.reshape(len(time), -1)) <= most).all(axis=1))
        if len(bad):
            raise TrajectoryError(
                f"trajectory: {name}: expected finite numbers of at most {most:g}, got another in"
                f" sample {bad[0] + 1}"
            )
    steps, closest = np.diff(time), SETTINGS.closest_samples
    if np.any(steps < closest):
        k = int(np.argmax(steps < closest))
        raise TrajectoryError(
            f"trajectory: expected rising times, at least {closest:g} s apart, got {time[k]:.9g} s, then"
            f" {time[k + 1]:.9g} s at sample {k + 2}"
        )


def _quintic_hermite(time: np.ndarray, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> PPoly:
    """Polynomials of degree 5 that take value, rate and acceleration at both ends of each interval.

    In s = (t - t_k) / h: c0..c2 from the left end; c3..c5 solve the conditions at the right end.
    """
    h = np.diff(time)[:, None]
    rise = q[1:] - q[:-1] - h * qd[:-1] - 0.5 * h**2 * qdd[:-1]
    slope = h * (qd[1:] - qd[:-1]) - h**2 * qdd[:-1]
    curvature = h**2 * (qdd[1:] - qdd[:-1])
    c3 = 10.0 * rise - 4.0 * slope + 0.5 * curvature
    c4 = -15.0 * rise + 7.0 * slope - curvature
    c5 = 6.0 * rise - 3.0 * slope + 0.5 * curvature
    coefficients = np.stack([c5 / h**5, c4 / h**4, c3 / h**3, 0.5 * qdd[:-1], qd[:-1], q[:-1]])
    return PPoly(coefficients, time)


def read_trajectory(path: Path, joint_count: int) -> Trajectory:
    """Read a trajectory from CSV (header line) or NPZ (arrays `columns` and `data`).

    Columns time, q1.., and optionally qd1.., qdd1.. are found by name; others are ignored.  The native
    FMU checks more (docs/fmu.md#trajectories).

    Raises:
        TrajectoryError: With the file, what was expected and what was got.
    """
    try:
        return trajectory_of(*_read_table(path), joint_count)
    except FileNotFoundError:
        raise TrajectoryError(f"trajectory {path}: does not exist") from None
    except (OSError, KeyError, ValueError, zipfile.BadZipFile, TrajectoryError) as cause:
        reason = str(cause).removeprefix("trajectory: ")
        raise TrajectoryError(f"trajectory {path}: {reason}") from cause


def _read_table(path: Path) -> tuple[list[str], np.ndarray]:
    """Return the names of a file's columns and its numbers, (rows, columns)."""
    if path.suffix == ".npz":
        with np.load(path) as archive:
            return [str(name) for name in archive["columns"]], np.asarray(archive["data"], float)
    with path.open(encoding="utf-8-sig") as file:
        names = [name.strip() for name in file.readline().split(",")]
        return names, np.loadtxt(file, delimiter=",", ndmin=2)


def trajectory_of(columns: list[str], data: np.ndarray, joint_count: int) -> Trajectory:
    """Return the trajectory of a table's columns, its data (k, columns) in [s, rad, rad/s, rad/s^2].

    Raises:
        TrajectoryError: With what was expected and what was got.
    """

    def column(name: str) -> int:
        if columns.count(name) != 1:
            got = ", ".join(columns)
            raise TrajectoryError(f"trajectory: expected one column '{name}', got {got}")
        return columns.index(name)

    def block(prefix: str) -> np.ndarray | None:
        names = [f"{prefix}{i}" for i in range(1, joint_count + 1)]
        if prefix != "q" and not any(name in columns for name in names):
            return None
        return data[:, [column(name) for name in names]]

    time, q = data[:, column("time")], block("q")
    assert q is not None
    return Trajectory(time, q, block("qd"), block("qdd"))
