"""What the encoders add to a motion: a lag, an offset, eccentricity, lines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.identification.motion.recording import Recording
from coupling.identification.motion.smoothing import SmoothedMotion

# Over less of a turn [rad] a sine of one a turn looks like much else, and is wrong elsewhere.
SHORT_TRAVEL = np.pi / 3.0


@dataclass(frozen=True)
class SensorParameter:
    """A number of a joint's sensors, the same in all recordings.

    Attributes:
        name: Name in the report.
        term: Its term.
        joint: Index of the joint.
        kind: "lag", "cosine", "sine" or "loop".
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
