"""The notebooks, run cell by cell; `make notebooks` installs what that needs."""

import os
import re
import shutil
import sys
from pathlib import Path

import pytest
from places import EXAMPLES, HELPERS, ROOT

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
    "next": (
        (
            "[0.1, 0.0, -0.01], [0.1, 0.1, -0.01], [0.0, 0.1, 0.0]",
            "[0.05, 0.0, -0.01], [0.05, 0.05, -0.01], [0.0, 0.05, 0.0]",
        ),
    ),
    "milling": (("[0.02, 0.0, -0.0005], [0.03, 0.0, 0.001]", "[0.02, 0.0, 0.001]"),),
}
# What they leave, and how many first screens they show.
MADE = {
    "tutorial": ("results/part/krl/part.src", 1),
    "identify": ("out/plan.csv", 0),
    "next": ("results/second/report.html", 2),
    "milling": ("results/slot/result.json", 3),
}
# Their commands without a process each, which takes longer to import all than it works, and runs without
# drawn robots; those of `identify` are run as they stand.
AS_THEY_STAND = ("identify",)
IN_THE_KERNEL = f"""
import shlex, sys
sys.path.append({str(HELPERS)!r})
from drawn_robots import leave_out_drawn_robots
from coupling.cli import main
leave_out_drawn_robots()

def run_command(line):
    try:
        main(shlex.split(line))
    except SystemExit as end:
        assert not end.code, line
"""


@pytest.mark.parametrize("name", MADE)
def test_a_notebook_runs_to_the_end_and_shows_first_screens(name, tmp_path, monkeypatch):
    """Its commands are those of the environment of this Python; one that fails prints an error."""
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    shutil.copytree(EXAMPLES / "identify", tmp_path / "identify")
    book = nbformat.read(EXAMPLES / f"{name}.ipynb", as_version=4)
    for told, run in SHORTER.get(name, ()):
        (cell,) = (cell for cell in book.cells if cell.cell_type == "code" and told in cell.source)
        cell.source = cell.source.replace(told, run)
    if name not in AS_THEY_STAND:
        for cell in book.cells:
            cell.source = re.sub(r"(?m)^!elastic-robot (.*)$", r"run_command('\1')", cell.source)
        book.cells.insert(0, nbformat.v4.new_code_cell(IN_THE_KERNEL))
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
