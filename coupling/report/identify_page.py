"""The report of an identification: arrows, residuals by pose, intervals, further parameters."""

from __future__ import annotations

import html

from coupling.report.document import document
from coupling.report.identify_figures import (
    agreement,
    amplification,
    arrows,
    intervals,
    label,
    residuals,
)
from coupling.report.tables import table
from coupling.results.identified_result import IdentifiedResult

_MM = 1e3


def identify_page(title: str, found: IdentifiedResult) -> str:
    """Return the page of an identification as one self-contained HTML text.

    Args:
        title: What was identified from what.
        found: Figures of the identification, the content of identified.json.
    """
    factor = amplification(found)
    sections = [
        (
            "Deflections, measured and predicted",
            "arrows",
            arrows(found, factor),
            _arrows_text(factor),
        ),
        ("Measured over predicted", "agreement", agreement(found), _AGREEMENT_TEXT),
        ("Residuals by pose", "residuals", residuals(found), _RESIDUALS_TEXT),
        ("Intervals", "intervals", intervals(found), _INTERVALS_TEXT),
    ]
    head = _verdict(found) + _sizes(found) + _parameters(found) + _warnings(found)
    return document(title, head, sections, _separability(found) + _further(found))


def _verdict(found: IdentifiedResult) -> str:
    state = "no" if found.refusal else "yes"
    words = f"Not written: {found.refusal}" if found.refusal else "Identified"
    kept = [label(p) for p in found.parameters if not p.identified]
    if kept and not found.refusal:
        words += f", except {', '.join(kept)}"
    return f'<p class="verdict {state}"><b>{html.escape(words)}.</b></p>'


def _sizes(found: IdentifiedResult) -> str:
    words = {
        "measured": "measured deflections",
        "start": "left by the start file",
        "fit": "left by the fit",
        "left_out": "rows predicted by a fit of all others (leave-one-out)",
        "written": "left by the robot as written",
    }
    rows = [(text, _size(getattr(found.rms_m, key))) for key, text in words.items()]
    return table((f"{found.rows} measurements", "rms over all components [mm]"), rows)


def _size(length: float | None) -> str:
    return "no rest found" if length is None else f"{_MM * length:.4f}"


def _parameters(found: IdentifiedResult) -> str:
    rows = [
        (
            html.escape(entry.name),
            "none" if entry.added else _number(entry.start),
            *map(_number, (entry.value, entry.low, entry.high)),
            _number(entry.written) if entry.identified else "kept",
            html.escape(entry.reason or (entry.support.in_words if entry.support else "")),
        )
        for entry in found.parameters
    ]
    header = ("parameter", "start", "fit", "95 % from", "to", "written", "")
    return f"<h2>Parameters</h2>{table(header, rows)}"


def _number(value: float | None) -> str:
    return "&infin;" if value is None else f"{value:.4g}"


def _warnings(found: IdentifiedResult) -> str:
    items = "".join(
        f"<li>{html.escape(text)}{'.' * (not text.endswith('?'))}</li>" for text in found.warnings
    )
    return f"<h2>Warnings</h2><ul>{items}</ul>" if items else ""


def _separability(found: IdentifiedResult) -> str:
    lines = [f"Condition of the columns, each of length 1: {_number(found.condition)}."]
    lines += [f"{name}: no measurement moves it." for name in found.without_effect]
    lines += [f"Not seen: {d.in_words} changes nothing measured." for d in found.unseen]
    lines += [f"Hardly seen (index {d.index:.0f}): {d.in_words}." for d in found.weak if d.index]
    lines += [
        f"Alike: {' and '.join(pair.names)}, cosine {pair.cosine:.4f}." for pair in found.alike
    ]
    return f"<h2>What can be told apart</h2><p>{'<br>'.join(map(html.escape, lines))}</p>"


def _further(found: IdentifiedResult) -> str:
    rows = [
        (
            html.escape(entry.name),
            f"{_number(entry.value)} {entry.unit}",
            html.escape(entry.in_words),
        )
        for entry in found.further
    ]
    return (
        f"<h2>Further parameters</h2>{_FURTHER_TEXT}{table(('', 'fit', 'tests'), rows)}"
        if rows
        else ""
    )


def _arrows_text(factor: int) -> str:
    return f"At each pose of the tool, {factor} times as large as they are."


_AGREEMENT_TEXT = "Displacements along the base axes."
_RESIDUALS_TEXT = (
    "How far the measured point is from where the robot predicts it; predicted by the fit of all rows,"
    " and by a fit of all rows but that one."
)
_INTERVALS_TEXT = (
    "Bars that run far to the right have no upper end: the data cannot tell the joint from a rigid"
    " one."
)
_FURTHER_TEXT = (
    "<p>Tilts and backlashes that the start file does not have, one at a time beside its own. Supported:"
    " an F test (5 % over the number of tests) and a smaller leave-one-out error, both.</p>"
)
