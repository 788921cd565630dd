"""A page of figures: the plotly.js in it can draw them, and holds little else."""

from __future__ import annotations

import base64
import gzip
import html
import re

import plotly.graph_objects as go
import pytest
from browser import NEEDS_CHROMIUM, chromium, opened
from plotly.offline import get_plotlyjs

from coupling.cli.console import console
from coupling.report import plotly_js as module
from coupling.report.document import document
from coupling.report.plotly_js import plotly_js
from coupling.report.section import Note, Section, Table, warned
from coupling.report.terminal import print_sections

IN_SPACE = {"x": [0.0, 1.0, 0.0], "y": [0.0, 0.0, 1.0], "z": [0.0, 0.0, 1.0]}
# One figure of each kind of trace in our pages, and the marks that it leaves.
DRAWN = {
    "scatter": (go.Scatter(x=[0.0, 1.0], y=[0.0, 1.0]), ".js-line"),
    "bar": (go.Bar(x=[0.0, 1.0], y=[2.0, 1.0]), ".bars path"),
    "heatmap": (go.Heatmap(z=[[0.0, 1.0], [2.0, 3.0]]), ".heatmaplayer image"),
    "mesh3d": (go.Mesh3d(**IN_SPACE, i=[0], j=[1], k=[2]), "canvas"),
    "scatter3d": (go.Scatter3d(**IN_SPACE), "canvas"),
}


def page(*kinds: str) -> str:
    figures = [go.Figure(DRAWN[kind][0]) for kind in kinds]
    return document("Figures", [Section("", [], "figure", figures)])


def test_terminal_and_page_tell_the_same_and_the_page_says_how_to_read_it():
    table = Table(
        ("gear", "max"), [("joint 1", "< 0.25"), ("joint 2", "12")], groups=[("", 1), ("after", 1)]
    )
    sections = [
        Section("", ["NOT CONVERGED: [um] & more.", "A second sentence."], good=False),
        Section("Gears", ["One of them.", table, Note("How to read it.")]),
        *warned(["it is hot"], ["it is late"]),
    ]
    with console.capture() as told:
        print_sections(console, sections)
    said, text = told.get(), html.unescape(document("", sections))
    cells = ("[um] & more.", "second", "Gears", "One of", "joint 1", "< 0.25", "12", "after")
    for words in (*cells, "Warning: it is hot", "Remark: it is late"):
        assert (words in said, words in text) == (True, True), words
    assert ("How to read" in said, "How to read" in text) == (False, True)
    assert '<p class="verdict no"><b>NOT CONVERGED' in text


def plotly_in(text: str) -> str:
    """Return the plotly.js of a page."""
    (packed,) = re.findall(r'id="plotly">([^<]*)<', text)
    return gzip.decompress(base64.b64decode(packed)).decode()


def test_a_page_holds_what_it_draws_and_little_else():
    whole = get_plotlyjs()
    assert len(plotly_in(page("scatter", "bar", "heatmap"))) < 0.35 * len(whole)
    assert len(plotly_in(page("scatter", "mesh3d"))) < 0.6 * len(whole)


def test_the_licence_stays():
    assert "Licensed under the MIT license" in plotly_in(page("bar"))[:300]


@pytest.mark.parametrize(
    "other", ["", "plotly.register([a(),b()]);return c();})();", get_plotlyjs()[:3_000_000]]
)
def test_a_plotly_that_is_built_in_another_way_is_whole(monkeypatch, other):
    plotly_js.cache_clear()
    monkeypatch.setattr(module, "get_plotlyjs", lambda: other)
    assert plotly_js(frozenset({"bar"})) == other
    plotly_js.cache_clear()


def test_a_kind_that_is_not_found_takes_the_whole():
    assert plotly_js(frozenset({"bar", "no such trace"})) == get_plotlyjs()


@NEEDS_CHROMIUM
def test_every_kind_of_figure_is_drawn(tmp_path):
    """Three on a page, and each on one of its own, which holds no more of plotly.js than that needs."""
    pages = [("scatter", "bar", "heatmap"), *((kind,) for kind in DRAWN)]
    with chromium(tmp_path / "profile") as driver:
        for kinds in pages:
            file = tmp_path / f"{'-'.join(kinds)}.html"
            file.write_text(page(*kinds))
            opened(driver, file, 800)
            for kind in kinds:
                marks = f"return document.querySelectorAll('{DRAWN[kind][1]}').length"
                assert driver.execute_script(marks) >= 1, kind
            severe = [entry for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]
            assert severe == [], kinds
