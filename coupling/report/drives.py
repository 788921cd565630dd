"""What a command asks of the drives: curves, and a table against what they can do."""

from __future__ import annotations

from math import degrees

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from coupling.report.colours import JOINTS
from coupling.report.section import Note, Table
from coupling.report.style import curve, style
from coupling.results.run_result import RunResult
from coupling.run.stored_run import StoredRobot

# Parts of the time axis: there are 18 curves.
_PARTS = 400
# A limit is drawn where it is at most so many times what is asked.
_NEAR = 2.0
_KEYS = ("rate_limit_rad_s", "acceleration_limit_rad_s2")
DRIVES_NOTE = Note(
    "Angles from where they start, rates and accelerations; dashed: limits that are within twice what is"
    " asked. The table has the largest values, between the command's rows as well, and what they are of"
    " the limits."
)


def drives(run: StoredRobot) -> go.Figure:
    """Angles, rates and accelerations of the command over time."""
    joints = run.joints
    time = np.unique(np.append(joints.time, 0.5 * (joints.time[1:] + joints.time[:-1])))
    found = [np.degrees(values) for values in joints.trajectory.at(time)]
    found[0] = found[0] - found[0][0]
    figure = make_subplots(rows=3, cols=1, shared_xaxes=True, vertical_spacing=0.05)
    titles = ("angle [deg]", "rate [deg/s]", "acceleration [deg/s\u00b2]")
    for row, (values, title) in enumerate(zip(found, titles, strict=True), start=1):
        for joint, own in enumerate(values.T):
            figure.add_scatter(
                **curve(time, own, _PARTS),
                mode="lines",
                name=f"joint {joint + 1}",
                legendgroup=f"joint {joint + 1}",
                showlegend=row == 1,
                line={"color": JOINTS[joint % len(JOINTS)], "width": 1.3},
                row=row,
                col=1,
            )
        figure.update_yaxes(title=title, row=row, col=1)
    for row, key in enumerate(_KEYS, start=2):
        _add_limits(figure, run, key, row, (time[0], time[-1]), float(np.abs(found[row - 1]).max()))
    figure.update_xaxes(title="time [s]", row=3, col=1)
    return style(figure, 640)


def _add_limits(
    figure: go.Figure,
    run: StoredRobot,
    key: str,
    row: int,
    ends: tuple[float, float],
    asked: float,
) -> None:
    for drive in run.figures.command.drives:
        own = getattr(drive, key)
        if own is None or degrees(own) > _NEAR * asked:
            continue
        name, limit = f"joint {drive.joint}", degrees(own)
        color = JOINTS[(drive.joint - 1) % len(JOINTS)]
        figure.add_scatter(
            x=[*ends, None, *ends],
            y=[limit, limit, None, -limit, -limit],
            mode="lines",
            name=name,
            legendgroup=name,
            showlegend=False,
            line={"color": color, "width": 1.2, "dash": "dash"},
            row=row,
            col=1,
        )


def drives_table(figures: RunResult) -> Table:
    """Return what the command asks of the drives, beside their limits."""
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
        )
        for drive in figures.command.drives
    ]
    header = (
        *("command", "angle [deg]", "limits", "rate [deg/s]", "limit", "used"),
        *("acceleration [deg/s\u00b2]", "limit", "used", "at t = [s]"),
    )
    return Table(header, rows)


def _range(limits: tuple[float | None, float | None]) -> str:
    low, high = ("none" if limit is None else f"{degrees(limit):.0f}" for limit in limits)
    return "none" if low == high == "none" else f"{low} to {high}"


def _limit(asked: float, limit: float | None) -> tuple[str, str]:
    """Return a limit and what is used of it, in words."""
    if limit is None:
        return "none", "-"
    return f"{degrees(limit):.4g}", f"{100.0 * asked / limit:.0f} %"
