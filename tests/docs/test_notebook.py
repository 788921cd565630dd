"""The notebook of the tutorial, run cell by cell; `make notebooks` installs what that needs."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from places import EXAMPLES

nbclient = pytest.importorskip("nbclient", reason="needs nbclient: `make notebooks`")
pytest.importorskip("ipykernel", reason="needs ipykernel: `make notebooks`")
nbformat = pytest.importorskip("nbformat")


def test_the_notebook_runs_to_the_end(tmp_path, monkeypatch):
    """Its commands are those of the environment of this Python; one that fails prints an error."""
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    book = nbformat.read(EXAMPLES / "tutorial.ipynb", as_version=4)
    # Less than it tells, all of which is run by test_tutorial.py: a short groove, one check of three.
    check = "!elastic-robot check cell/case.toml -o cell/check.html"
    shorter = (
        (f"init cell\n{check}", "init cell --process external"),
        (check, ""),
        ("G1 X20 F1200\nG3 X30 Y10 J10\nG1 Y20\n", "G1 X4 F6000\n"),
    )
    for told, run in shorter:
        (cell,) = (cell for cell in book.cells if cell.cell_type == "code" and told in cell.source)
        cell.source = cell.source.replace(told, run)
    nbformat.validate(book)
    nbclient.NotebookClient(
        book, timeout=300, resources={"metadata": {"path": str(tmp_path)}}
    ).execute()
    said = "".join(
        output.get("text", "") for cell in book.cells for output in cell.get("outputs", ())
    )
    assert "error:" not in said
    assert "on the real robot" in said
    assert (tmp_path / "results" / "part" / "krl" / "part.src").exists()
