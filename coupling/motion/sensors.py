"""Beside the model: lag, offset, eccentricity, lines of encoders; torque after a rest, and fast one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.motion.parameters import dry_friction
from coupling.motion.recording import Recording
from coupling.motion.smoothing import SmoothedMotion
from elastic_robot.description import Robot

# Over less of a turn [rad] a sine of one a turn looks like much else, and is wrong elsewhere.
SHORT_TRAVEL = np.pi / 3.0
# Travel [rad] over which friction after a rest wears off by 63 %: 2 to 20 mrad on a KUKA KR 300.
_WEARS_OFF = 5e-3


@dataclass(frozen=True)
class SensorParameter:
    """A number of a joint that the model has not, the same in all recordings.

    Attributes:
        name: Name in the report.
        term: Its term.
        joint: Index of the joint.
        kind: "lag", "cosine", "sine" or "loop" of the wind-up; of the torque "rest", or "rate" and
            "inertia" of what is faster than the bandwidth.
        size: What it usually is, in its unit.
        unit: Its unit.
    """

    name: str
    term: str
    joint: int
    kind: str
    size: float
    unit: str
    start: float = 0.0
    none: float = 0.0
    signed: bool = True

    @property
    def of_torque(self) -> bool:
        """Whether it adds to the motor's torque, not to the wind-up."""
        return self.kind in ("rest", "rate", "inertia")

    def inward(self, value: float) -> float:
        """Return what the fit counts by: parts of its usual size."""
        return value / self.size

    def outward(self, counted: float) -> float:
        """Return the value in its unit."""
        return counted * self.size


_KINDS = (
    ("lag", "lag", "lag", 1e-3, "s"),
    ("eccentricity.cosine", "eccentricity", "cosine", 3e-4, "rad"),
    ("eccentricity.sine", "eccentricity", "sine", 3e-4, "rad"),
    ("loop", "loop", "loop", 1e-4, "rad"),
)


def sensor_parameters(with_link: list[int], travel: np.ndarray) -> tuple[SensorParameter, ...]:
    """Return those of joints whose link's angle is measured.

    Args:
        with_link: Indices of these joints.
        travel: How far the recordings together turn each link [rad], (j,).
    """
    return tuple(
        SensorParameter(f"encoder[{i + 1}].{name}", f"{term} {i + 1}", i, kind, size, unit)
        for i in with_link
        for name, term, kind, size, unit in _KINDS
        if term != "eccentricity" or travel[i] >= SHORT_TRAVEL
    )


def torque_parameters(robot: Robot) -> tuple[SensorParameter, ...]:
    """Return those of the torques of a robot's motors."""
    found = []
    for i, joint in enumerate(robot.joints):
        drive = joint.drive
        if drive is None:
            continue
        for name, term, kind, size, unit in (
            ("friction_after_rest", "friction after a rest", "rest", dry_friction(drive)[0], "N m"),
            ("fast.rate_gain", "rate loop", "rate", drive.rate_gain, "N m s/rad"),
            ("fast.inertia", "fast rotor", "inertia", drive.inertia, "kg m^2"),
        ):
            place = f"motor[{i + 1}].{name}"
            found.append(SensorParameter(place, f"{term} {i + 1}", i, kind, max(size, 1.0), unit))
    return tuple(found)


def delayed(values: np.ndarray, step: float, lag: float) -> np.ndarray:
    """Return values at equal steps [s] a lag [s] later, (n,): a cubic spline, held at its ends."""
    rows = np.arange(len(values))
    there = np.clip(rows - lag / step, 0.0, len(values) - 1.0)
    later: np.ndarray = CubicSpline(rows, values)(there)
    return later


def column(parameter: SensorParameter, motion: SmoothedMotion, part: np.ndarray) -> np.ndarray:
    """Return the wind-up by a sensor's number of 1 [rad], (n,): of a lag, to first order.

    Args:
        parameter: The number.
        motion: Motion of the motors.
        part: Friction of the joint's motor over its largest, (n,).
    """
    q = motion.q[:, parameter.joint]
    if parameter.kind == "lag":
        return motion.qd[:, parameter.joint]
    if parameter.kind == "cosine":
        return np.cos(q)
    if parameter.kind == "sine":
        return np.sin(q)
    return part


def torque_column(
    parameter: SensorParameter, motion: SmoothedMotion, part: np.ndarray, step: float
) -> np.ndarray:
    """Return the motor's torque by a number of 1 that adds to it [N m], (n,).

    After a rest dry friction is larger, and wears off with travel.  What is faster than the bandwidth
    meets the rotor and the rate loop, whose command is slow: J_f r'' - K r' of the fast angle r.

    Args:
        parameter: The number.
        motion: Motion of the motors.
        part: Friction of the joint's motor over its largest, (n,).
        step: Step of time [s].
    """
    if parameter.kind == "rest":
        travel = np.cumsum(
            np.abs(np.diff(motion.q[:, parameter.joint], prepend=motion.q[0, parameter.joint]))
        )
        worn: np.ndarray = part * np.exp(-travel / _WEARS_OFF)
        return worn
    fast = np.pad(motion.fast[:, parameter.joint], 1, mode="edge")
    if parameter.kind == "rate":  # as a loop of this step sees it
        return np.asarray((fast[:-2] - fast[1:-1]) / step)
    return np.asarray((fast[2:] - 2.0 * fast[1:-1] + fast[:-2]) / step**2)


def own_columns(recording: Recording, joint: int, lines: tuple[float, ...]) -> np.ndarray:
    """Return the wind-up by what is a recording's own, (n, 1 + 2 l): offset, cosine and sine of lines.

    Args:
        recording: The recording.
        joint: Index of the joint.
        lines: Numbers of periods in a turn of the link.
    """
    angle = recording.link[:, joint]
    columns = [np.ones(len(angle))]
    for line in lines:
        columns += [np.cos(line * angle), np.sin(line * angle)]
    return np.column_stack(columns)
