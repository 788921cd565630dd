"""A page of tables and figures in one file, which opens without a network."""

from __future__ import annotations

import base64
import gzip
import html
import json
import math
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go

from coupling.report.colours import ON_DARK
from coupling.report.scene_page import scene_html, scene_numbers
from coupling.results.scene import Scene
from coupling.results.section import Answer, Card, Note, Part, Section, Table

# Significant digits of what is drawn, seven: a millisecond in an hour.
_NUMBER = "%.7g"
_NOT_FINITE = re.compile("nan|-?inf")
# Level of gzip: 9 takes three times as long as 6 for a hundredth less.
_COMPRESSION = 6
_BROWSER = Path(__file__).with_name("browser")
_STYLE, _SCRIPT, _SCENE = (
    (_BROWSER / name).read_text(encoding="utf-8")
    for name in ("document.css", "document.js", "scene.js")
)
# Libraries of others, as web/ bundles them; their licences are beside them.
_THREE, _PLOTLY = "three.min.js", "plotly-cartesian.min.js"
_BY_OTHERS = (
    "<!-- three.js, (c) three.js authors, and plotly.js, (c) Plotly, Inc.: MIT licence,"
    " https://opensource.org/license/mit -->"
)


def document(title: str, sections: Iterable[Section], answer: Answer | None = None) -> str:
    """Return a self-contained HTML text.

    Figures, scenes and the libraries that draw them are compressed in it, and unpacked after what can be
    read is shown; what a figure's legend says is HTML above it.

    Args:
        title: Title, as plain text.
        answer: First screen, above them.
    """
    drawn: dict[str, go.Figure] = {}
    scenes: dict[str, Scene] = {}
    body = "" if answer is None else _answer(answer, scenes)
    for section in sections:
        heading = html.escape(section.title)
        fields = {
            f"{section.name}_{k + 1}" if k else section.name: f
            for k, f in enumerate(section.figures)
        }
        drawn |= fields
        cells = "".join(
            f"<div>{_legend(name, figure)}{_place(name, figure, heading)}</div>"
            for name, figure in fields.items()
        )
        shown = f"<h2>{heading}</h2>" if heading else ""
        shown += f"<div>{_section(section)}</div>"
        if section.scene is not None:
            name = f"{section.name or 'section'}_scene"
            scenes[name] = section.scene
            shown += scene_html(name, section.scene, heading)
        shown += f'<div class="figures">{cells}</div>' if cells else ""
        body += f"<section>{shown}</section>"
    title = html.escape(title)
    heading = f"<h1>{title}</h1>" if title else ""
    figures = _text({name: figure.to_plotly_json() for name, figure in drawn.items()})
    numbers = _text({name: scene_numbers(scene) for name, scene in scenes.items()})
    packed = {"figures": _pack(figures), "scenes": _pack(numbers)}
    packed |= {"three": _library(_THREE)} if scenes else {}
    packed |= {"plotly": _library(_PLOTLY)} if drawn else {}
    data = "".join(
        f'<script type="application/octet-stream" id="{name}">{text}</script>'
        for name, text in packed.items()
    )
    return (
        f'<!DOCTYPE html>{_BY_OTHERS}<html lang="en"><head><meta charset="utf-8">'
        f"<title>{title}</title>"
        '<meta name="generator" content="elastic-robot">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<link rel="icon" href="data:,"><style>{_STYLE}</style></head>'
        f"<body><main>{f'<h1>{title}</h1>' if title else ''}{_TROUBLE}{body}</main>{data}"
        f'<script type="application/json" id="colours">{json.dumps(ON_DARK)}</script>'
        f"<script>{_SCENE}{_SCRIPT}</script></body></html>"
    )


def _card(card: Card) -> str:
    """Return a result among others as HTML."""
    title, answer = html.escape(card.title), card.answer
    heading = f'<a href="{html.escape(card.target)}">{title}</a>' if card.target else title
    figures = "".join(
        f"<div><dt>{html.escape(figure.label)}</dt><dd>{html.escape(figure.value)}</dd></div>"
        for figure in answer.figures
    )
    picture = f'<figure class="thumb">{card.picture}</figure>' if card.picture else ""
    return (
        f'<article class="card"><h3>{heading}</h3>{picture}<p class="verdict {_state(answer.good)}">'
        f'{html.escape(answer.sentence)}</p><dl class="three">{figures}</dl></article>'
    )


def _state(good: bool | None) -> str:
    """Return the class of a verdict."""
    return {True: "yes", False: "no", None: "open"}[good]


def _answer(answer: Answer, scenes: dict[str, Scene]) -> str:
    """Return the first screen, and enter its scene."""
    reason = f"<p>{html.escape(answer.reason)}</p>" if answer.reason else ""
    figures = "".join(
        f"<div><dt>{html.escape(figure.label)}</dt><dd>{html.escape(figure.value)}</dd>"
        f"<dd>{html.escape(figure.note)}</dd></div>"
        for figure in answer.figures
    )
    steps = "".join(
        f"<li>{html.escape(step.words)}{_command(step.command)}</li>" for step in answer.steps
    )
    shown = f'<figure class="picture">{answer.picture}</figure>' if answer.picture else ""
    if answer.scene is not None:
        scenes["first_scene"] = answer.scene
        shown += scene_html("first_scene", answer.scene, "The robot along its path, in space")
    if not answer.sentence:
        return f"<section>{shown}</section>"
    verdict = f'<p class="verdict {_state(answer.good)}"><b>{html.escape(answer.sentence)}</b></p>'
    todo = f'<h2>What to do now</h2><ol class="steps">{steps}</ol>' if steps else ""
    return (
        f'<section class="answer"><div>{verdict}{reason}<dl class="three">{figures}</dl>{todo}</div>'
        f'<div class="shown">{shown}</div></section>'
    )


def _command(command: str) -> str:
    if not command:
        return ""
    text = html.escape(command)
    return f'<span class="command"><code>{text}</code><button type="button">Copy</button></span>'


def _section(section: Section) -> str:
    text = "".join(map(_part, section.parts))
    return (
        text
        if section.good is None
        else f'<div class="verdict {_state(section.good)}">{text}</div>'
    )


def _part(part: Part) -> str:
    """Return a sentence, a table, a note or a card as HTML."""
    if isinstance(part, Table):
        return _table(part)
    if isinstance(part, Card):
        return _card(part)
    note = part if isinstance(part, Note) else Note(part)
    text = html.escape(note.text)
    if note.as_it_stands:
        return f'<pre tabindex="0">{text}</pre>'
    return f'<p><a href="{note.target}">{text}</a></p>' if note.target else f"<p>{text}</p>"


def _table(table: Table) -> str:
    above = [
        f'<th scope="colgroup" colspan="{columns}">{html.escape(cell)}</th>'
        if cell
        else "<td></td>"
        for cell, columns in table.groups
    ]
    lines = [above] if above else []
    lines += [[f'<th scope="col">{html.escape(cell)}</th>' for cell in table.columns]]
    lines += [[f"<td>{html.escape(cell)}</td>" for cell in row] for row in table.rows]
    content = "".join(f"<tr>{chr(10).join(line)}</tr>" for line in lines)
    marked = f' class="{table.kind}"' if table.kind else ""
    return f'<div class="scroll" tabindex="0"><table{marked}>{content}</table></div>'


_TROUBLE = (
    "<noscript><p>The figures need JavaScript; the tables do not.</p></noscript>"
    '<p id="trouble" hidden>The figures cannot be drawn: they need a browser of 2023 or later.</p>'
)


@cache
def _library(name: str) -> str:
    return _pack((_BROWSER / name).read_text(encoding="utf-8"))


def _pack(text: str) -> str:
    # Without a time, so that the same page is the same bytes.
    packed = gzip.compress(text.encode(), _COMPRESSION, mtime=0)
    return base64.b64encode(packed).decode("ascii")


def _place(name: str, figure: go.Figure, heading: str) -> str:
    height = figure.layout.height or 400
    return (
        f'<div class="figure" id="{name}" role="img" aria-label="{heading}"'
        f' style="min-height: {height}px"></div>'
    )


def _legend(name: str, figure: go.Figure) -> str:
    """Return the names of a figure's traces as buttons that show and hide them."""
    entries: dict[str, list[int]] = {}
    for number, trace in enumerate(figure.data):
        if trace.name and (trace.legendgroup or trace.showlegend is not False):
            entries.setdefault(trace.legendgroup or trace.name, []).append(number)
    shown = {
        key: entry
        for key, entry in entries.items()
        if any(figure.data[k].showlegend is not False for k in entry)
    }
    if not shown:
        return ""
    items = ""
    for traces in shown.values():
        first = next(figure.data[k] for k in traces if figure.data[k].showlegend is not False)
        numbers = " ".join(map(str, traces))
        items += (
            f'<li><button type="button" aria-pressed="{_is_seen(first)}" data-figure="{name}"'
            f' data-traces="{numbers}">{_swatch(first)}{html.escape(str(first.name))}</button></li>'
        )
    if (figure.layout.meta or {}).get("log"):
        button = f'<button type="button" aria-pressed="false" data-log="{name}">log scale</button>'
        items += f"<li>{button}</li>"
    return f'<ul class="legend" aria-label="Curves, shown or hidden">{items}</ul>'


def _is_seen(trace: Any) -> str:
    """Return whether a trace is seen at first, as an attribute of its button."""
    return "false" if trace.visible == "legendonly" else "true"


_SHAPES = {
    "triangle-up": '<path d="M6 11L11 1L16 11Z"/>',
    "triangle-down": '<path d="M6 1L11 11L16 1Z"/>',
    "x": '<path d="M6 2L8 0L11 3.5L14 0L16 2L12.7 6L16 10L14 12L11 8.5L8 12L6 10L9.3 6Z"/>',
    "star": '<path d="M11 0L13 4.5H17L14 7.5L15 12L11 9.5L7 12L8 7.5L5 4.5H9Z"/>',
}


def _swatch(trace: Any) -> str:
    """Return a sample of a trace's line, marker or filled area."""
    line: Any = getattr(trace, "line", None)
    marker: Any = getattr(trace, "marker", None)
    mode = getattr(trace, "mode", None) or ("lines" if trace.type == "scatter" else "markers")
    filled = getattr(trace, "fill", None) not in (None, "none")
    inside = ""
    if filled:
        color = trace.fillcolor
        inside = '<rect y="2" width="22" height="8" stroke="none"/>'
    elif "lines" in mode:
        color = line.color
        dash = {"dot": "2 3", "dash": "6 4"}.get(line.dash or "", "none")
        inside = f'<path d="M0 6H22" stroke-width="2.5" stroke-dasharray="{dash}"/>'
    else:
        color = marker.color if marker is not None else None
        shape = _SHAPES.get(getattr(marker, "symbol", None) or "", '<circle cx="11" cy="6" r="4"/>')
        inside = f'<g stroke="none">{shape}</g>'
    light = color if isinstance(color, str) else "#333333"
    return (
        f'<svg width="22" height="12" aria-hidden="true"'
        f' style="--light: {light}; --dark: {ON_DARK.get(light, light)}">{inside}</svg>'
    )


def _text(value: Any) -> str:
    """Return a figure's content as JSON, numbers in as many digits as are seen."""
    if isinstance(value, dict):
        if "bdata" in value:
            flat = np.frombuffer(base64.b64decode(value["bdata"]), dtype=value["dtype"])
            shape = value.get("shape")
            sizes = [int(size) for size in str(shape).split(",")] if shape else [-1]
            return _text(flat.reshape(sizes))
        return f"{{{','.join(f'{json.dumps(key)}:{_text(item)}' for key, item in value.items())}}}"
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "f":
            return _numbers_text(value)
        if value.dtype.kind in "iu":
            return json.dumps(value.tolist(), separators=(",", ":"))
        value = list(value)
    if isinstance(value, list | tuple):
        return f"[{','.join(map(_text, value))}]"
    item = value.item() if isinstance(value, np.generic) else value
    if isinstance(item, float):
        return _NUMBER % item if math.isfinite(item) else "null"
    return json.dumps(item)


def _numbers_text(values: np.ndarray) -> str:
    """Return an array as JSON, all its numbers at once."""
    template = _NUMBER
    for size in reversed(values.shape):
        template = f"[{','.join([template] * size)}]"
    text = template % tuple(values.ravel().tolist())
    return text if np.isfinite(values).all() else _NOT_FINITE.sub("null", text)
