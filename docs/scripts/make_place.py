"""Write the tables and the picture of docs/place.md: make place.

Cases as they are and where elastic-robot place puts them; commands on robots with another backlash.
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
from coupling.path.deviation import Deviation
from coupling.place.evaluated_setting import EvaluatedSetting
from coupling.place.folder import figures_of
from coupling.place.place import CasePlacement, place
from coupling.place.placing import placing
from coupling.report.place_report import changes, map_figures
from coupling.report.style import style
from coupling.run.execute import run_compensation
from docs.scripts.experiment import Page, scratch
from docs.scripts.page import table
from docs.scripts.pictures import save
from docs.scripts.robots_with_backlash import EVEN, FANUC_HOME, with_backlash
from docs.scripts.runs import example, replays

_UM = 1e6
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


def _less_constant(deviation: Deviation) -> str:
    figures = (deviation.maximum_less_constant, deviation.rms_less_constant)
    return " / ".join(f"{_UM * figure:.1f}" for figure in figures)


def _mean(deviation: Deviation) -> float:
    """Return the size of the mean deviation over time, as a vector [m]."""
    return float(np.sqrt(deviation.rms**2 - deviation.rms_less_constant**2))


@PAGE.part
def cases() -> str:
    """Return the table of the cases as they are and as they are placed."""
    rows = []
    for name in CASES:
        placed = _placed(name)
        present, best = figures_of(placed).present, figures_of(placed).best[0]
        assert placed.present is not None
        assert present is not None
        pairs = ((placed.present, present), (placed.best[0], best))
        for number, (setting, figures) in enumerate(pairs):
            others = replays(run_compensation(_loaded(setting, number)))
            backlash = [others[f"backlash {sign}20 %"] for sign in "-+"]
            rows.append(
                (
                    "" if number else name,
                    ("original", "placed")[number],
                    f"{_UM * figures.moved_m:.0f}",
                    changes(figures),
                    *map(_less_constant, backlash),
                    f"{_UM * max(map(_mean, backlash)):.0f}",
                )
            )
    head = (
        *("", "", "process [um]", "backlash reversals (gear: times)"),
        *(f"backlash x {factor} [um]" for factor in (0.8, 1.2)),
        "mean [um]",
    )
    return table(head, rows)


def _beside_each_other(figures: Sequence[go.Figure]) -> go.Figure:
    """Return maps as one picture of two columns, with a colour bar for each column."""
    rows, titles = len(figures) // 2, [own.layout.title.text for own in figures]
    gaps = {"horizontal_spacing": 0.16, "vertical_spacing": 0.16}
    whole = make_subplots(rows, 2, subplot_titles=titles, **gaps)
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
    drawn = [own for own in found.maps if own.axes.plane == ("x", "z")]
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
