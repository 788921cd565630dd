"""The page on trust: it is as new as the pages it reads, and reads them by row and column."""

import string

import numpy as np
import pytest
from places import DOCS, ROOT

pytest.importorskip("mujoco", reason="needs the package mujoco, which is in the extra 'test'")

from docs.scripts import make_trust, page, trust_sheet
from docs.scripts.page_table import PageTable
from docs.scripts.trust_comparison import Against, Comparison

TEMPLATE = (DOCS / "scripts" / "trust.md.in").read_text()


def fields(line: str) -> set[str]:
    """The values that a line of a template names."""
    named = [name for _, name, _, _ in string.Formatter().parse(line) if name]
    return {name.split(".")[0].split("[")[0] for name in named}


@pytest.mark.parametrize(
    ("template", "written", "least"),
    [(TEMPLATE, DOCS / "trust.md", 9), (make_trust.SUMMARY, ROOT / "README.md", 1)],
    ids=["page", "README"],
)
def test_what_is_read_from_other_pages_is_what_they_say_now(template, written, least):
    """Where this fails after another page was made anew: make trust."""
    values, lines = make_trust.published(), written.read_text().splitlines()
    read = [line for line in template.splitlines() if fields(line) and fields(line) <= set(values)]
    assert len(read) >= least
    assert [line for line in read if line.format(**values) not in lines] == []


def test_without_calculix_what_it_last_said_is_read(monkeypatch):
    monkeypatch.setattr(trust_sheet, "calculix_curve", lambda: None)
    monkeypatch.setattr(trust_sheet, "plunge_curve", lambda side, count, depths: 0.0 * depths)
    solid = trust_sheet.plunge.__wrapped__().solid
    # A force that rises with the depth, and less than in proportion, since the plate yields.
    assert np.all(np.diff(solid) > 0.0)
    assert np.all(np.diff(solid / trust_sheet.SHALLOW) < 0.0)


@pytest.fixture
def table(tmp_path, monkeypatch):
    """A page with a part that has a table between words, and one of words only."""
    monkeypatch.setattr(page, "DOCS", tmp_path)
    rows = [("**first**", "3213 (+111 %)", "-1.5e-3"), ("second", "none", "")]
    part = f"Words.\n\n{page.table(('', 'a', 'b'), rows)}\n\nMore."
    text = f"| no | table |\n<!-- x -->\n{part}\n<!-- end of x -->\n"
    (tmp_path / "page.md").write_text(f"{text}<!-- y -->\nwords\n<!-- end of y -->\n")
    return PageTable.of("page", "x")


def test_a_number_is_found_by_row_and_column(table):
    assert table.number("first", "a") == 3213.0
    assert table.number("first", "b") == -1.5e-3
    assert table.cell("sec", "a") == "none"


@pytest.mark.parametrize(
    ("row", "column", "said"),
    [
        ("third", "a", "part 'x': expected a row 'third', got first, second"),
        ("first", "c", "part 'x': expected a column 'c', got , a, b"),
        ("second", "a", "part 'x': expected a number in 'second', 'a', got 'none'"),
    ],
)
def test_what_is_not_in_a_table_is_told(table, row, column, said):
    with pytest.raises(ValueError, match=said):
        table.number(row, column)


@pytest.mark.parametrize("part", ["y", "z"])
def test_a_part_without_a_table_is_told(table, part):
    with pytest.raises(ValueError, match=f"part '{part}': expected a table, got none"):
        PageTable.of("page", part)


@pytest.mark.parametrize(
    ("percent", "verdict"),
    [(0.09, "settled"), (-4.9, "good"), (-24.9, "rough"), (26.0, "do not rely on it")],
)
def test_a_verdict_is_of_the_size_of_the_deviation(percent, verdict):
    assert Comparison("", Against.PROGRAM, percent, 100.0, "").verdict == verdict


def test_the_commanded_profile_is_the_cone_that_the_tool_touches():
    """Its wall has 45 degrees and is half a thickness and the tool's radius from the sphere's centre."""
    profile = trust_sheet.commanded_profile()
    np.testing.assert_allclose(profile, profile[::-1] * [-1.0, 1.0], atol=1e-12)
    wall = profile[(profile[:, 0] > 0.03) & (profile[:, 0] < 0.06)]
    np.testing.assert_allclose(np.diff(wall[:, 1]) / np.diff(wall[:, 0]), 1.0, atol=1e-9)
    # The circle 22 mm deep: 124 mm wide at 0.5 mm, 1 mm less each 0.5 mm; z from the flat midsurface.
    centre = np.array([0.062 - 0.0215, -0.022 + 0.00633 + 0.5 * 0.00163])
    nearest = np.linalg.norm(wall - centre, axis=1).min()
    assert nearest == pytest.approx(0.00633 + 0.5 * 0.00163, abs=1e-6)
    assert profile[:, 1].min() == pytest.approx(-0.044, abs=1e-9)
