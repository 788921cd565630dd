"""The report of a placement: a table of settings, and maps over the part's position."""

from __future__ import annotations

import html
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from coupling.errors import ResultError
from coupling.files.whole_file import write_whole
from coupling.place.console import REPORT, changes, in_words
from coupling.place.folder import StoredPlacement, read_placement
from coupling.place.part_map import PartMap
from coupling.report.colours import AFTER, BEFORE
from coupling.report.document import document
from coupling.report.style import style
from coupling.report.tables import table
from coupling.results.placement_result import PlacementResult

_UM = 1e6
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
    write_whole(target, place_page(stored), ResultError)
    return target


def place_page(stored: StoredPlacement) -> str:
    """Return the page of a placement as one self-contained HTML text."""
    figures, sections = stored.figures, []
    for across, up in dict.fromkeys((own.across, own.up) for own in stored.maps):
        maps = [own for own in stored.maps if (own.across, own.up) == (across, up)]
        title = f"The part in the plane of {across} and {up}"
        name = f"map_{across}{up}"
        sections.append((title, name, map_figures(figures, maps), _map_text(figures)))
    head = f"{_settings(figures)}{_gears(figures)}"
    return document(f"{figures.case}: place", head, sections)


def map_figures(figures: PlacementResult, maps: list[PartMap]) -> tuple[go.Figure, ...]:
    """Draw maps of one plane: for each setting displacement and exposure, each on one scale for all."""
    moved = "process" if figures.forced else "100 N"
    tops = [_top([own.moved for own in maps]), _top([own.exposure for own in maps])]
    drawn = []
    for own in maps:
        for values, what, top in zip(
            (own.moved, own.exposure), (moved, "backlash 20 % off"), tops, strict=True
        ):
            figure = go.Figure()
            figure.add_heatmap(
                x=own.first,
                y=own.second,
                z=_UM * values,
                zmin=0.0,
                zmax=top,
                colorscale="Viridis",
                colorbar={"title": "um", "thickness": 14},
                text=[
                    [_hint(own, i, j) for j in range(len(own.first))]
                    for i in range(len(own.second))
                ],
                hoverinfo="text",
            )
            _mark(figure, figures, own)
            figure.update_xaxes(title=f"{own.across} [m]")
            figure.update_yaxes(title=f"{own.up} [m]")
            title = {
                "text": f"{_SETTINGS.get(own.name, own.name)}: {what}",
                "font": {"size": 14},
                "x": 0.5,
            }
            drawn.append(style(figure, 420).update_layout(title=title, margin_t=46))
    return tuple(drawn)


def _top(values: list[np.ndarray]) -> float:
    """Return where the colours of maps end [um]: 95 % of their places are below."""
    flat = np.concatenate([_UM * each[np.isfinite(each)] for each in values])
    return max(float(np.quantile(flat, 0.95)), 1e-9) if len(flat) else 1.0


def _mark(figure: go.Figure, figures: PlacementResult, own: PartMap) -> None:
    """Mark where the part is, and where the best settings have it."""
    marks = [("best", [entry.setting for entry in figures.best[:1]], "star", AFTER)]
    marks.insert(0, ("as it is", [figures.present_setting], "x", BEFORE))
    for name, settings, symbol, color in marks:
        figure.add_scatter(
            x=[setting[f"{own.across}_m"] for setting in settings],
            y=[setting[f"{own.up}_m"] for setting in settings],
            mode="markers",
            marker={
                "symbol": symbol,
                "size": 13,
                "color": color,
                "line": {"color": "white", "width": 1.5},
            },
            name=name,
            showlegend=True,
        )


def _hint(own: PartMap, i: int, j: int) -> str:
    place = f"{own.across} {own.first[j]:.3f} m, {own.up} {own.second[i]:.3f} m"
    if not np.isfinite(own.moved[i, j]):
        return f"{place}: not possible"
    return (
        f"{place}: displacement {_UM * own.moved[i, j]:.0f} um, backlash {_UM * own.exposure[i, j]:.1f}"
        f" um, {own.changing[i, j]:.0f} gears reverse"
    )


def _settings(figures: PlacementResult) -> str:
    """Return a table of the settings."""
    rows = []
    for name, own in figures.named:
        words = in_words(own.setting, figures.free)
        margin = own.limit_margin_rad
        rows.append(
            (
                html.escape(name),
                f"{_UM * own.moved_m:.0f}",
                f"{_UM * own.exposure_m:.1f}",
                changes(own),
                f"{own.conditioning:.3f}",
                "-" if margin is None else f"{np.rad2deg(margin):.0f}",
                html.escape(words),
            )
        )
    moved = "process [um]" if figures.forced else "100 N [um]"
    header = (
        *("setting", moved, "backlash 20 % off [um]", "backlash reversals (gear: times)"),
        *("conditioning", "from joint limits [deg]", "what is free"),
    )
    lost = (
        "" if figures.present is not None else "<p>As it is, the robot cannot follow the path.</p>"
    )
    none = "" if figures.limited_joints else "<p>The robot file has no limits of its joints.</p>"
    return f"{lost}{table(header, rows)}<p>{_TABLE_TEXT}</p>{none}"


def _gears(figures: PlacementResult) -> str:
    """Return what the gears go through, as it is and at the best."""
    rows = [
        (
            html.escape(f"{name}, joint {gear.joint}"),
            f"{gear.backlash_reversals}",
            f"{gear.in_backlash_s:.1f}",
            f"{gear.margin_Nm:.0f}",
            f"{gear.swing_Nm:.0f}",
            f"{_UM * gear.backlash_20_percent_m:.0f}",
        )
        for name, own in figures.named[: 1 if figures.present is None else 2]
        for gear in own.gears
    ]
    header = (
        *("gear", "backlash reversals", "in backlash [s]", "clear of zero by [N m]", "swing [N m]"),
        "backlash 20 % off [um]",
    )
    return f"<h2>Gears</h2><p>{_GEARS_TEXT}</p>{table(header, rows)}"


def _map_text(figures: PlacementResult) -> str:
    what = "the process" if figures.forced else "100 N"
    return (
        "What each place of the part comes to with tool and base held as they are now, or as the best"
        f" setting holds them: displacement by {what}, and what backlashes that are 20 % off do at"
        " rest. White: out of reach, too near to a limit or to a singular posture. The colours end where"
        " 95 % of the places do."
    )


_TABLE_TEXT = (
    "Largest displacement of the tool by the process's wrench; what backlashes that are 20 % off do at"
    " rest at gears that may reverse, summed (in motion several times as much); backlash reversals"
    " along the whole path; distance from singular postures (1 over the norm of the inverse Jacobian,"
    " lengths in units of the reach)."
)
_GEARS_TEXT = (
    "From the torque that the links need along the whole path, with the inertia of starts and stops. A"
    " negative figure: the torque changes sign by so much."
)
