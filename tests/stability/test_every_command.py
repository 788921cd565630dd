"""Every command that is given a case or a run of a milling cut says first that it chatters."""

import json
import re
from pathlib import Path

import pytest
from command_line import command
from titanium_slot import PROCESS

from coupling.cli.main import _whole
from coupling.results.cut_result import WILL_CHATTER

# A slot, 2 mm deep at 3000 1/min: it chatters from 1.7 mm.
SLOT = (
    """
[robot]
description = "fanuc_r2000ic"
home_deg    = [0.0, 20.0, -20.0, 0.0, -70.0, 0.0]

[part]
position_m = [1.6, 0.0, 0.6]

[tool_path]
kind     = "line"
points_m = [[0.0, 0.0, 0.001], [0.004, 0.0, -{depth}], [0.008, 0.0, 0.001]]
feed_m_s = 0.02
blend_s  = 0.1
sample_s = 0.006
"""
    + PROCESS
    + """force = "mean"

[place]
settings = 100
"""
)

# Words behind a command's case or run, by command: those that compute something of the cut.
JUDGED = {
    "check": (),
    "couple": ("--no-store",),
    "compensate": ("--no-store",),
    "study": ("--no-store",),
    "place": ("--no-store",),
    "next": ("--no-store",),
    "learn": ("--no-store",),
    "mirror": ("--no-store",),
}
# Commands that compute nothing of a cut, and why.
OTHERS = {
    "init": "writes a case",
    "modes": "vibrations of the robot, whatever it cuts",
    "build": "the FMU of a robot",
    "ssp": "robot and process for another master",
    "export": "writes the command of a run, which says it itself",
    "report": "draws a result, which says it itself",
    "stability": "limits of the cut itself",
    "compare": "what was measured under a command",
    "store": "stored evaluations",
    "identify": "measurements of a robot or of slots",
    "robots": "lists robots",
}


pytestmark = pytest.mark.usefixtures("coarse_charts")


def slot(folder: Path, depth: float) -> Path:
    file = folder / "slot.toml"
    file.write_text(SLOT.format(depth=depth))
    return file


@pytest.fixture(scope="module")
def measured_run(tmp_path_factory, coarse_charts) -> list[Path]:
    """A run whose case was made deeper behind it, and a path measured under it."""
    folder = tmp_path_factory.mktemp("measured")
    place = folder / "measured"
    command("compensate", slot(folder, 0.0003), "-o", place, "--no-store", exits=0)
    rows = (place / "achieved.csv").read_text().splitlines()
    measured = folder / "measured.csv"
    measured.write_text("\n".join(rows) + "\n")
    case = place / "case.toml"
    case.write_text(case.read_text().replace("-0.0003", "-0.002"))
    return [place, measured]


def test_each_command_is_known_to_judge_or_to_compute_nothing_of_a_cut():
    assert set(_whole().commands) == JUDGED.keys() | OTHERS.keys()


@pytest.mark.parametrize("name", JUDGED)
def test_a_cut_that_chatters_is_named_with_the_same_words_and_exit_status(
    tmp_path, monkeypatch, request, name
):
    if name in ("next", "learn", "mirror"):
        given = request.getfixturevalue("measured_run")
    else:
        given = [slot(tmp_path, 0.002)]
    output = tmp_path / ("page.html" if name == "check" else "result")
    monkeypatch.setattr("coupling.run.execute._run", None)  # a command would fail
    monkeypatch.setattr("coupling.identification.next.command.learn", None)
    done = command(name, *given, "-o", output, *JUDGED[name], exits=1)
    told = done.stdout
    assert WILL_CHATTER in told
    if name not in ("check", "place"):
        again = re.search(r"elastic-robot .*--despite-chatter", " ".join(told.split()))
        assert again
        assert all(str(file) in again[0] for file in given)
        folder = output / "run" if name == "study" else output
        instead_of = json.loads((folder / "stability.json").read_text())["instead_of"]
        assert instead_of[0] == ("next" if name in ("learn", "mirror") else name)
