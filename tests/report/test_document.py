"""A page of figures: the plotly.js in it can draw them."""

import html

import plotly.graph_objects as go
from browser import NEEDS_CHROMIUM, chromium, opened

from coupling.cli.console import console
from coupling.report.document import document
from coupling.report.terminal import print_sections
from coupling.results.section import Answer, KeyFigure, NextStep, Note, Section, Table, warned

# One figure of each kind of trace in our pages, and the marks that it leaves.
DRAWN = {
    "scatter": (go.Scatter(x=[0.0, 1.0], y=[0.0, 1.0]), ".js-line"),
    "bar": (go.Bar(x=[0.0, 1.0], y=[2.0, 1.0]), ".bars path"),
    "heatmap": (go.Heatmap(z=[[0.0, 1.0], [2.0, 3.0]]), ".heatmaplayer image"),
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
    assert '<div class="verdict no"><p>NOT CONVERGED' in text


@NEEDS_CHROMIUM
def test_names_without_a_blank_fit_a_phone(tmp_path):
    """In heading, verdict, steps and sections; what copies a command stays on one line."""
    name = "Blechumformung_Kotfl\u00fcgel_\u65e5\u672c\u8a9e_" * 6
    steps = [NextStep.by(name, "report", name)]
    answer = Answer(name, reason=name, figures=[KeyFigure(name, "1 mm", name)], steps=steps)
    (tmp_path / "page.html").write_text(document(name, [Section(name, [name])], answer))
    with chromium(tmp_path / "profile") as driver:
        opened(driver, tmp_path / "page.html", 390)
        assert driver.execute_script("return document.documentElement.scrollWidth") <= 390
        button = driver.find_element("css selector", ".command button")
        assert button.rect["width"] > 40


@NEEDS_CHROMIUM
def test_every_kind_of_figure_is_drawn(tmp_path):
    """Three on a page, and each on one of its own."""
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
