"""The report of an identification: arrows, residuals by pose, intervals, further parameters."""

from __future__ import annotations

from math import hypot

import numpy as np
import plotly.graph_objects as go

from coupling.report.colours import AFTER, BEFORE
from coupling.report.parameter_table import in_digits, parameter_table
from coupling.report.style import drawn
from coupling.results.identified_result import IdentifiedResult
from coupling.results.scene import Scene, SceneLine
from coupling.results.section import Note, Section, Table

_MM = 1e3


def deflection_sections(result: IdentifiedResult) -> list[Section]:
    """Return what was identified from deflections."""
    factor = amplification(result)
    enlarged = Note(f"Deflections at each pose of the tool, enlarged {factor} times.")
    return [
        _sizes(result),
        *_loops(result),
        Section("Parameters", [_parameters(result)]),
        _separability(result),
        *_further(result),
        Section(
            "Deflections, measured and predicted",
            [enlarged],
            "arrows",
            scene=arrows(result, factor),
        ),
        Section("Residuals by pose", [_RESIDUALS], "residuals", [residuals(result)]),
    ]


def _sizes(result: IdentifiedResult) -> Section:
    words = {
        "measured": "measured deflections",
        "start": "residual of the start file",
        "fit": "residual of the fit",
        "left_out": f"leave-one-out: {'loops' if result.loops else 'rows'} predicted by a fit of all"
        " others",
        "written": "residual of the robot file as written",
    }
    rows = [(text, _size(getattr(result.rms_m, key))) for key, text in words.items()]
    worst = ", ".join(_worst(result, name) for name in result.worst)
    sizes = Table((f"{result.rows} measurements", "rms over all components [mm]"), rows)
    return Section("", [sizes, f"Largest leave-one-out errors: {worst}."])


def _loops(result: IdentifiedResult) -> list[Section]:
    """Return the errors of loading loops, and what hysteresis is worth."""
    if not result.loops:
        return []
    rows = [
        (str(loop.number), *map(_size, (loop.fit_m, loop.left_out_m, loop.without_hysteresis_m)))
        for loop in result.loops
    ]
    columns = ("loop", "fit", "leave-one-out", "leave-one-out without hysteresis")
    return [Section("Loops, rms over all components [mm]", [_LOOPS, Table(columns, rows)])]


def _worst(result: IdentifiedResult, name: str) -> str:
    (first, *_) = (row for row in result.measurements if row.name == name)
    return f"{name} ({_MM * hypot(*first.left_out_error[:3]):.4g} mm)"


def _size(length: float | None) -> str:
    return "no equilibrium" if length is None else f"{_MM * length:.4f}"


def _parameters(result: IdentifiedResult) -> Table:
    supports = [parameter.support for parameter in result.parameters]
    remarks = [support.in_words if support else "" for support in supports]
    return parameter_table(result.parameters, remarks)


def _separability(result: IdentifiedResult) -> Section:
    lines = [f"Condition number of the normalised sensitivities: {in_digits(result.condition)}."]
    lines += [f"{name}: no effect on any measurement." for name in result.without_effect]
    lines += [
        f"Not identifiable: {d.in_words} has no effect on any measurement." for d in result.unseen
    ]
    lines += [
        f"Poorly identifiable (condition index {d.index:.0f}): {d.in_words}."
        for d in result.weak
        if d.index
    ]
    lines += [
        f"Correlated: {' and '.join(pair.names)}, cosine {pair.cosine:.4f}."
        for pair in result.alike
    ]
    return Section("Identifiability", lines)


def _further(result: IdentifiedResult) -> list[Section]:
    """Return tilts and backlashes that were tested, those that the data support first."""
    if not result.further:
        return []
    tested = sorted(result.further, key=lambda f: (not f.supported, f.left_out_change or 0.0))
    rows = [
        (entry.name, f"{in_digits(entry.value)} {entry.unit}", entry.in_words) for entry in tested
    ]
    count = sum(entry.supported for entry in tested)
    table = Table(("", "fit", "tests"), rows)
    if result.loops:
        return [Section("Further parameters", [_NO_HYSTERESIS, table])]
    text = f"The data support {count} of {len(rows)}, one by one (--add NAME, or --add supported)."
    return [Section("Further parameters", [text, _FURTHER, table])]


_RESIDUALS = Note(
    "Distance of the measured point from its prediction by the fit of all rows, and by a fit of all"
    " other rows."
)
_LOOPS = Note(
    "Leave-one-out: predicted by a fit of all other loops; last column: with gears without hysteresis."
)
_NO_HYSTERESIS = "Gears whose loops show no hysteresis get no elements."
_FURTHER = Note(
    "Tilts and backlashes that the start file does not have, each added alone. Supported: a significant"
    " F test (5 % over the number of tests) and a smaller leave-one-out error."
)


def amplification(result: IdentifiedResult) -> int:
    """Return a round factor that makes the largest deflection about a quarter of the poses' extent."""
    _, place, measured, _ = _rows(result)
    largest = np.linalg.norm(measured, axis=1).max()
    size = max(float(np.ptp(place, axis=0).max()), 0.5)
    if not largest > 0.0:
        return 1
    factor = max(size / 4.0 / largest, 1.0)
    digit = 10.0 ** np.floor(np.log10(factor))
    return int(digit * max(d for d in (1, 2, 5) if d * digit <= factor))


def arrows(result: IdentifiedResult, factor: int) -> Scene:
    """Return measured and predicted deflections where the tool was, amplified."""
    _, place, measured, predicted = _rows(result)
    gaps = np.full_like(place, np.nan)
    return Scene(
        lines=[
            SceneLine(
                words,
                color,
                np.stack([place, place + factor * deflection, gaps], axis=1).reshape(-1, 3),
            )
            for words, deflection, color in (
                ("measured", measured, BEFORE),
                ("predicted", predicted, AFTER),
            )
        ]
    )


# Most measurements that are named on the axis of a narrow page.
_NAMED = 22


def residuals(result: IdentifiedResult) -> go.Figure:
    """Distance of measured from predicted by row, and predicted without that row."""
    names, _, measured, predicted = _rows(result)
    left_out_errors = result.displacements("left_out_error")[:, :3]
    traces = []
    labels = [f"{k + 1}: {name}" for k, name in enumerate(names)]  # names may come twice
    for words, errors, color in (
        ("fit of all rows", measured - predicted, AFTER),
        ("left out: fit of the others", left_out_errors, BEFORE),
    ):
        size = _MM * np.linalg.norm(errors, axis=1)
        detail = [", ".join(f"{_MM * value:+.3f}" for value in error) for error in errors]
        bars = {
            "type": "bar",
            "x": labels,
            "y": size,
            "name": words,
            "marker": {"color": color},
            "text": detail,
            "textposition": "none",
            "hovertemplate": "%{x}: %{y:.3f} mm (%{text})",
        }
        traces.append(bars)
    every = -(-len(names) // _NAMED)
    ticks = {"ticktext": names[::every], "tickvals": labels[::every], "tickangle": -90}
    across, up = {"title": "measurement", **ticks}, {"title": "distance [mm]"}
    return drawn(traces, 440, xaxis=across, yaxis=up, barmode="group")


def _rows(result: IdentifiedResult) -> tuple[list[str], np.ndarray, np.ndarray, np.ndarray]:
    """Return names, places, measured and predicted displacements [m] of all rows."""
    place, measured, predicted = (
        result.displacements(key)[:, :3] for key in ("position_m", "measured", "predicted")
    )
    return [row.name for row in result.measurements], place, measured, predicted
