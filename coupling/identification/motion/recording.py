"""recording.csv -> angles of motors and links, torques of motors, and the motors' smoothed motion."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.errors import IdentifyError
from coupling.files.measured_table import MeasuredTable
from coupling.identification.motor_torques import LATEST, in_ms, torque_per_current
from coupling.path.low_pass import zero_phase
from elastic_robot.description import Robot

TIME = "time"
# Steps of time may differ by this part of their mean; a row that is missing differs by all of it.
_UNEVEN = 0.02
# Longest step that shows a motion [s].
_SLOWEST = 0.2
# Fewest rows of a motion.
_FEWEST = 100
# Half of the joints of no robot turn as far as this [rad], two turns.
_TURNED = 4.0 * np.pi
# A link follows a motor that moves by more than this, but for a wind-up below this rms [rad], and by no
# other factor than 1 by this part.
_FOLLOWED, _NOT_WOUND_UP, _OTHER_UNIT = 0.05, 0.02, 0.2
# A lag counts where it moves so many times what is left.
_SURE = 2.0
# Order of the filter in one direction; there and back it has none of a phase and twice this order.
_ORDER = 3


@dataclass(frozen=True)
class Recording:
    """A motion as it was measured, in n equal steps of time, of a robot with j joints.

    Attributes:
        name: Name of the file.
        time: Times [s], (n,).
        motor: Angles of the motors over their gears' ratios, as in the robot file [rad], (n, j).
        torque: Torques of the motors times the ratios [N m], (n, j).
        link: Angles of the links behind the gears [rad], (n, j); nan where no encoder is.
        is_held_out: Whether it is predicted, not fitted.
    """

    name: str
    time: np.ndarray
    motor: np.ndarray
    torque: np.ndarray
    link: np.ndarray
    is_held_out: bool = False

    @property
    def step(self) -> float:
        """Step of time [s]."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))

    @property
    def with_link(self) -> list[int]:
        """Indices of joints whose link's angle is measured."""
        return np.flatnonzero(np.isfinite(self.link).all(axis=0)).tolist()

    @property
    def wind_up(self) -> np.ndarray:
        """Motor less link [rad], (n, j)."""
        return self.motor - self.link


def is_recording(path: Path) -> bool:
    """Return whether a file's columns are those of a motion, not of static deflections."""
    header = MeasuredTable.read(path, IdentifyError).header
    return TIME in header and any(name.startswith("motor") for name in header)


def read_recording(path: Path, robot: Robot, is_held_out: bool = False) -> Recording:
    """Read a motion (columns: docs/motion.md).

    Args:
        path: CSV file; lines that begin with # are comments, other columns are ignored.
        robot: The robot, for its number of joints and the torque constants of its motors.
        is_held_out: Whether it is predicted, not fitted.

    Raises:
        IdentifyError: With file, line, column, what was expected and what was got.
    """
    table, joints = MeasuredTable.read(path, IdentifyError), len(robot.joints)
    motor, torque, link = (
        [f"{what}[{i + 1}]" for i in range(joints)] for what in ("motor", "motor_torque", "link")
    )
    factors = np.ones(joints)
    for i, name in enumerate(torque):
        current = f"motor_current[{i + 1}]"
        if name not in table.header and current in table.header:
            torque[i], factors[i] = current, torque_per_current(robot, i, path, IdentifyError)
    table.require((TIME, *motor, *torque))
    more = f"motor[{joints + 1}]"
    if more in table.header:
        raise IdentifyError(
            f"{path}: expected the motors of a robot with {joints} joints, got {more}: is --robot right?"
        )
    if len(table.lines) < _FEWEST:
        raise IdentifyError(
            f"{path}: expected a motion of at least {_FEWEST} rows, got {len(table.lines)}"
        )
    time = table.of([TIME])[:, 0]
    steps = np.diff(time)
    mean = (time[-1] - time[0]) / len(steps)
    uneven = np.abs(steps - mean)
    if not mean > 0.0 or uneven.max() > _UNEVEN * mean:
        row = 1 + int(np.argmax(uneven >= 0.5 * uneven.max()))  # a gap changes the mean as well
        raise table.row_error(TIME, row, "equal steps of time")
    if mean > _SLOWEST:
        raise IdentifyError(
            f"{path}: time: expected steps of {_SLOWEST:g} s at most, got {mean:.3g}: is it in"
            " milliseconds?"
        )
    links = np.full((len(time), joints), np.nan)
    for k, name in enumerate(link):
        if name in table.header:
            links[:, k] = table.of([name])[:, 0]
    angles = table.of(motor)
    largest = float(np.median(np.abs(angles).max(axis=0)))
    if largest > _TURNED:
        raise IdentifyError(
            f"{path}: expected the motors' angles over the gear ratios in rad, got up to {largest:.3g}"
            " rad at half of the joints: are they in degrees, or not divided by the gear ratio?"
        )
    if not np.ptp(angles, axis=0).any():
        raise IdentifyError(f"{path}: expected motors that move, got {', '.join(motor)} at rest")
    _require_own_links(path, float(mean), angles, links)
    torques = table.of(torque) * factors
    return Recording(path.name, time, angles, torques, links, is_held_out)


def _require_own_links(path: Path, step: float, motor: np.ndarray, link: np.ndarray) -> None:
    """Refuse links that do not follow their motors, with any offset and hardly late.

    Args:
        step: Step of time [s].
        motor, link: Angles of motors and links [rad], (n, j); nan where no link is measured.
    """
    rate = np.gradient(motor, step, axis=0)

    def followed(i: int, k: int) -> tuple[float, float, float]:
        """Return by which factor link i follows motor k [1], how late [s]; rms of the rest [rad]."""
        columns = np.column_stack([motor[:, k], rate[:, k], np.ones(len(motor))])
        by = np.linalg.lstsq(columns, link[:, i], rcond=None)[0]
        return float(by[0]), float(-by[1]), float(np.std(link[:, i] - columns @ by))

    is_measured = np.isfinite(link).all(axis=0) & (np.ptp(motor, axis=0) > _FOLLOWED)
    for i in np.flatnonzero(is_measured).tolist():
        factor, late, residual = followed(i, i)
        follows = residual < _NOT_WOUND_UP and abs(factor - 1.0) < _OTHER_UNIT
        clocked = abs(late) < LATEST or abs(late) * np.std(rate[:, i]) < _SURE * residual
        if follows and clocked:
            continue
        best = min(range(motor.shape[1]), key=lambda k: followed(i, k)[2])
        got = f"got one that differs by {np.std(link[:, i] - motor[:, i]):.2g} rad rms"
        if follows:
            got = f"got it {in_ms(late)}: record both on one clock, or shift the column by that"
        elif residual < _NOT_WOUND_UP * abs(factor):
            got = f"got {factor:.3g} times that: has it the motor's unit and sign?"
        elif abs(followed(i, best)[0] - 1.0) < _OTHER_UNIT:
            got += f" and follows motor[{best + 1}]: are columns swapped?"
        raise IdentifyError(
            f"{path}: link[{i + 1}]: expected the angle behind the gear of motor[{i + 1}], {got}"
        )


def smooth(values: np.ndarray, step: float, bandwidth: float) -> np.ndarray:
    """Return angles or torques at steps [s], (n, k), below a bandwidth [Hz], without delay."""
    return zero_phase(values, step, bandwidth, _ORDER, "odd", 2.0)


@dataclass(frozen=True)
class SmoothedMotion:
    """Smoothed motion of the motors, n rows of j.

    Attributes:
        q, qd, qdd: Angle [rad], rate [rad/s] and acceleration [rad/s^2], (n, j).
        noise: Standard deviation of the acceleration at rest [rad/s^2], (j,): what the encoders' noise
            leaves of itself.
        fast: Part of the angle that is faster than the bandwidth [rad], (n, j).
    """

    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    noise: np.ndarray
    fast: np.ndarray

    @classmethod
    def of(cls, motor: np.ndarray, step: float, bandwidth: float) -> SmoothedMotion:
        """Return the motion of measured angles [rad], (n, j), below a bandwidth [Hz]."""
        q = smooth(motor, step, bandwidth)
        qd = np.gradient(q, step, axis=0, edge_order=2)
        qdd = smooth(np.gradient(qd, step, axis=0, edge_order=2), step, bandwidth)
        quiet = max(len(q) // 20, 20)
        # The quietest stretch is one at rest, if there is one.
        rough = qdd - smooth(qdd, step, bandwidth / 4.0)
        parts = np.array_split(rough, max(len(q) // quiet, 1))
        noise = np.min([part.std(axis=0) for part in parts], axis=0)
        return cls(q, qd, qdd, noise, motor - q)
