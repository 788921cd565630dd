"""What a command asks of the drives: curves, and a table against what they can do."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees

import numpy as np
import plotly.graph_objects as go

from coupling.report.colours import JOINTS
from coupling.report.style import Keys, curve, drawn, row, rows
from coupling.results.drive_result import DriveMotion
from coupling.results.section import Note, Table
from coupling.run.stored_run import StoredRobot

# Parts of the time axis: there are 18 curves, and 6 of motors.
_PARTS = 400
# A limit is drawn where it is at most so many times what is asked.
_NEAR = 2.0
_KEYS = ("rate_limit_rad_s", "acceleration_limit_rad_s2")
DRIVES_NOTE = Note(
    "Angles relative to their start, rates, accelerations, and motor torques at the gears' output;"
    " dashed: limits of up to twice the demand. Table: largest values, also between the command's rows,"
    " and their share of the limits."
)


def drives(run: StoredRobot) -> go.Figure:
    """Angles, rates and accelerations of the command over time, and torques of its motors."""
    joints, motors = run.joints, run.motor_torque
    time = np.unique(np.append(joints.time, 0.5 * (joints.time[1:] + joints.time[:-1])))
    values_of = [np.degrees(values) for values in joints.trajectory.at(time)]
    values_of[0] = values_of[0] - values_of[0][0]
    titles = ["angle [deg]", "rate [deg/s]", "acceleration [deg/s\u00b2]"]
    traces = [
        _curve(joint, time, angle, number)
        for number, values in enumerate(values_of, start=1)
        for joint, angle in enumerate(values.T)
    ]
    ends = float(time[0]), float(time[-1])
    for number, key in enumerate(_KEYS, start=2):
        limits = [(d.joint, getattr(d, key)) for d in run.figures.command.drives]
        limits_deg = {joint: degrees(angle) for joint, angle in limits if angle is not None}
        traces += _limits(limits_deg, number, ends, float(np.abs(values_of[number - 1]).max()))
    if motors is not None:
        titles.append("motor torque [N m]")
        traces += [_curve(joint, motors[0], angle, 4) for joint, angle in motors[1].items()]
        demand = max(float(np.abs(angle).max()) for angle in motors[1].values())
        limits = [(d.joint, d.motor_torque_limit_Nm) for d in run.figures.command.drives]
        limits_deg = {joint: limit for joint, limit in limits if limit is not None}
        traces += _limits(limits_deg, 4, ends, demand)
    axes = rows([1.0] * len(titles), 0.05, [{"title": title} for title in titles])
    return drawn(traces, 640 if motors is None else 840, **axes)


def _curve(joint: int, time: np.ndarray, values: np.ndarray, number: int) -> Keys:
    """Return a joint's curve, from 0, in a row."""
    return {
        **curve(time, values, _PARTS),
        "mode": "lines",
        "name": f"joint {joint + 1}",
        "legendgroup": f"joint {joint + 1}",
        "showlegend": number == 1,
        "line": {"color": JOINTS[joint % len(JOINTS)], "width": 1.3},
        **row(number),
    }


def _limits(
    limits: dict[int, float], number: int, ends: tuple[float, float], demand: float
) -> list[Keys]:
    """Return limits by joint, from 1, that are within reach of what is asked, in its unit."""
    return [
        {
            "x": [*ends, None, *ends],
            "y": [limit, limit, None, -limit, -limit],
            "mode": "lines",
            "name": f"joint {joint}",
            "legendgroup": f"joint {joint}",
            "showlegend": False,
            "line": {"color": JOINTS[(joint - 1) % len(JOINTS)], "width": 1.2, "dash": "dash"},
            **row(number),
        }
        for joint, limit in limits.items()
        if limit <= _NEAR * demand
    ]


def drives_table(demands: Sequence[DriveMotion]) -> Table:
    """Return what a motion asks of the drives, beside their limits."""
    rows = [
        (
            f"joint {drive.joint}",
            " to ".join(f"{degrees(end):.2f}" for end in drive.range_rad),
            _range(drive.range_limit_rad),
            f"{degrees(drive.rate_rad_s):.3g}",
            *_limit(drive.rate_rad_s, drive.rate_limit_rad_s),
            f"{degrees(drive.acceleration_rad_s2):.3g}",
            *_limit(drive.acceleration_rad_s2, drive.acceleration_limit_rad_s2),
            f"{drive.acceleration_time_s:.3f}",
            ", ".join(drive.exceeded) or "-",
        )
        for drive in demands
    ]
    header = (
        *("", "angle [deg]", "limits", "rate [deg/s]", "limit", "used"),
        *("acceleration [deg/s\u00b2]", "limit", "used", "at t = [s]", "BEYOND LIMIT"),
    )
    return Table(header, rows)


def _range(limits: tuple[float | None, float | None]) -> str:
    low, high = ("none" if limit is None else f"{degrees(limit):.0f}" for limit in limits)
    return "none" if low == high == "none" else f"{low} to {high}"


def _limit(demand: float, limit: float | None) -> tuple[str, str]:
    """Return a limit and what is used of it, in words."""
    if limit is None:
        return "none", "-"
    return f"{degrees(limit):.4g}", f"{100.0 * demand / limit:.0f} %"
