"""The notebooks, run cell by cell; `make notebooks` installs what that needs."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pytest
from places import EXAMPLES

nbclient = pytest.importorskip("nbclient", reason="needs nbclient: `make notebooks`")
pytest.importorskip("ipykernel", reason="needs ipykernel: `make notebooks`")
nbformat = pytest.importorskip("nbformat")


# What they tell that takes long, and what is run in its place: test_tutorial.py runs the rest of it.
SHORTER = {
    "tutorial": (
        (
            "init cell\n!elastic-robot check cell/case.toml -o cell/check.html",
            "init cell --process external",
        ),
        ("!elastic-robot check cell/case.toml -o cell/check.html", ""),
        ("G1 X20 F1200\nG3 X30 Y10 J10\nG1 Y20\n", "G1 X4 F6000\n"),
    ),
}
# What they leave, and how many first screens they show.
MADE = {
    "tutorial": ("results/part/krl/part.src", 1),
    "identify": ("out/plan.csv", 0),
    "next": ("results/second/report.html", 2),
    "milling": ("results/slot/result.json", 3),
}


@pytest.mark.parametrize("name", MADE)
def test_a_notebook_runs_to_the_end_and_shows_first_screens(name, tmp_path, monkeypatch):
    """Its commands are those of the environment of this Python; one that fails prints an error."""
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    shutil.copytree(EXAMPLES / "identify", tmp_path / "identify")
    book = nbformat.read(EXAMPLES / f"{name}.ipynb", as_version=4)
    for told, run in SHORTER.get(name, ()):
        (cell,) = (cell for cell in book.cells if cell.cell_type == "code" and told in cell.source)
        cell.source = cell.source.replace(told, run)
    nbformat.validate(book)
    nbclient.NotebookClient(
        book, timeout=300, resources={"metadata": {"path": str(tmp_path)}}
    ).execute()
    outputs = [output for cell in book.cells for output in cell.get("outputs", ())]
    said = "".join(output.get("text", "") for output in outputs)
    assert "error:" not in said
    made, screens = MADE[name]
    assert (tmp_path / made).exists()
    pages = [html for output in outputs if (html := output.get("data", {}).get("text/html"))]
    assert sum("What to do now" in page for page in pages) == screens
    assert sum("srcdoc" in page for page in pages) == screens
