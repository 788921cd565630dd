"""Pages that runs write: what is written goes where it belongs, and nothing else changes."""

import importlib

import numpy as np
import pytest
from places import DOCS

from docs.scripts import page, runs
from docs.scripts.experiment import Page, results

SCRIPTS = sorted(file.stem for file in (DOCS / "scripts").glob("make_*.py"))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder in the place of docs/, with a page and a template."""
    monkeypatch.setattr(page, "DOCS", tmp_path)
    (tmp_path / "page.md").write_text("before\n<!-- a -->\nold\n<!-- end of a -->\nafter\n")
    (tmp_path / "scripts").mkdir()
    (tmp_path / "scripts" / "filled.md.in").write_text("{size:.1f} mm\n")
    return tmp_path


@pytest.mark.parametrize("script", SCRIPTS)
def test_every_script_of_a_page_is_imported_and_finds_the_marks_of_its_parts(script):
    if script in ("make_comparison", "make_identify", "make_trust"):
        pytest.importorskip(
            "mujoco", reason="needs the package mujoco, which is in the extra 'test'"
        )
    module = importlib.import_module(f"docs.scripts.{script}")
    assert module.__doc__
    for written in (thing for thing in vars(module).values() if isinstance(thing, Page)):
        text = (DOCS / f"{written.name}.md").read_text()
        assert [part for part in written.parts if f"<!-- {part} -->" not in text] == []


def test_a_part_is_replaced_as_often_as_it_is_made(folder):
    for _ in range(2):
        page.replace("page", "a", page.table(("", "x"), [("row", "1"), ("none", "")]))
        assert (folder / "page.md").read_text() == (
            "before\n<!-- a -->\n| | x |\n|---|---|\n| row | 1 |\n| none | |\n<!-- end of a -->\nafter\n"
        )


def test_a_part_that_was_never_made_is_filled(folder):
    begin, end = "before\n<!-- a -->\n", "<!-- end of a -->\n<!-- a -->\nelsewhere\n"
    (folder / "page.md").write_text(begin + end)
    page.replace("page", "a", "new")
    assert (folder / "page.md").read_text() == begin + "new\n" + end


def test_a_part_without_marks_is_refused(folder):
    with pytest.raises(AssertionError, match="a pair of marks of 'b'"):
        page.replace("page", "b", "new")


def test_a_template_is_filled(folder):
    page.fill("filled", size=1.25)
    assert (folder / "filled.md").read_text() == "1.2 mm\n"


def test_a_page_writes_the_part_that_is_named(folder, monkeypatch):
    own = Page("page")

    @own.part
    def a() -> str:
        return results(
            ("side",), {"short": 2, "long": 30}, float, {"m": str, "m²": lambda x: f"{x * x:g}"}
        )

    @own.part
    def b() -> str:
        raise AssertionError("not named")

    monkeypatch.setattr("sys.argv", ["make_page.py", "a"])
    with pytest.raises(SystemExit) as done:
        own.write()
    assert done.value.code == 0
    written = "| side | m | m² |\n|---|---|---|\n| short | 2.0 | 4 |\n| long | 30.0 | 900 |\n"
    assert (folder / "page.md").read_text() == (
        f"before\n<!-- a -->\n{written}<!-- end of a -->\nafter\n"
    )


def test_a_changed_example_differs_in_the_changed_key_only():
    case, changed = runs.example("cone"), runs.example("cone", tool_path={"depth_m": 0.005})
    assert changed.resolved["tool_path"].pop("depth_m") == 0.005
    case.resolved["tool_path"].pop("depth_m")
    assert changed.resolved == case.resolved
    assert np.min(
        changed.task.part.coordinates(changed.desired.position[0])[:, 2]
    ) == pytest.approx(-0.005)
