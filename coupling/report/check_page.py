"""The page of a case that was checked: path, robot and what it reaches, in one picture."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from coupling.check.checked import CheckedRobot
from coupling.check.words import room_words
from coupling.errors import ResultError
from coupling.files.whole_file import make_folder_of, write_whole
from coupling.report.colours import AFTER, BEFORE, DESIRED
from coupling.report.document import document
from coupling.report.style import style
from coupling.report.tables import table
from coupling.report.thinning import PARTS

_REACH = "#009E73"
_TEXT = (
    "Links from joint to joint at the path's first sample, no bodies. The thin lines are how far the TCP"
    " can be led from the middle of the path, the tool held as it is there, in the upright plane through"
    " the robot's base and in the level one: beyond, a joint passes its limit, the arm is too short or"
    " the posture is singular. Collisions are not looked at."
)


def write_check_page(
    file: Path, title: str, robots: Sequence[CheckedRobot], lines: Sequence[str]
) -> Path:
    """Write the page of a case that was checked; return the file.

    Args:
        file: The HTML file.
        title: What was checked.
        robots: What was found of the robots.
        lines: The same in words.

    Raises:
        ResultError: If it cannot be written.
    """
    make_folder_of(file, ResultError)
    write_whole(file, check_page(title, robots, lines), ResultError)
    return file


def check_page(title: str, robots: Sequence[CheckedRobot], lines: Sequence[str]) -> str:
    """Return the page as one self-contained HTML text."""
    head = "".join(_joints(robot) for robot in robots)
    end = f"<h2>In words</h2><pre style='white-space: pre-wrap'>{html.escape(chr(10).join(lines))}</pre>"
    sections = [("Path, robot and reach", "workspace", workspace(robots), _TEXT)]
    return document(title, head, sections, end)


def workspace(robots: Sequence[CheckedRobot]) -> go.Figure:
    """Links, paths and outlines of what is reached, in the world."""
    figure = go.Figure()
    for number, robot in enumerate(robots):

        def draw(
            points: np.ndarray, name: str, line: dict[str, object], mode: str = "lines"
        ) -> None:
            x, y, z = robot.world_from_base.points(points).T  # noqa: B023
            figure.add_scatter3d(
                x=x,
                y=y,
                z=z,
                mode=mode,
                name=name,
                legendgroup=name,
                showlegend=number == 0,  # noqa: B023
                line=line,
                marker={"size": 4, "color": DESIRED},
            )

        position = robot.path.position[0]
        rows = np.unique(np.linspace(0, len(position) - 1, 2 * PARTS).astype(int))
        draw(robot.room.links, "robot", {"color": DESIRED, "width": 12}, "lines+markers")
        draw(robot.room.upright, "reach, upright plane", {"color": _REACH, "width": 3})
        draw(robot.room.level, "reach, level plane", {"color": AFTER, "width": 3})
        draw(position[rows], "path", {"color": BEFORE, "width": 4})
    figure.update_scenes(
        aspectmode="data",
        xaxis_title="x [m]",
        yaxis_title="y [m]",
        zaxis_title="z [m]",
        camera={
            "eye": {"x": 1.05, "y": -1.75, "z": 0.8},
            "center": {"x": 0.0, "y": 0.0, "z": -0.12},
        },
    )
    return style(figure, 620)


def _joints(robot: CheckedRobot) -> str:
    def degrees(value: float) -> str:
        return f"{np.rad2deg(value).round(1) + 0.0:.1f}" if np.isfinite(value) else "none"

    rows = [
        (
            f"joint {demand.joint}",
            *map(
                degrees,
                (
                    demand.lowest,
                    demand.highest,
                    demand.lower,
                    demand.upper,
                    demand.margin,
                    demand.rate,
                    demand.rate_limit,
                    demand.acceleration,
                    demand.acceleration_limit,
                ),
            ),
            ", ".join(demand.beyond) or "-",
        )
        for demand in robot.demands
    ]
    angles = ("[deg, s]", "lowest", "highest", "from", "to", "margin")
    header = (*angles, "rate", "limit", "acceleration", "limit", "beyond")
    return (
        f"<h2>{html.escape(robot.name)}</h2>{table(header, rows)}<p>{robot.way:.3f} m in"
        f" {robot.path.time[-1]:.1f} s; {room_words(robot)}; distance from singular postures"
        f" {robot.room.conditioning:.3f}.</p>"
    )
