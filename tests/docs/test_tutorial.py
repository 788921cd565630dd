"""The tutorial as a newcomer follows it, and every command of every page as it is read."""

import json
import re
import shlex
from pathlib import Path

import pytest
import typer
from line_case import changed_text
from places import DOCS, EXAMPLES, ROOT

from coupling.cli import app, main

PAGES = sorted([*ROOT.glob("*.md"), *DOCS.glob("*.md")])
TUTORIAL = (DOCS / "tutorial.md").read_text()
CASE = Path("cell/case.toml")
# Fenced blocks: the language, the file that they are where a name follows, the content.
_BLOCK = re.compile(r"^```(?P<language>\w+)(?: (?P<file>\S+))?\n(?P<text>.*?)^```$", re.M | re.S)
_COMMAND = re.compile(r"^(?:\$ )?(elastic-robot .*?)(?:\s+[#>].*)?$", re.M)
_FENCED = re.compile(r"^ *```.*?^ *```$", re.M | re.S)


def run(line: str) -> None:
    program, *arguments = shlex.split(line)
    assert program == "elastic-robot"
    with pytest.raises(SystemExit) as done:
        main(arguments)
    assert done.value.code in (0, None), line


def test_the_tutorial_leads_to_a_program(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for block in _BLOCK.finditer(TUTORIAL):
        if block["language"] == "python":
            exec(block["text"], {})
        elif block["file"]:
            Path(block["file"]).write_text(block["text"])
        else:
            assert block["language"] == "sh"
            for line in block["text"].splitlines():
                run(line)
                if line.startswith("elastic-robot init"):  # a whole cone is longer, not other
                    flat = changed_text(CASE, ("depth_m        = 0.01", "depth_m = 0.001"))
                    CASE.write_text(flat)
    named = re.findall(r"`((?:cell|results)/[\w./]+)`", TUTORIAL)
    assert [name for name in named if not Path(name).exists()] == []
    assert "left out: T1, M6, M30" in capsys.readouterr().out
    found = json.loads(Path("results/part/result.json").read_text())
    assert found["converged"]
    assert found["deviation_after_m"]["maximum"] < 0.01 * found["deviation_before_m"]["maximum"]
    assert "SPL" in Path("results/part/krl/part.src").read_text()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_command_of_a_page_is_one(page):
    """Its name, options and number of arguments; nothing is run."""
    group = typer.main.get_command(app)
    for fence in _FENCED.findall(page.read_text()):
        for line in _COMMAND.findall(fence):
            words = shlex.split(line.replace("...", ""), comments=True)[1:]
            context = group.make_context("elastic-robot", words, resilient_parsing=True)
            name, command, rest = group.resolve_command(context, words)
            assert command is not None, line
            command.make_context(name, list(rest), parent=context)


def test_the_notebook_holds_the_steps_of_the_tutorial():
    book = json.loads((EXAMPLES / "tutorial.ipynb").read_text())
    code = ["".join(cell["source"]) for cell in book["cells"] if cell["cell_type"] == "code"]
    lines = [line[1:] for cell in code for line in cell.splitlines() if line.startswith("!")]
    assert lines == re.findall(r"^elastic-robot .*$", TUTORIAL, re.M)
    files = {block["file"]: block["text"] for block in _BLOCK.finditer(TUTORIAL) if block["file"]}
    cells = [cell.partition("\n") for cell in code if cell.startswith("%%writefile ")]
    written = {first.removeprefix("%%writefile "): f"{text}\n" for first, _, text in cells}
    assert written == files
