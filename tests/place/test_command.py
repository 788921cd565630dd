"""elastic-robot place as a user types it, and the case files that it leaves."""

import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomlkit
from command_line import command
from places import CASES, LINE_CASE

from coupling.case.file import load_case
from coupling.cli.runs import report
from coupling.errors import CaseError, PlanningError, ResultError
from coupling.files.written_files import LIST
from coupling.path.histories import WrenchHistory
from coupling.place.evaluated_setting import evaluate_setting
from coupling.place.folder import read_placement
from coupling.place.place import best_of, place
from coupling.place.placing import placing, setting_keys
from coupling.place.settings import NAMES
from coupling.process.base import ProcessResponse
from coupling.report.stored_result import write_report
from coupling.run.execute import run_coupling

FREE = {
    "x_m": [1.2, 1.8],
    "y_m": [0.1, 0.1],
    "z_m": [0.5, 1.0],
    "yaw_deg": [0.0, 60.0],
    "base_roll_deg": [-8.0, 8.0],
    "settings": 128,
    "cases": 2,
}


def written(folder: Path, source: Path = LINE_CASE, **tables: dict) -> Path:
    data = tomllib.loads(source.read_text())
    for table, keys in tables.items():
        data.setdefault(table, {}).update(keys)
    file = folder / "line.toml"
    file.write_text(tomlkit.dumps(data))
    return file


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """One placement of the line, its gears with backlash."""
    folder = tmp_path_factory.mktemp("place")
    case = written(folder, robot={"torque_curve": "backlash"}, place=FREE)
    return case, folder / "out", command("place", case, "-o", folder / "out", "--no-store")


def test_the_folder_holds_cases_figures_maps_and_a_page(done):
    _, folder, said = done
    assert said.returncode == 0, said.stderr
    names = {file.name for file in folder.iterdir()}
    assert {"place.json", "map.csv", "report.html", "run.json", "placed_1.toml"} <= names
    assert not list(folder.parent.glob("*.unfinished"))
    assert json.loads((folder / "run.json").read_text())["state"] == "finished"
    for words in ("as it is", "placed_1.toml", "for collisions", "no joint limits"):
        assert words in said.stdout
    stored = read_placement(folder)
    assert [own.axes.setting for own in stored.maps] == ["present", "best"]
    assert {own.axes.plane for own in stored.maps} == {("x", "z")}
    assert stored.figures.best[0].cost_m < 0.8 * stored.figures.present.cost_m


def test_a_placed_case_is_an_ordinary_case_in_the_setting_that_is_told(done):
    """What its own placing finds it to be in, and what its robot does in a run."""
    case, folder, _ = done
    best = read_placement(folder).figures.best[0]
    placed, before = load_case(folder / "placed_1.toml"), load_case(case)
    again = placing(placed, placed.process)
    assert setting_keys(again.present) == pytest.approx(best.setting)
    assert setting_keys(again.present) != setting_keys(placing(before, before.process).present)
    figures = again.screen(again.stations).figures(again.present[None])
    assert again.goal.deviation(figures)[0] == pytest.approx(best.moved_m, rel=1e-6)
    margins = [gear.margin for gear in best.gears]
    np.testing.assert_allclose(figures.margin[0], margins, atol=0.03 * figures.swing.max())
    moved = run_coupling(replace(placed, method=before.method))
    first = placed.robots[0].home - moved.correction.joints.q[0][0]
    assert np.abs(first).max() < 0.3
    content = tomllib.loads((folder / "placed_1.toml").read_text())
    assert content["part"]["rpy_deg"][2] == best.setting["yaw_deg"]
    assert content["place"]["settings"] == FREE["settings"]


def test_the_report_is_made_anew_from_the_folder(done, tmp_path):
    _, folder, _ = done
    before = (folder / "report.html").read_text()
    report(folder, tmp_path / "again.html")
    assert same(before) == same((tmp_path / "again.html").read_text())
    assert "joint 5" in before


def same(page: str) -> str:
    """A page without the names that its figures get anew."""
    return re.sub(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", "", page)


@pytest.mark.parametrize(
    ("file", "content", "words"),
    [
        ("place.json", "[]", "expected the figures of a placement, got damaged ones"),
        ("place.json", '{"maps": [{"shape": [-1, 1e400]}]}', "got damaged ones"),
        ("map.csv", "map\n1\n", "columns across_m"),
        ("map.csv", None, "cannot be read"),
    ],
)
def test_a_damaged_folder_is_refused(done, tmp_path, file, content, words):
    _, folder, _ = done
    for name in ("place.json", "map.csv"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    if content is None:
        (tmp_path / file).unlink()
    else:
        (tmp_path / file).write_text(content)
    with pytest.raises(ResultError, match=words):
        write_report(tmp_path)


def test_a_result_is_replaced_only_where_that_is_said(done):
    case, folder, _ = done
    again = command("place", case, "-o", folder, "--no-store", exits=2)
    assert "holds a result already: add --overwrite" in again.stderr


FIXED = {f"{name}_m": [value, value] for name, value in zip("xyz", (1.6, 0.1, 0.8), strict=True)}
FIXED |= {"yaw_deg": [30.0, 30.0], "rotation_deg": [0.0, 0.0]}


@pytest.mark.parametrize(
    ("source", "place", "arguments", "words"),
    [
        (LINE_CASE, FREE, ["--optimise", "flanks"], "expected one of stiffness, backlash, both"),
        (
            LINE_CASE,
            FREE,
            ["--optimise", "backlash"],
            "expected gears with backlash or hysteresis to optimise",
        ),
        (LINE_CASE, FIXED, [], "expected a range with low < high, got none"),
        (CASES / "two_robots.toml", {}, [], "expected a case of one robot, got one with [support]"),
        (LINE_CASE, FREE | {"x_m": [8.0, 9.0]}, [], "out of reach: 128): widen the ranges"),
        (
            LINE_CASE,
            FREE | {"x_m": [-1e9, 1e9]},
            [],
            "expected a feasible setting",
        ),
    ],
)
def test_mistakes_are_one_sentence_and_leave_no_result(tmp_path, source, place, arguments, words):
    case = written(tmp_path, source, place=place)
    end = command("place", case, "-o", tmp_path / "out", "--no-store", *arguments, exits=2)
    said = " ".join(end.stderr.split())
    assert words in said
    assert "Traceback" not in said
    # As of any run, what is left where the process was evaluated says why there is no result.
    assert {file.name for file in (tmp_path / "out").glob("*")} <= {LIST, "run.json"}


class Sensor:
    """A process whose force is that of the tool's own x axis, and which counts its evaluations."""

    identity = ""

    def __init__(self) -> None:
        self.asked = 0

    def evaluate(self, path):
        self.asked += 1
        force = path.rotations[0].apply([-400.0, 0.0, 0.0])
        return ProcessResponse(WrenchHistory.of_forces(path.time, [force]))


def test_the_process_is_evaluated_anew_where_the_tool_is_turned(tmp_path):
    """Once as it is; the force of a tilted tool is that of the tilted tool, not the part's."""
    case, sensor = load_case(written(tmp_path, place=FREE)), Sensor()
    task = placing(case, sensor, "stiffness")
    moved, tilted = np.tile(task.present, (2, 1))
    moved[NAMES.index("x")] += 0.1
    tilted[NAMES.index("lead")] = 0.4
    for setting, evaluations in ((task.present, 1), (moved, 1), (tilted, 2)):
        own = evaluate_setting(task, setting, lambda case: sensor)
        assert sensor.asked == evaluations
        (tmp_path / "placed.toml").write_text(own.content)
        again = placing(load_case(tmp_path / "placed.toml"), Sensor(), "stiffness")
        figures = again.screen(again.stations.strongest()).figures(again.present[None])
        np.testing.assert_allclose(figures.deviation[0], own.result.moved_m, rtol=1e-6)


def test_a_path_that_the_robot_cannot_follow_where_it_is_may_be_placed_all_the_same(tmp_path):
    case = load_case(written(tmp_path, part={"position_m": [4.0, 0.0, 0.8]}, place=FREE))
    found = place(placing(case, case.process, "stiffness"), lambda case: case.process)
    assert found.present is None
    assert found.best[0].setting[0] < 1.81


def test_settings_whose_whole_path_cannot_be_followed_are_passed_over(tmp_path):
    """The first of the best is out of reach; the next one is taken, and none is an error."""
    case = load_case(written(tmp_path, place=FREE | {"x_m": [1.2, 5.0], "cases": 1}))
    task = placing(case, case.process, "stiffness")
    far = task.present.copy()
    far[0] = 4.9
    (own,) = best_of(task, np.array([far, task.present]), lambda case: case.process)
    np.testing.assert_allclose(own.setting, task.present, atol=1e-4)
    with pytest.raises(PlanningError, match="follow the whole path, got none: out of reach"):
        best_of(task, far[None], lambda case: case.process)


def test_a_robot_of_another_number_of_joints_is_refused():
    case = load_case(LINE_CASE)
    (own,) = case.robots
    five = replace(own, description=replace(own.description, joints=own.description.joints[:5]))
    with pytest.raises(CaseError, match="expected a robot of at least 6 joints, got 5"):
        placing(replace(case, robots=(five,)), case.process)
