"""Write the tables and the picture of docs/place.md: make place.

Cases as they are and where elastic-robot place puts them, their commands replayed through the native FMU
on robots with another backlash.  With names, only those parts:
python docs/scripts/make_place.py cases maps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.files.robot_file import shipped_robots
from coupling.place.evaluated_setting import EvaluatedSetting
from coupling.place.folder import StoredPlacement, figures_of
from coupling.place.place import CasePlacement, place
from coupling.place.placing import placing
from coupling.report.place_report import changes, map_figures
from coupling.report.style import style
from coupling.robot.differences import RobotDifference
from coupling.run.execute import loop_of
from coupling.run.models import Models, cell_of
from docs.scripts.experiment import Page, scratch
from docs.scripts.page import table
from docs.scripts.pictures import save
from docs.scripts.robots_with_backlash import EVEN, FANUC_HOME, with_backlash
from docs.scripts.runs import example

_UM = 1e6
# Backlash of the robots on which commands are replayed, over that of the model.
FACTORS = (0.8, 1.2)
PAGE = Page("place")
COMMON = {"optimise": "backlash", "cases": 1, "settings": 16_384}


def _fanuc() -> Case:
    free = {"x_m": [1.2, 2.2], "z_m": [0.2, 1.2], "base_roll_deg": [-6.0, 6.0]}
    return example(
        "cone",
        robot={
            "description": with_backlash(shipped_robots()["fanuc_r2000ic"], EVEN),
            "home_deg": FANUC_HOME,
        },
        part={"position_m": [1.8, 0.0, 0.5]},
        tool_path={"depth_m": 0.004},
        place=COMMON | free,
    )


def _robust() -> Case:
    """Return the cone as it is, with the ranges of cone_robust.toml."""
    free = example("cone_robust").resolved["place"]
    return example("cone", place=free | COMMON)


CASES: dict[str, Callable[[], Case]] = {
    "cone": _robust,
    "ISO 9283, 0.1 m/s": lambda: example("iso9283", place=COMMON | {"base_roll_deg": [-8.0, 8.0]}),
    "milling": lambda: example("milling_20000", place=COMMON | {"base_roll_deg": [-6.0, 6.0]}),
    "cone, FANUC": _fanuc,
}


@cache
def _placed(name: str) -> CasePlacement:
    case = CASES[name]()
    return place(placing(case, case.process), lambda own: own.process)


def _loaded(own: EvaluatedSetting, number: int) -> Case:
    file = scratch(f"placed_{number}.toml")
    file.write_text(own.content, encoding="utf-8")
    return load_case(file)


def _left(case: Case) -> list[tuple[float, float, float]]:
    """Return what the command leaves on robots with another backlash.

    Returns:
        Largest and rms distance from the path less their mean displacement, and the size of that mean
        [m], for each of `FACTORS`.
    """
    found = []
    with Models(case.fmu) as fmus:
        cell, models = cell_of(case.robots, fmus)
        correction = case.method.correct(loop_of(case, cell), case.motion)
        for factor in FACTORS:
            difference = RobotDifference({"backlash": (factor,)})
            others = [model.differing(difference, "another backlash") for model in models]
            path = cell.with_robots(others).simulate(
                correction.joints, correction.response.wrench, "dynamic"
            )
            away = path.position[0] - correction.desired.position[0]
            mean = away.mean(axis=0)
            size = np.linalg.norm(away - mean, axis=1)
            rms = float(np.sqrt(np.mean(size**2)))
            found.append((float(size.max()), rms, float(np.linalg.norm(mean))))
    return found


@PAGE.part
def cases() -> str:
    """Return the table of the cases as they are and as they are placed."""
    rows = []
    for name in CASES:
        found = _placed(name)
        result = figures_of(found)
        assert found.present is not None
        assert result.present is not None
        pairs = (
            (name, found.present, result.present),
            ("", found.best[0], result.best[0]),
        )
        for number, (title, own, figures) in enumerate(pairs):
            left = _left(_loaded(own, number))
            rows.append(
                (
                    title,
                    ("original", "placed")[number],
                    f"{_UM * figures.moved_m:.0f}",
                    changes(figures),
                    *(f"{_UM * largest:.1f} / {_UM * rms:.1f}" for largest, rms, _ in left),
                    f"{_UM * max(mean for *_, mean in left):.0f}",
                )
            )
    head = (
        *("", "", "process [um]", "backlash reversals (gear: times)"),
        *(f"backlash x {factor} [um]" for factor in FACTORS),
        "mean [um]",
    )
    return table(head, rows)


def _beside_each_other(figures: Sequence[go.Figure]) -> go.Figure:
    """Return maps as one picture of two columns, with a colour bar for each column."""
    rows = len(figures) // 2
    whole = make_subplots(
        rows,
        2,
        subplot_titles=[own.layout.title.text for own in figures],
        horizontal_spacing=0.16,
        vertical_spacing=0.16,
    )
    for k, own in enumerate(figures):
        place = {"row": k // 2 + 1, "col": k % 2 + 1}
        heat, *marks = own.data
        heat.update(showscale=k < 2, colorbar_x=(0.435, 1.015)[k % 2])
        whole.add_trace(heat, **place)
        for mark in marks:
            whole.add_trace(mark.update(showlegend=k == 0), **place)
        whole.update_xaxes(title=own.layout.xaxis.title, **place)
        whole.update_yaxes(title=own.layout.yaxis.title, **place)
    style(whole, 90 + 380 * rows)
    legend = {"orientation": "h", "y": 1.03, "yanchor": "bottom"}
    return whole.update_layout(width=1000, showlegend=True, margin_t=60, legend=legend)


@PAGE.part
def maps() -> str:
    """Draw the maps of the cone, and return their caption."""
    found = _placed("cone")
    result = figures_of(found)
    stored = StoredPlacement(result, found.maps)
    drawn = [own for own in stored.maps if (own.across, own.up) == ("x", "z")]
    save("place_cone", _beside_each_other(map_figures(result, drawn)))
    changing = drawn[-1].changing
    kept = np.mean(changing[np.isfinite(changing)] == 0.0)
    return (
        "*The cone's part in the plane of x and z. Above, tool and base of the case: gears reverse"
        " at any place of the part. Below, those of the best setting: no gear reverses at"
        f" {100.0 * kept:.0f} % of the places.*"
    )


if __name__ == "__main__":
    PAGE.write()
