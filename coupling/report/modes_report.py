"""The report of modes: whose they are, a table, responses, maps over the part."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
import plotly.graph_objects as go

from coupling.path.length_text import in_words
from coupling.report.colours import AFTER, BEFORE, GREEN, JOINTS
from coupling.report.lengths import words_if_known
from coupling.report.modes_scene import modes_scene
from coupling.report.result_report import ResultReport
from coupling.report.style import drawn, log_axis, row, rows
from coupling.results.modes_result import (
    Grid,
    ModesResult,
    PartModesResult,
    PlaceModesResult,
    ResponseResult,
)
from coupling.results.section import Answer, KeyFigure, NextStep, Note, Section, Table

# Metres per newton in micrometres per newton.
_UM_N = 1e6
# Modes that are named in brief.
_FEW = 4
# Force that tells how soft a robot is [N].
_PRESSED = 100.0
_COLOURS = dict(zip(("xx", "yy", "zz"), (AFTER, BEFORE, GREEN), strict=True))
_WHOSE = (
    "Modes with the motors locked, as friction holds them in small vibrations and as brakes do: the"
    " servos are no part of them. A moving axis, whose friction slips, gives way by its servo as well."
)
_NOTE = Note(
    "Direction: that in which the mode moves the TCP most, base axes. Joints: their shares in the"
    " elastic energy of the mode, gears with backlash on the flank that the load presses them to."
)
_RESPONSE = Note(
    "Displacement of the TCP by a force along the same axis of the base, magnitude and phase; measured"
    " responses as dots."
)
_PART = Note(
    "In the part's plane, with the tool held as on the nearest place of the path, under the force at the"
    " softest place. White: the robot cannot be there."
)


def modes_report(result: ModesResult) -> ResultReport:
    """Return what is told of a robot's modes."""
    return ResultReport(
        "modes",
        result.name,
        modes_answer(result),
        partial(_sections, result),
    )


def _sections(result: ModesResult) -> list[Section]:
    sections = _softest(result)
    figure = response_figure(
        [("", result.computed, "lines"), (", measured", result.measured, "markers")]
    )
    sections.append(Section("Frequency response at the TCP", [_RESPONSE], "response", [figure]))
    if len(result.places) > 1:
        sections.append(Section("Along the path", [], "path", [_along_path(result)]))
    if result.part is not None:
        sections.append(Section("Over the part", [_PART], "part", _maps(result.part)))
    return sections


def modes_answer(result: ModesResult) -> Answer:
    """Return the first screen of a robot's modes, which judge nothing."""
    softest = result.places[0]
    moved = None if softest.softest_m_N is None else _PRESSED * softest.softest_m_N
    slowest = f"{softest.modes[0].frequency_Hz:.3g} Hz" if softest.modes else "none"
    reason = (
        f"Under {result.loads}, with the motors locked, as brakes and small vibrations leave them."
    )
    if softest.modes:
        energy = softest.modes[0].energy_by_joint
        reason += f" Most of the slowest vibration is in joint {int(np.argmax(energy)) + 1}."
    if moved is None:
        joints = ", ".join(map(str, softest.unloaded_joints))
        soft = f"Gears of joints {joints} are free in their backlash, where nothing holds them"
    else:
        soft = f"{_PRESSED:.0f} N move the tool by up to {in_words(moved)}"
    robot = result.robot if result.swinging is None else result.swinging.description
    posture = ",".join(f"{angle + 0.0:.3g}" for angle in np.round(softest.posture_deg, 3).tolist())
    at_posture = [] if softest.time_s is not None else [f"--posture-deg={posture}"]
    return Answer(
        sentence=f"{soft}; the slowest vibration has {slowest}.",
        reason=reason,
        figures=(
            KeyFigure(
                f"Moved by {_PRESSED:.0f} N", words_if_known(moved), "at rest, where it is softest"
            ),
            KeyFigure(
                "In vibration",
                words_if_known(
                    None if softest.dynamic_m_N is None else _PRESSED * softest.dynamic_m_N
                ),
                f"moved by {_PRESSED:.0f} N that swing with {softest.dynamic_Hz:.3g} Hz",
            ),
            KeyFigure(
                "Slowest vibration",
                slowest,
                f"damping {100.0 * softest.modes[0].damping_ratio:.2g} %" if softest.modes else "",
            ),
        ),
        steps=(
            NextStep.by(
                "Measure with a hammer, and see both:",
                *("modes", result.source, *at_posture, "--measured", "hammer.csv"),
                *("-o", "results/modes_measured"),
            ),
            NextStep.by(
                "Put what was measured into the robot file:",
                *("identify", "hammer.csv", "--robot", robot, f"--posture-deg={posture}"),
            ),
        ),
        scene=None if result.swinging is None else modes_scene(result.swinging),
    )


def _softest(result: ModesResult) -> list[Section]:
    """Return whose modes they are, and those where the TCP is softest."""
    place = result.places[0]
    where = (
        "" if place.time_s is None else f" at t = {place.time_s:.3f} s, where the TCP is softest"
    )
    posture = ", ".join(f"{angle:.1f}" for angle in place.posture_deg)
    under = f"{result.robot} (torque curve {result.torque_curve}) under {result.loads}"
    columns = ("frequency [Hz]", "damping [%]", "direction x, y, z", "joints (share of the energy)")
    table = [
        (
            f"{mode.frequency_Hz:.2f}",
            f"{100.0 * mode.damping_ratio:.2f}",
            ", ".join(f"{part:+.2f}" for part in mode.tcp_direction),
            in_joints(mode.energy_by_joint),
        )
        for mode in place.modes
    ]
    return [
        Section("", [f"{_WHOSE}"]),
        Section(
            f"Modes of {under}",
            [
                f"Posture{where}: {posture} deg.",
                *compliance_sentences(place),
                *_remarks_on_unloaded(result.places),
            ],
        ),
        Section("", [_NOTE, Table(columns, table)]),
    ]


def modes_in_brief(places: Sequence[PlaceModesResult]) -> list[str]:
    """Return two lines on the modes along a path.

    Args:
        places: Places along it, that where the TCP is softest first.
    """
    place = places[0]
    modes = ", ".join(
        f"{mode.frequency_Hz:.1f} Hz ({100.0 * mode.damping_ratio:.1f} %,"
        f" joint {int(np.argmax(mode.energy_by_joint)) + 1})"
        for mode in place.modes[:_FEW]
    )
    lowest = f"Lowest modes with locked motors (damping, softest joint): {modes or 'none'}"
    return [
        f"{lowest}; at t = {place.time_s or 0.0:.3f} s, where the TCP is softest.",
        " ".join([*compliance_sentences(place), *_remarks_on_unloaded(places)]),
    ]


def compliance_sentences(place: PlaceModesResult) -> Iterator[str]:
    """Yield how soft the TCP is at rest and in vibration."""
    if place.unloaded_joints:
        joints = ", ".join(map(str, place.unloaded_joints))
        yield f"Gears of joints {joints} are unloaded in their backlash: at rest they resist nothing."
    elif place.softest_m_N is not None and place.softest_direction is not None:
        direction = ", ".join(f"{part:+.2f}" for part in place.softest_direction)
        text = f"Static compliance up to {_UM_N * place.softest_m_N:.3g} um/N"
        text += f" ({_per_um(place.softest_m_N)}) along ({direction}), base axes"
        if place.in_contact_m_N is not None:
            text += f"; with the process in contact {_UM_N * place.in_contact_m_N:.3g} um/N"
        yield f"{text}."
    if place.dynamic_m_N:
        yield (
            f"Dynamic compliance up to {_UM_N * place.dynamic_m_N:.3g} um/N at"
            f" {place.dynamic_Hz:.2f} Hz."
        )


def _remarks_on_unloaded(places: Sequence[PlaceModesResult]) -> list[str]:
    """Return a sentence where gears are unloaded in their backlash at some places of a path."""
    if not any(place.unloaded_joints for place in places[1:]):
        return []
    count = sum(bool(place.unloaded_joints) for place in places)
    joints = sorted({joint for place in places for joint in place.unloaded_joints})
    return [
        f"At {count} of {len(places)} places gears are unloaded in their backlash (joints"
        f" {', '.join(map(str, joints))})."
    ]


def _per_um(compliance: float) -> str:
    return f"{1.0 / (_UM_N * compliance):.3g} N/um" if compliance > 0.0 else "rigid"


def in_joints(shares: tuple[float, ...]) -> str:
    """Return the joints that give way in a mode, by their shares, most first.

    Example:
        >>> in_joints((0.05, 0.7, 0.25))
        'joint 2 70 %, joint 3 25 %'
    """
    order = np.argsort(shares)[::-1]
    return ", ".join(f"joint {k + 1} {100.0 * shares[k]:.0f} %" for k in order if shares[k] >= 0.1)


def response_figure(groups: Sequence[tuple[str, Sequence[ResponseResult], str]]) -> go.Figure:
    """Draw magnitude and phase of frequency responses.

    Args:
        groups: Words behind the names of responses, the responses, and "lines" or "markers".
    """
    axes = rows((3.0, 2.0), 0.06, [log_axis(title="compliance [um/N]"), {"title": "phase [deg]"}])
    axes["xaxis"].update(log_axis())
    axes["xaxis2"].update({**log_axis(), "title": "frequency [Hz]"})
    traces = []
    for words, responses, mode in groups:
        for response in responses:
            value = np.array(response.real_m_N) + 1j * np.array(response.imag_m_N)
            colour = _COLOURS.get(response.name, JOINTS[3])
            for number, shown in (
                (1, _UM_N * np.abs(value)),
                (2, np.rad2deg(np.angle(value))),
            ):
                traces.append(
                    {
                        **row(number),
                        "x": np.array(response.frequency_Hz),
                        "y": shown,
                        "mode": mode,
                        "name": f"{response.name}{words}",
                        "legendgroup": f"{response.name}{words}",
                        "showlegend": number == 1,
                        "line": {"color": colour, "width": 1.5},
                        "marker": {"color": colour, "size": 4},
                    }
                )
    return drawn(traces, 520, **axes)


def _along_path(result: ModesResult) -> go.Figure:
    places = sorted(result.places, key=lambda place: place.time_s or 0.0)
    count = min(min(len(place.modes) for place in places), 6)
    traces = [
        {
            "x": [place.time_s for place in places],
            "y": [place.modes[k].frequency_Hz for place in places],
            "mode": "lines",
            "name": f"mode {k + 1}",
            "line": {"color": JOINTS[k], "width": 1.5},
        }
        for k in range(count)
    ]
    return drawn(traces, 320, xaxis={"title": "time [s]"}, yaxis={"title": "frequency [Hz]"})


def _maps(part: PartModesResult) -> tuple[go.Figure, ...]:
    softest = [[None if v is None else _UM_N * v for v in line] for line in part.softest_m_N]
    return (
        part_map(
            part.x_m, part.y_m, tuple(map(tuple, softest)), "static compliance [um/N]", "um/N"
        ),
        part_map(part.x_m, part.y_m, part.lowest_Hz, "lowest mode [Hz]", "Hz"),
    )


def part_map(
    x: tuple[float, ...], y: tuple[float, ...], values: Grid, title: str, unit: str
) -> go.Figure:
    """Draw numbers over places of the part [m]; what is not there is white."""
    heat = {
        "type": "heatmap",
        "x": 1e3 * np.array(x),
        "y": 1e3 * np.array(y),
        "z": [[np.nan if v is None else v for v in line] for line in values],
        "colorscale": "Viridis",
        "colorbar": {"title": unit, "thickness": 14},
    }
    heading = {"text": title, "font": {"size": 14}, "x": 0.5}
    return drawn(
        [heat],
        420,
        margin={"t": 46},
        xaxis={"title": "x in the part [mm]"},
        yaxis={"title": "y in the part [mm]"},
        title=heading,
    )
