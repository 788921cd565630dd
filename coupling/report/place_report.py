"""The report of a placement: a table of settings, and maps over the part's position."""

from __future__ import annotations

from functools import partial

import numpy as np
import plotly.graph_objects as go

from coupling.path.length_text import format_um, in_words
from coupling.place.folder import StoredPlacement
from coupling.place.part_map import PartMap
from coupling.report.bars import bars
from coupling.report.colours import AFTER, BEFORE
from coupling.report.expected import expected_words
from coupling.report.lengths import state_tolerance
from coupling.report.report_file import name_path
from coupling.report.result_report import ResultReport
from coupling.report.style import Keys, drawn
from coupling.results.cut_result import WILL_CHATTER, CutStability
from coupling.results.placement_result import PlacementResult, SettingResult
from coupling.results.section import (
    UM,
    Answer,
    KeyFigure,
    NextStep,
    Note,
    Part,
    Section,
    Table,
    warned,
)

_SETTINGS = {"present": "held as now", "best": "held as the best"}


def place_report(stored: StoredPlacement) -> ResultReport:
    """Return what is told of a placement."""
    figures = stored.figures
    return ResultReport(
        "place",
        figures.case,
        place_answer(stored),
        partial(_sections, stored),
        warnings=warned(place_warnings(figures)),
    )


def _sections(stored: StoredPlacement) -> list[Section]:
    figures, sections = stored.figures, []
    for across, up in dict.fromkeys(part_map.axes.plane for part_map in stored.maps):
        maps = [part_map for part_map in stored.maps if part_map.axes.plane == (across, up)]
        title = f"Position of the part in the plane of {across} and {up}"
        drawn = map_figures(figures, maps)
        sections.append(Section(title, (_map_note(figures),), f"map_{across}{up}", drawn))
    return [_settings(figures), _gears(figures), *sections]


def place_answer(stored: StoredPlacement) -> Answer:
    """Return the first screen of a placement."""
    figures, folder = stored.figures, name_path(stored.folder)
    best, present = figures.best[0], figures.present
    where = best.in_words(figures.free)
    chatters = best.stability is not None and not best.stability.stable
    tolerance, placed_case = figures.tolerance_m, f"{folder}/{best.file}"
    fits = _fits(best, tolerance)
    good = fits if best.admitted and not chatters else False
    allowed = "" if tolerance is None else f"; your tolerance is {in_words(tolerance)}"
    settings = {"as it is": present, "there": best}
    known = {name: setting for name, setting in settings.items() if setting is not None}
    causes: dict[str, dict[str, float | None]] = {
        "expected": {
            n: None if s.expected is None else s.expected.maximum for n, s in known.items()
        },
        "process": {name: setting.moved_m for name, setting in known.items()},
        "gears": {name: setting.exposure_m for name, setting in known.items()},
    }
    if not best.admitted:
        sentence = "NO PLACE FOUND that keeps all limits of [place]; the least bad one follows."
    elif chatters:
        sentence = f"{WILL_CHATTER} No place was found where it does not."
    elif fits is False:
        sentence = f"NOT GOOD ENOUGH: even at the best place {_remaining(best)}{allowed}."
    elif present is None:
        sentence = (
            "PLACE FOUND: as it is, the robot cannot follow the path; there it can:"
            f" {_remaining(best)}{allowed}."
        )
    elif best.cost_m < present.cost_m:
        as_it_is = in_words(present.exposure_m)
        if best.expected is not None and present.expected is not None:
            as_it_is = expected_words(present.expected)
        sentence = f"BETTER PLACE FOUND: there {_remaining(best)}; as it is {as_it_is}{allowed}."
    else:
        sentence = (
            f"LEAVE IT WHERE IT IS: no better place was found, and {_remaining(best)}{allowed}."
        )
    return Answer(
        sentence=sentence,
        reason=f"There: {where}.{f' {best.stability.sentence}.' if best.stability is not None else ''}",
        good=good,
        figures=(
            _expected_there(best, present),
            KeyFigure(
                "Moved by the process" if figures.forced else "Moved by 100 N",
                in_words(best.moved_m),
                "there" if present is None else f"there; as it is {in_words(present.moved_m)}",
            ),
            KeyFigure(
                "To the nearest joint limit",
                f"{np.rad2deg(best.limit_margin_rad):.3g} deg"
                if np.isfinite(best.limit_margin_rad)
                else "no limit",
                "there",
            ),
        ),
        steps=[
            NextStep("Check robot, tool and part for collisions there."),
            *([] if tolerance is not None else [state_tolerance(placed_case)]),
            NextStep.by("Find a depth and speed that do not chatter:", "stability", placed_case)
            if chatters
            else NextStep.by("Correct the command:", "compensate", placed_case),
        ],
        picture=bars(
            [
                (f"{cause}, {place}", length)
                for cause, lengths in causes.items()
                for place, length in lengths.items()
            ],
            tolerance,
        ),
    )


def _fits(setting: SettingResult, tolerance: float | None) -> bool | None:
    """Return whether a tolerance [m] will be kept; None where that is open."""
    if tolerance is None:
        return None
    if setting.exposure_m > tolerance:
        return False
    return None if setting.expected is None else setting.expected.fits(tolerance)


def _remaining(setting: SettingResult) -> str:
    """Return what a corrected command leaves in a setting, in words."""
    if setting.expected is None:
        return f"gears that are not known well leave {in_words(setting.exposure_m)}"
    return f"a corrected command is expected to leave {expected_words(setting.expected)}"


def _expected_there(best: SettingResult, present: SettingResult | None) -> KeyFigure:
    """Return what a corrected command leaves at the best place, beside that as it is."""
    if best.expected is None:
        note = "at rest, in motion several times as much"
        return KeyFigure("By unknown gears", in_words(best.exposure_m), note)
    now = None if present is None else present.expected
    note = "" if now is None else f"; as it is {expected_words(now)}"
    return KeyFigure("Expected after", expected_words(best.expected), f"on the real robot{note}")


def _settings(figures: PlacementResult) -> Section:
    """Return what the best settings come to."""
    rows = [
        (
            name,
            format_um(setting.moved_m),
            format_um(setting.exposure_m),
            changes(setting),
            f"{setting.conditioning:.3f}",
            "-"
            if np.isinf(setting.limit_margin_rad)
            else f"{np.rad2deg(setting.limit_margin_rad):.0f}",
            setting.in_words(figures.free)
            + ("" if setting.admitted else "; violates a limit of [place]"),
        )
        for name, setting in figures.settings_by_name
    ]
    load = "process [um]" if figures.forced else "100 N [um]"
    header = (
        *("setting", load, f"{figures.unknown} [um]", "backlash reversals (gear: times)"),
        *("conditioning", "margin to joint limits [deg]", "free variables"),
    )
    lost = "With the present setting the robot cannot follow the path."
    refused = ", ".join(f"{what} {count}" for what, count in figures.refused.items() if count)
    parts: list[Part] = [
        *([lost] if figures.present is None else []),
        Table(header, rows),
        _TABLE,
        f"{figures.settings} settings evaluated. Refused of the {figures.filling} spread over the"
        f" ranges: {refused or 'none'}.",
    ]
    collisions = "Check robot, tool and part for collisions before you move the robot there."
    parts += [f"{name}: {cut.sentence}." for name, cut in _cuts(figures) if cut.stable]
    return Section("", [*parts, collisions])


def place_warnings(figures: PlacementResult) -> list[str]:
    """Return the warnings of a placement."""
    chatter = [f"{name}: {cut.sentence}." for name, cut in _cuts(figures) if not cut.stable]
    limits = "the robot file has no joint limits: check the joint angles yourself."
    return [*chatter, *([] if figures.limited_joints else [limits])]


def _cuts(figures: PlacementResult) -> list[tuple[str, CutStability]]:
    return [(name, s.stability) for name, s in figures.settings_by_name if s.stability]


def changes(setting: SettingResult) -> str:
    """Return which gears with backlash reverse how often, in words.

    Args:
        setting: A setting in place.json.
    """
    said = [f"{gear.joint}: {gear.reversals}" for gear in setting.gears if gear.reversals]
    return ", ".join(said) or "none"


def map_figures(figures: PlacementResult, maps: list[PartMap]) -> tuple[go.Figure, ...]:
    """Draw maps of one plane: for each setting displacement and exposure, each on one scale for all."""
    load = "process" if figures.forced else "100 N"
    tops = [
        _top([part_map.deviation for part_map in maps]),
        _top([part_map.exposure for part_map in maps]),
    ]
    views = []
    for part_map in maps:
        for values, what, top in zip(
            (part_map.deviation, part_map.exposure), (load, figures.unknown), tops, strict=True
        ):
            heat = {
                "type": "heatmap",
                "x": part_map.first,
                "y": part_map.second,
                "z": UM * values,
                "zmin": 0.0,
                "zmax": top,
                "colorscale": "Viridis",
                "colorbar": {"title": "um", "thickness": 14},
                "text": [
                    [_hint(part_map, i, j) for j in range(len(part_map.first))]
                    for i in range(len(part_map.second))
                ],
                "hoverinfo": "text",
            }
            text = f"{_SETTINGS.get(part_map.axes.setting, part_map.axes.setting)}: {what}"
            figure = drawn(
                [heat, *_marks(figures, part_map)],
                420,
                margin={"t": 46},
                xaxis={"title": f"{part_map.axes.across} [m]"},
                yaxis={"title": f"{part_map.axes.up} [m]"},
                title={"text": text, "font": {"size": 14}, "x": 0.5},
            )
            views.append(figure)
    return tuple(views)


def _top(values: list[np.ndarray]) -> float:
    """Return where the colours of maps end [um]: 95 % of their places are below."""
    flat = np.concatenate([UM * each[np.isfinite(each)] for each in values])
    return max(float(np.quantile(flat, 0.95)), 1e-9) if len(flat) else 1.0


def _marks(figures: PlacementResult, part_map: PartMap) -> list[Keys]:
    """Return where the part is, and where the best settings have it."""
    marks = [("best", [entry.setting for entry in figures.best[:1]], "star", AFTER)]
    marks.insert(0, ("as it is", [figures.present_setting], "x", BEFORE))
    line = {"color": "white", "width": 1.5}
    return [
        {
            "x": [setting[f"{part_map.axes.across}_m"] for setting in settings],
            "y": [setting[f"{part_map.axes.up}_m"] for setting in settings],
            "mode": "markers",
            "marker": {"symbol": symbol, "size": 13, "color": color, "line": line},
            "name": name,
            "showlegend": True,
        }
        for name, settings, symbol, color in marks
    ]


def _hint(part_map: PartMap, i: int, j: int) -> str:
    across, up = part_map.axes.plane
    place = f"{across} {part_map.first[j]:.3f} m, {up} {part_map.second[i]:.3f} m"
    if not np.isfinite(part_map.deviation[i, j]):
        return f"{place}: not possible"
    return (
        f"{place}: displacement {format_um(part_map.deviation[i, j])} um, gears"
        f" {format_um(part_map.exposure[i, j])} um, {part_map.changing[i, j]:.0f} gears reverse"
    )


def _gears(figures: PlacementResult) -> Section:
    """Return what the gears go through, as it is and at the best."""
    slips = "hysteresis" in figures.unknown
    rows = [
        (
            f"{name}, joint {gear.joint}",
            f"{gear.reversals}",
            f"{gear.in_backlash:.1f}",
            f"{gear.margin:.0f}",
            f"{gear.swing:.0f}",
            format_um(gear.backlash_error),
            *([format_um(gear.hysteresis_error or 0.0)] if slips else []),
        )
        for name, setting in figures.settings_by_name[: 1 if figures.present is None else 2]
        for gear in setting.gears
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
