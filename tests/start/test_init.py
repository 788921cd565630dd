"""elastic-robot init: every case that it makes can be run, whatever the robot."""

import functools
import io
import itertools
import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from command_line import status
from scipy.spatial.transform import Rotation

from coupling.case.file import load_case
from coupling.check import new_case as module
from coupling.check.new_case import (
    CASE,
    STARTS,
    new_case,
    write_case,
)
from coupling.check.typical_gears import HEAVY_SPINDLE
from coupling.errors import CaseError, CouplingError, PlanningError
from coupling.files.robot_file import load_robot, shipped_robots
from coupling.path.histories import ToolPath
from coupling.robot.batch.part_placement import part_placements
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.run.plausibility import remarks

WAYS = [
    (name, two) for name, start in STARTS.items() for two in (False, True)[: 1 + bool(start.cell)]
]

example_case = functools.cache(load_case)


@pytest.mark.parametrize("robot", shipped_robots())
@pytest.mark.parametrize(("process", "two_robots"), WAYS)
def test_every_robot_follows_the_path_of_every_process(
    robot, process, two_robots, tmp_path, monkeypatch
):
    """As told by the case in the folder alone, at one in forty samples."""
    monkeypatch.setattr(module, "load_case", example_case)
    if robot == "kuka_kr210":
        pytest.importorskip("rtbdata", reason="needs the package rtb-data")
    file = write_case(new_case(robot, process, two_robots, tmp_path), tmp_path)
    case = load_case(file)
    assert len(case.robots) == 1 + two_robots
    for placed, path in zip(case.robots, case.desired.tools, strict=True):
        seldom = path.at_rows(np.arange(0, len(path.time), 40))
        InverseKinematics(placed.description, placed.home).plan(
            seldom.transformed(placed.world_from_base.inverse())
        )
    if process != "milling-force":  # which may put a spindle on its flange
        assert (tmp_path / f"{robot}.toml").read_text() == shipped_robots()[robot].read_text()


@pytest.mark.parametrize("process", ["external", "measured"])
def test_a_first_case_is_compensated_as_it_stands(process, tmp_path, monkeypatch, capsys):
    """The quick ones; those of force law, sheet and milling are examples that other tests run."""
    monkeypatch.chdir(tmp_path)
    write_case(new_case("icme2008", process, False, Path("new")), Path("new"))
    assert status("compensate", "new/case.toml", "-o", "done") == 0, capsys.readouterr().out
    found = json.loads(Path("done/result.json").read_text())
    assert found["deviation_after_m"]["maximum"] < 1e-5 < found["deviation_before_m"]["maximum"]


def test_nothing_that_is_there_is_replaced(tmp_path):
    (tmp_path / "icme2008.toml").write_text("mine")
    with pytest.raises(CaseError, match=r"icme2008\.toml: expected a new file"):
        write_case(new_case("icme2008", "measured", False, tmp_path), tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ["icme2008.toml"]


def test_a_robot_file_of_the_user_is_named_and_not_copied(tmp_path):
    own = tmp_path / "robots" / "mine.toml"
    own.parent.mkdir()
    own.write_text(shipped_robots()["abb_irb7600"].read_text())
    folder = tmp_path / "case"
    file = write_case(new_case(str(own), "isf-force-law", False, folder), folder)
    assert tomllib.loads(file.read_text())["robot"]["description"] == "../robots/mine.toml"
    assert load_case(file).robots[0].description == load_robot(own)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("nope", "measured", False), "expected one of abb_irb7600"),
        (("icme2008", "mesured", False), "did you mean 'measured'"),
        (("icme2008", "measured", True), "expected a process for two tools"),
    ],
)
def test_what_cannot_be_made_is_told_in_a_sentence(arguments, said, tmp_path):
    with pytest.raises((CouplingError, Exception), match=said):
        new_case(*arguments, tmp_path)


def test_a_robot_that_cannot_hold_its_tool_upright_is_refused():
    """Its only axis is vertical, its tool points along x: never down."""
    robot = load_robot(shipped_robots()["icme2008"])
    stump = type(robot)(robot.name, robot.joints[:1], robot.gravity, (1.0, 0.0, 0.0), robot.tcp_rpy)
    with pytest.raises(PlanningError, match="expected a place around which"):
        part_placements(stump, Rotation.from_euler("y", np.pi / 2), 0.05, 3)


def test_a_part_is_reached_at_its_corners_too():
    """A metre wide, from the posture at its middle; of places that are good there some are not."""
    robot, down = load_robot(shipped_robots()["icme2008"]), Rotation.from_euler("y", np.pi)
    way = np.linspace(0.0, 1.0, 30)
    places = list(part_placements(robot, down, 0.5, 8))
    assert places
    for place in places:
        for corner in itertools.product((-0.5, 0.5), repeat=3):
            path = ToolPath.with_rotation(way, place.position + np.outer(way, corner), down)
            InverseKinematics(robot, place.home).plan(path)


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["new"], 0, r"Next: elastic-robot check new/case\.toml"),
        (["new one"], 0, r"Next: elastic-robot check 'new one/case\.toml'"),
        (["there"], 2, r"there/case\.toml: expected a new file"),
        (["--list"], 0, ".*".join((*STARTS, *shipped_robots()))),
        ([], 2, "expected the folder to create, or --list"),
        (["x", "--process", "y"], 2, "--process: expected one of"),
    ],
)
def test_the_command_makes_lists_and_refuses(arguments, code, said, tmp_path, monkeypatch, capsys):
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / CASE).touch()
    monkeypatch.chdir(tmp_path)
    assert status("init", *arguments) == code
    told = capsys.readouterr()
    assert re.search(said, told.out + told.err, re.DOTALL)
    made = {file.name for file in tmp_path.glob("new*/*")}
    assert made == (
        {CASE, "icme2008.toml"} if arguments and arguments[0].startswith("new") else set()
    )


def test_a_robot_that_mills_has_a_spindle_and_touches_off_its_part(tmp_path):
    """The TCP of the KR 300 is its flange: tool and spindle are set, its servos are not confirmed."""
    case = new_case("kuka_kr300", "milling-force", False, tmp_path)
    loaded = load_case(write_case(case, tmp_path))
    (placed,) = loaded.robots
    assert placed.touch_off is not None
    assert placed.description.tcp_position == (HEAVY_SPINDLE.reach, 0.0, 0.0)
    assert placed.description.payload is not None
    assert placed.description.payload.mass == HEAVY_SPINDLE.mass
    assert placed.drive == "ideal"
    assert any("do not confirm the servos" in text for text in remarks(loaded))
    assert any("spindle" in text for text in case.remarks)
    other = new_case("icme2008", "milling-force", False, tmp_path / "other")
    assert "touch_off = true" in other.texts["case.toml"]
    assert not any("spindle" in text for text in other.remarks)  # it has a tool


def test_a_terminal_is_asked_for_the_tolerance(tmp_path, monkeypatch, capsys):
    """What is typed stands in the case; nothing typed leaves the question open."""
    monkeypatch.delenv("JPY_PARENT_PID", raising=False)
    monkeypatch.setattr("sys.stdin", io.StringIO("0,25 mm\n"))
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    assert status("init", tmp_path / "cell") == 0
    assert tomllib.loads((tmp_path / "cell" / CASE).read_text())["part"]["tolerance_mm"] == 0.25
    asked, *further_lines = capsys.readouterr().out.splitlines()
    assert asked.startswith("How far may the tool be off its path [mm]?")
    assert not any("State it as tolerance_mm" in line for line in further_lines)


@pytest.mark.parametrize("typed", ["much", "-1", "nan", "0"])
def test_a_tolerance_that_is_none_is_refused_by_its_name(typed, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", io.StringIO(f"{typed}\n"))
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    assert status("init", tmp_path / "cell") == 2
    assert "tolerance" in capsys.readouterr().err
    assert not (tmp_path / "cell").exists()
