"""Direction of a path's feed across the tool that takes it."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BPoly

from coupling.errors import CaseError
from coupling.path.histories import ToolPath
from coupling.path.interpolation import InterpolatedPath

# A tool that is slower across its axis than this part of its largest speed has no direction of its own.
_MIN_SPEED_RATIO = 0.02
# A path whose largest speed across the tool's axis is below this has no feed [m/s].
_STANDSTILL_SPEED = 1e-6
# Angles are one if they differ by less [rad].
_ANGLE_TOLERANCE = 1e-9

NO_FEED = (
    "tool_path: tilt_frame: expected a path with a feed across the tool's axis of approach, got one"
    " along which the tool rests or follows its axis: measure its tilt from the part"
)


def turned_to(before: float, heading: float) -> float:
    """Return the angle of a direction that is at most half a turn from an angle before it [rad].

    Half a turn is made counter-clockwise.

    Example:
        >>> turned_to(0.0, -np.pi) == turned_to(0.0, np.pi) == np.pi
        True
    """
    away = float(np.mod(heading - before, 2.0 * np.pi))
    # What is half a turn, or none, but for rounding goes one way wherever rounding leads.
    if away > 2.0 * np.pi - _ANGLE_TOLERANCE:
        away = 0.0
    return before + (away if away <= np.pi + _ANGLE_TOLERANCE else away - 2.0 * np.pi)


def headings_along(path: ToolPath) -> np.ndarray:
    """Return the angles of the feed across the axis of an untilted tool, which approaches along its x.

    Where the tool rests or moves along its axis, its heading turns from the last one to the next with
    a continuous rate; at the ends of the path it goes on as it bends there.

    Args:
        path: Path of one tool before it is turned.

    Returns:
        Angles from the tool's z axis towards its y axis, continuous along the path [rad], (n,).

    Raises:
        CaseError: If the tool never moves across its axis.
    """
    from scipy.integrate import cumulative_trapezoid

    time = path.time
    velocity = path.rotations[0].inv().apply(InterpolatedPath(path).position(time, 1))
    speed = np.hypot(velocity[:, 1], velocity[:, 2])
    if speed.max() <= _STANDSTILL_SPEED:
        raise CaseError(NO_FEED)
    rows = np.flatnonzero(speed > _MIN_SPEED_RATIO * speed.max())
    angles = np.unwrap(np.arctan2(velocity[rows, 1], velocity[rows, 2]))
    heading = np.interp(time, time[rows], angles)
    way = cumulative_trapezoid(speed, time, initial=0.0)
    bend = np.gradient(angles, way[rows]) if len(rows) > 1 else np.zeros(1)
    for part, end in ((slice(rows[0]), 0), (slice(rows[-1], None), -1)):
        heading[part] = angles[end] + bend[end] * (way[part] - way[rows[end]])
    # Of turning along the path, at both sides of a rest that of its own side.
    rate = np.where(np.diff(rows) == 1, np.diff(angles) / np.diff(time[rows]), 0.0)
    before, after = np.append(0.0, rate), np.append(rate, 0.0)
    for k in np.flatnonzero(np.diff(rows) > 1):
        between = slice(rows[k], rows[k + 1] + 1)
        ends = [[angles[k], before[k], 0.0], [angles[k + 1], after[k + 1], 0.0]]
        heading[between] = BPoly.from_derivatives(time[[rows[k], rows[k + 1]]], ends)(time[between])
    return heading
