"""The report of a placement: a table of settings, and maps over the part's position."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from coupling.errors import ResultError
from coupling.place.folder import StoredPlacement, read_placement
from coupling.place.part_map import PartMap
from coupling.report.colours import AFTER, BEFORE
from coupling.report.document import document
from coupling.report.report_file import write_page
from coupling.report.section import Note, Part, Section, Table, warned
from coupling.report.style import UM, Keys, drawn
from coupling.results.placement_result import PlacementResult, SettingResult

# What the page is called.
REPORT = "report.html"
_SETTINGS = {"present": "held as now", "best": "held as the best"}


def write_place_report(folder: Path, file: Path | None = None) -> Path:
    """Write the report of a placement.

    Args:
        folder: The placement.
        file: File to write; report.html in the folder unless given.

    Returns:
        The file.

    Raises:
        ResultError: If the placement cannot be read or the report not written.
    """
    target, stored = file or folder / REPORT, read_placement(folder)
    write_page(target, place_page(stored), ResultError)
    return target


def place_page(stored: StoredPlacement) -> str:
    """Return the page of a placement as one self-contained HTML text."""
    figures, sections = stored.figures, []
    for across, up in dict.fromkeys((own.across, own.up) for own in stored.maps):
        maps = [own for own in stored.maps if (own.across, own.up) == (across, up)]
        title = f"Position of the part in the plane of {across} and {up}"
        drawn = map_figures(figures, maps)
        sections.append(Section(title, (_map_note(figures),), f"map_{across}{up}", drawn))
    return document(f"{figures.case}: place", [*place_summary(figures), _gears(figures), *sections])


def place_summary(figures: PlacementResult) -> list[Section]:
    """Return what the best settings come to."""
    rows = [
        (
            name,
            f"{UM * own.moved_m:.0f}",
            f"{UM * own.exposure_m:.1f}",
            changes(own),
            f"{own.conditioning:.3f}",
            "-" if own.limit_margin_rad is None else f"{np.rad2deg(own.limit_margin_rad):.0f}",
            in_words(own.setting, figures.free)
            + ("" if own.admitted else "; violates a limit of [place]"),
        )
        for name, own in figures.named
    ]
    moved = "process [um]" if figures.forced else "100 N [um]"
    header = (
        *("setting", moved, f"{figures.unknown} [um]", "backlash reversals (gear: times)"),
        *("conditioning", "margin to joint limits [deg]", "free variables"),
    )
    lost = "With the present setting the robot cannot follow the path."
    refused = ", ".join(f"{what} {count}" for what, count in figures.refused.items() if count)
    limits = "the robot file has no joint limits: check the joint angles yourself."
    parts: list[Part] = [
        *([lost] if figures.present is None else []),
        Table(header, rows),
        _TABLE,
        f"{figures.settings} settings evaluated. Refused of the {figures.filling} spread over the"
        f" ranges: {refused or 'none'}.",
    ]
    collisions = "Check robot, tool and part for collisions before you move the robot there."
    return [
        Section("", parts),
        *warned([] if figures.limited_joints else [limits]),
        Section("", [collisions]),
    ]


def changes(own: SettingResult) -> str:
    """Return which gears with backlash reverse how often, in words.

    Args:
        own: A setting in place.json.
    """
    said = [
        f"{gear.joint}: {gear.backlash_reversals}" for gear in own.gears if gear.backlash_reversals
    ]
    return ", ".join(said) or "none"


def in_words(setting: dict[str, float], free: Sequence[str]) -> str:
    """Return what is free in a setting, in words."""
    said = []
    for name in free:
        key, unit = (f"{name}_m", "m") if f"{name}_m" in setting else (f"{name}_deg", "deg")
        said.append(f"{name.replace('_', ' ')} {np.round(setting[key], 4):g} {unit}")
    return ", ".join(said)


def map_figures(figures: PlacementResult, maps: list[PartMap]) -> tuple[go.Figure, ...]:
    """Draw maps of one plane: for each setting displacement and exposure, each on one scale for all."""
    moved = "process" if figures.forced else "100 N"
    tops = [_top([own.deviation for own in maps]), _top([own.exposure for own in maps])]
    views = []
    for own in maps:
        for values, what, top in zip(
            (own.deviation, own.exposure), (moved, figures.unknown), tops, strict=True
        ):
            heat = {
                "type": "heatmap",
                "x": own.first,
                "y": own.second,
                "z": UM * values,
                "zmin": 0.0,
                "zmax": top,
                "colorscale": "Viridis",
                "colorbar": {"title": "um", "thickness": 14},
                "text": [
                    [_hint(own, i, j) for j in range(len(own.first))]
                    for i in range(len(own.second))
                ],
                "hoverinfo": "text",
            }
            text = f"{_SETTINGS.get(own.name, own.name)}: {what}"
            figure = drawn(
                [heat, *_marks(figures, own)],
                420,
                margin={"t": 46},
                xaxis={"title": f"{own.across} [m]"},
                yaxis={"title": f"{own.up} [m]"},
                title={"text": text, "font": {"size": 14}, "x": 0.5},
            )
            views.append(figure)
    return tuple(views)


def _top(values: list[np.ndarray]) -> float:
    """Return where the colours of maps end [um]: 95 % of their places are below."""
    flat = np.concatenate([UM * each[np.isfinite(each)] for each in values])
    return max(float(np.quantile(flat, 0.95)), 1e-9) if len(flat) else 1.0


def _marks(figures: PlacementResult, own: PartMap) -> list[Keys]:
    """Return where the part is, and where the best settings have it."""
    marks = [("best", [entry.setting for entry in figures.best[:1]], "star", AFTER)]
    marks.insert(0, ("as it is", [figures.present_setting], "x", BEFORE))
    line = {"color": "white", "width": 1.5}
    return [
        {
            "x": [setting[f"{own.across}_m"] for setting in settings],
            "y": [setting[f"{own.up}_m"] for setting in settings],
            "mode": "markers",
            "marker": {"symbol": symbol, "size": 13, "color": color, "line": line},
            "name": name,
            "showlegend": True,
        }
        for name, settings, symbol, color in marks
    ]


def _hint(own: PartMap, i: int, j: int) -> str:
    place = f"{own.across} {own.first[j]:.3f} m, {own.up} {own.second[i]:.3f} m"
    if not np.isfinite(own.deviation[i, j]):
        return f"{place}: not possible"
    return (
        f"{place}: displacement {UM * own.deviation[i, j]:.0f} um, gears {UM * own.exposure[i, j]:.1f}"
        f" um, {own.changing[i, j]:.0f} gears reverse"
    )


def _gears(figures: PlacementResult) -> Section:
    """Return what the gears go through, as it is and at the best."""
    slips = "hysteresis" in figures.unknown
    rows = [
        (
            f"{name}, joint {gear.joint}",
            f"{gear.backlash_reversals}",
            f"{gear.in_backlash_s:.1f}",
            f"{gear.margin_Nm:.0f}",
            f"{gear.swing_Nm:.0f}",
            f"{UM * gear.backlash_20_percent_m:.0f}",
            *([f"{UM * (gear.hysteresis_30_percent_m or 0.0):.0f}"] if slips else []),
        )
        for name, own in figures.named[: 1 if figures.present is None else 2]
        for gear in own.gears
    ]
    header = (
        *(
            "gear",
            "backlash reversals",
            "in backlash [s]",
            "margin to reversal [N m]",
            "torque range [N m]",
        ),
        "backlash 20 % off [um]",
        *(["hysteresis 30 % off [um]"] if slips else []),
    )
    return Section("Gears", (_GEARS, Table(header, rows)))


def _map_note(figures: PlacementResult) -> Note:
    what = "the process" if figures.forced else "100 N"
    return Note(
        "Positions of the part, with the other variables of the present or of the best setting:"
        f" displacement by {what}, and effect of {figures.unknown} of the gears at rest. White: out"
        " of reach, too near to a limit or to a singular posture. The colour scale ends at the 95 %"
        " quantile."
    )


_TABLE = Note(
    "Largest displacement of the tool by the process's wrench; sum of the effects at rest of an"
    " error of 20 % of the backlash of gears that may reverse (in motion several times as much) and"
    " of 30 % of the slip torques of hysteresis; backlash reversals along the whole path;"
    " conditioning (1 over the norm of the inverse Jacobian, lengths in units of the reach)."
)
_GEARS = Note(
    "From the torque of the links along the whole path, including starts and stops. A negative"
    " margin: the torque changes its sign by that much."
)
