"""Every command that is given a case or a run of a milling cut says first that it chatters."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from coupling.cli.main import _whole, main
from coupling.results.cut_result import WILL_CHATTER

# A slot in steel, 2 mm deep at 3000 1/min: it chatters from 1.7 mm.
SLOT = """
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
sample_s = 0.002

[process]
model             = "milling-force"
force             = "mean"
cutter_diameter_m = 0.016
teeth             = 2
helix_deg         = 30.0
spindle_speed_rpm = 3000.0
engagement        = "slot"
K_tc_Pa           = 1.9e9
K_rc_Pa           = 6.0e8
K_ac_Pa           = 3.0e8
K_te_N_m          = 2.4e4
K_re_N_m          = 4.3e4
K_ae_N_m          = 7.0e2

[place]
settings = 100
"""

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


@pytest.fixture
def coarse_charts(monkeypatch):
    for name, value in (
        ("path_stability.PLACES", 6),
        ("analysis.PLACES", 6),
        ("chart._SPEEDS", 8),
        ("chart._DIRECTIONS", 4),
        ("chart._GRID", 2),
    ):
        monkeypatch.setattr(f"coupling.stability.{name}", value)


def run(*words: object) -> int:
    with pytest.raises(SystemExit) as end:
        main([str(word) for word in words])
    return int(end.value.code or 0)


def slot(folder: Path, depth: float) -> Path:
    file = folder / "slot.toml"
    file.write_text(SLOT.format(depth=depth))
    return file


def measured_run(folder: Path) -> list[Path]:
    """Return a run whose case was made deeper behind it, and a path measured under it."""
    place = folder / "measured"
    assert run("compensate", slot(folder, 0.0003), "-o", place, "--no-store") == 0
    rows = (place / "achieved.csv").read_text().splitlines()
    measured = folder / "measured.csv"
    measured.write_text("\n".join(rows) + "\n")
    case = place / "case.toml"
    case.write_text(case.read_text().replace("-0.0003", "-0.002"))
    return [place, measured]


def test_each_command_is_known_to_judge_or_to_compute_nothing_of_a_cut():
    assert set(_whole().commands) == JUDGED.keys() | OTHERS.keys()


@pytest.mark.parametrize("command", JUDGED)
def test_a_cut_that_chatters_is_named_with_the_same_words_and_exit_status(
    tmp_path, capsys, monkeypatch, coarse_charts, command
):
    given = (
        measured_run(tmp_path)
        if command in ("next", "learn", "mirror")
        else [slot(tmp_path, 0.002)]
    )
    capsys.readouterr()
    output = tmp_path / ("page.html" if command == "check" else "result")
    monkeypatch.setattr("coupling.run.execute._run", None)  # a command would fail
    monkeypatch.setattr("coupling.identification.next.command.learn", None)
    assert run(command, *given, "-o", output, *JUDGED[command]) == 1
    told = capsys.readouterr().out
    assert WILL_CHATTER in told
    if command not in ("check", "place"):
        again = re.search(r"elastic-robot .*--despite-chatter", " ".join(told.split()))
        assert again
        assert all(str(name) in again[0] for name in given)
        folder = output / "run" if command == "study" else output
        assert json.loads((folder / "stability.json").read_text())["instead_of"]
