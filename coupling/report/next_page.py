"""The page of how a next command was found: passes, moves, convergence, causes, forecast."""

from __future__ import annotations

import html

import plotly.graph_objects as go

from coupling.report.colours import JOINTS
from coupling.report.document import document
from coupling.report.style import style
from coupling.report.tables import table
from coupling.results.next_result import NextResult, PathCorrectionResult

_UM = 1e6


def next_page(title: str, found: NextResult) -> str:
    """Return the page of a next command as one self-contained HTML text.

    Args:
        title: Which command, from what.
        found: Its figures, the content of next.json.
    """
    sections = [("What was measured", "passes", _distances(found), _PASSES_TEXT)]
    if found.correction is not None:
        sections.append(
            ("What is corrected along the path", "correction", _correction(found.correction), "")
        )
    head = _verdict(found) + _passes(found) + _moves(found) + _causes(found)
    return document(title, head, sections)


def _verdict(found: NextResult) -> str:
    forecast, worse = found.forecast, found.judgement.worse
    first, *rest = [html.escape(own) for own in found.sentences if not own.startswith("  ")]
    told = "" if forecast is None else f"<b>{html.escape(forecast.sentence)}.</b><br>"
    state = "no" if worse else "yes"
    lines = "".join(f"<p>{own}</p>" for own in rest if not own.startswith(("Pass ", "Beyond ")))
    return f'<p class="verdict {state}">{told}{first}</p>{lines}'


def _passes(found: NextResult) -> str:
    rows = []
    for number, own in enumerate(found.passes, start=1):
        size, forecast = own.size_m, own.forecast
        expected = "" if forecast is None else f"{_um(forecast.low)} to {_um(forecast.high)}"
        rows.append(
            (
                f"{number}",
                html.escape(own.measured),
                f"{_um(size.rms)} / {_um(size.maximum)}",
                f"{_um(size.rms_less_constant)} / {_um(size.maximum_less_constant)}",
                expected,
                _um(own.noise_m),
            )
        )
    header = (
        "pass",
        "measured",
        "rms / largest [um]",
        "less a constant [um]",
        "forecast of the rms [um]",
    )
    return f"<h2>Passes</h2>{table((*header, 'noise [um]'), rows)}"


def _moves(found: NextResult) -> str:
    key = "rms" if found.absolute else "rms_less_constant"
    words = {
        "path": "learning along the path",
        "parameters": "parameters",
        "both": "parameters, and learning along the path",
    }
    rows = [
        (
            words[own.kind],
            html.escape(own.robot),
            _um(getattr(own.left_m, key)),
            "yes" if own.predicted else "no, it was fitted to it",
        )
        for own in found.moves
    ]
    header = (
        "move",
        "robot",
        "leaves of the last pass, rms [um]",
        "forecast before it was measured",
    )
    return f"<h2>Moves</h2>{table(header, rows, 'words')}"


def _causes(found: NextResult) -> str:
    if not found.causes:
        return ""
    rows = [
        (_um(own.rms_m), html.escape(own.text.partition(" follow ")[2])) for own in found.causes
    ]
    return f"<h2>Beyond the model</h2>{table(('rms [um]', 'follows'), rows, 'words')}"


def _distances(found: NextResult) -> go.Figure:
    figure = go.Figure()
    passes = found.passes
    for number, own in enumerate(passes, start=1):
        color = JOINTS[
            (len(passes) - number) % len(JOINTS)
        ]  # that of the last pass is always the same
        figure.add_scatter(
            x=own.time,
            y=[_UM * value for value in own.distance_m],
            mode="lines",
            name=f"pass {number}: {own.measured}",
            line={"color": color, "width": 1.2},
        )
    figure.update_xaxes(title="time of the run [s]")
    figure.update_yaxes(title="distance from the desired path [um]", rangemode="tozero")
    return style(figure, 380)


def _correction(own: PathCorrectionResult) -> go.Figure:
    figure = go.Figure()
    for axis, color in zip("xyz", JOINTS, strict=False):
        figure.add_scatter(
            x=own.time,
            y=[_UM * row["xyz".index(axis)] for row in own.deviation_m],
            mode="lines",
            name=axis,
            line={"color": color, "width": 1.5},
        )
    figure.update_xaxes(title="time of the run [s]")
    figure.update_yaxes(title="beyond the model, base axes [um]")
    return style(figure, 320)


def _um(length: float) -> str:
    return f"{_UM * length:.3g}"


_PASSES_TEXT = (
    "Distance of the measured tool from its desired path, noise of the measurement included."
)
