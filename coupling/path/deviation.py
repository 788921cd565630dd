"""How far an actual tool path is from the desired one."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from coupling.path.histories import ToolPath


@dataclass(frozen=True)
class Deviation:
    """Figures of a deviation along a path [m].

    Attributes:
        maximum, rms: Of the distance between actual and desired TCP at equal times.
        normal_maximum: Across the direction of travel.
        tangential_maximum: Along it: the tool is early or late.
        time_of_maximum: [s].
    """

    maximum: float
    rms: float
    normal_maximum: float
    tangential_maximum: float
    time_of_maximum: float

    def as_dict(self) -> dict[str, float]:
        """Return the figures by name."""
        return asdict(self)


def measure(actual: ToolPath, desired: ToolPath) -> Deviation:
    """Return the deviation of an actual path from the desired one; in a cell, the worst figures."""
    figures = [_of_tool(a, d) for a, d in zip(actual.tools, desired.tools, strict=True)]
    worst = max(figures, key=lambda figure: figure.maximum)
    return replace(
        worst,
        rms=max(figure.rms for figure in figures),
        normal_maximum=max(figure.normal_maximum for figure in figures),
        tangential_maximum=max(figure.tangential_maximum for figure in figures),
    )


def _of_tool(actual: ToolPath, desired: ToolPath) -> Deviation:
    difference = actual.position - desired.position
    distance = actual.distance_to(desired)
    along = np.sum(difference * _directions(desired), axis=1)
    across = np.sqrt(np.maximum(distance**2 - along**2, 0.0))
    return Deviation(
        maximum=float(distance.max()),
        rms=float(np.sqrt(np.mean(distance**2))),
        normal_maximum=float(across.max()),
        tangential_maximum=float(np.abs(along).max()),
        time_of_maximum=float(desired.time[distance.argmax()]),
    )


def _directions(path: ToolPath) -> np.ndarray:
    """Unit directions of travel, (n, 3); zero where the tool stands still."""
    step = np.gradient(path.position, path.time, axis=0)
    speed = np.linalg.norm(step, axis=1, keepdims=True)
    # A standing tool has no direction; 1e-9 m/s is far below any feed.
    return np.where(speed > 1e-9, step / np.maximum(speed, 1e-9), 0.0)
