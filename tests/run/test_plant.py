"""[plant]: the command on a robot and under a load that are not the model."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import BY_MODE, FILES, command
from line_case import moving_line
from motor_file import with_motors
from places import CASES
from tuned_fmu import simulate_tuned

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.errors import CaseError
from coupling.events import unwatched
from coupling.files.robot_file import shipped_robots
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.path.deviation import measure
from coupling.path.length_text import in_unit, length_unit
from coupling.path.linear import interpolate_rows
from coupling.results.run_result import PlantReplay
from coupling.robot.differences import RobotDifference
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.execute import run_compensation
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.run.plant import PLANT_REPLAY, in_words, plant_cell, run_on_plant
from coupling.run.stored_run import read_run
from coupling.solve.correction import Correction
from elastic_robot.body import Body
from elastic_robot.description import Robot


def moving(folder: Path, plant: str) -> Path:
    """The small case on the moving robot with backlash, by method inverse, with a plant."""
    file = folder / "stroke.toml"
    file.write_text(f"{moving_line()}\n[plant]\n{plant}\n")
    return file


def loaded(folder: Path, plant: str) -> Case:
    return load_case(moving(folder, plant))


def on_plant(case: Case, found: Correction) -> PlantReplay:
    """What a command leaves on a case's plant; the same command serves many."""
    with FmuPool(case.fmu) as fmus:
        cell, _ = cell_of(case.robots, fmus)
        return run_on_plant(case, plant_cell(cell, case.plant, fmus), found, unwatched)


def simulated(
    robot: Robot, curve: str, folder: Path, force: float, changed: dict[str, float]
) -> float:
    """Largest deviation of a robot of its own FMU under the files of a run, without the plant's code."""
    stored = read_run(folder).first
    file = build_fmu(robot, folder / "own.fmu", BuildOptions("native"))
    with RobotFmu(file, curve) as fmu:
        path = simulate_tuned(fmu, stored.joints, stored.wrench.scaled(force), "dynamic", changed)
    np.testing.assert_allclose(stored.plant.pose, path.pose, rtol=0, atol=1e-12)
    return measure(path, stored.desired).maximum


def test_a_plant_that_is_the_model_leaves_what_the_model_leaves(tmp_path):
    run = run_compensation(loaded(tmp_path, "force_factor = 1.0"))
    assert run.finding_of(PLANT_REPLAY).differences == ()
    assert np.array_equal(run.finding_of(PLANT_REPLAY).path.pose, run.correction.achieved.pose)


def test_factors_of_single_joints_payload_and_force_are_those_of_a_robot_built_by_hand(
    tmp_path, example
):
    """Every changed number set by hand; the payload in a description of its own."""
    case = moving(
        tmp_path,
        "stiffness_factor = [0.97, 1.0, 1.0, 0.9, 1.0, 1.0]\nbacklash_factor = 1.3\n"
        "force_factor = 1.1\npayload_kg = 5.0\npayload_position_m = [0.1, 0.0, 0.3]",
    )
    done = command("compensate", "-v", case, "-o", tmp_path / "out", exits=0)
    files = {file.name for file in (tmp_path / "out").iterdir()}
    assert files == FILES | BY_MODE["quasistatic"] | {"plant.csv", "wrong_backlash.csv"}
    own = example.payload
    assert own is None
    robot = replace(example, payload=Body(5.0, (0.1, 0.0, 0.3), (0.0, 0.0, 0.0)))
    joints = example.joints
    changed = {f"joint[{i}].backlash": 1.3 * joints[i - 1].backlash for i in range(1, 6)}
    for i, factor in ((1, 0.97), (4, 0.9)):
        changed[f"joint[{i}].stiffness"] = factor * joints[i - 1].stiffness
        for k, tilt in enumerate(joints[i - 1].tilt, start=1):
            changed[f"joint[{i}].tilt[{k}].stiffness"] = factor * tilt.stiffness
    left = simulated(robot, "backlash", tmp_path / "out", 1.1, changed)
    figures = json.loads((tmp_path / "out" / "result.json").read_text())["plant"]
    assert figures["deviation_m"]["maximum"] == pytest.approx(left, abs=1e-12)
    assert figures["wrench"] == "model"
    assert "payload + 5 kg" in figures["differences"]
    words = in_unit(left, length_unit(left)[1])
    assert f" {words} " in done.stdout
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "On the plant" in page
    assert f"<td>{words}</td>" in page


def test_a_plant_has_other_slip_torques_where_its_gears_have_elements(tmp_path):
    gear = "gear.hysteresis = [{ slip_torque = 40.0, slip_angle = 2e-5 }]\n"
    text = shipped_robots()["icme2008"].read_text()
    (tmp_path / "slips.toml").write_text(text.replace("backlash  =", f"{gear}backlash  =", 1))
    case = load_case(moving(tmp_path, 'description = "slips.toml"\nhysteresis_factor = 0.5'))
    (robot,) = case.plant.robots
    assert robot.difference.values(robot.description, robot.torque_curve) == {
        "joint[1].hysteresis": 20.0
    }
    assert in_words(case.plant, case.robots)[-1] == "hysteresis x 0.5"


def test_a_plant_with_servos_is_behind_by_the_feed_over_their_gain(tmp_path):
    """0.1 m/s by 20 1/s are 5 mm along the stroke, on the mean; none with rate feed-forward."""
    with_motors(tmp_path)
    run = run_compensation(loaded(tmp_path, 'description = "servo.toml"\ndrive = "ideal"'))
    fast = (run.desired.time > 0.5) & (run.desired.time < 0.75)
    position = run.desired.position[0][fast]
    along = position[-1] - position[0]
    assert np.linalg.norm(along) == pytest.approx(0.1 * np.ptp(run.desired.time[fast]), rel=1e-6)
    behind = {}
    for feed_forward, drive in ((0.0, "servo"), (1.0, "servo"), (0.0, "ideal")):
        with_motors(tmp_path, feed_forward)
        keys = f'description = "servo.toml"\ndrive = "{drive}"'
        plant = on_plant(loaded(tmp_path, keys), run.correction)
        assert ('drive = "servo"' in plant.differences) == (drive == "servo")
        missed = (position - plant.path.position[0][fast]).mean(axis=0)
        behind[feed_forward, drive] = missed @ along / np.linalg.norm(along)
    assert np.array_equal(run.finding_of(PLANT_REPLAY).path.pose, plant.path.pose)
    assert behind[0.0, "servo"] == pytest.approx(0.1 / 20.0, rel=0.02)
    assert abs(behind[1.0, "servo"]) < 2e-4
    assert abs(behind[0.0, "ideal"]) < 1e-6


def test_a_plant_with_servos_is_the_fmu_with_its_drive_set_by_hand(tmp_path):
    """The model, of the same file, has ideal drives by its own key."""
    with_motors(tmp_path, 0.9)
    file = moving(tmp_path, 'drive = "servo"\ncouple = true')
    file.write_text(file.read_text().replace('"icme2008"', '"servo.toml"\ndrive = "ideal"'))
    run = run_compensation(load_case(file))
    assert run.finding_of(PLANT_REPLAY).coupling.converged
    assert run.finding_of(PLANT_REPLAY).differences == ('drive = "servo"',)
    left = measure(run.correction.achieved, run.desired).maximum
    assert left < 1e-5 < 1e-3 < run.deviation(run.finding_of(PLANT_REPLAY).path).maximum
    robot = load_case(file).plant.robots[0].description
    with RobotFmu(build_fmu(robot, tmp_path / "own.fmu", BuildOptions("native"))) as fmu:
        wrench = run.finding_of(PLANT_REPLAY).loads
        path = simulate_tuned(fmu, run.correction.joints, wrench, "dynamic", {"drive": "servo"})
    at = np.searchsorted(path.time, run.finding_of(PLANT_REPLAY).path.time)
    np.testing.assert_allclose(
        run.finding_of(PLANT_REPLAY).path.pose, path.at_rows(at).pose, rtol=0, atol=1e-12
    )


def test_another_robot_file_and_curve_move_in_place_of_the_model(tmp_path, example):
    softer = shipped_robots()["icme2008"].read_text().replace("mass      = 700.0", "mass = 800.0")
    (tmp_path / "other.toml").write_text(softer)
    case = moving(tmp_path, 'description = "other.toml"\ntorque_curve = "linear"')
    command("compensate", "-v", case, "-o", tmp_path / "out", exits=0)
    first = example.joints[0]
    other = replace(example.joints[0], body=replace(first.body, mass=800.0))
    robot = replace(example, joints=(other, *example.joints[1:]))
    simulated(robot, "linear", tmp_path / "out", 1.0, {})
    command("compensate", "-v", tmp_path / "out" / "case.toml", "-o", tmp_path / "again", exits=0)
    files = [tmp_path / name / "plant.csv" for name in ("out", "again")]
    assert files[0].read_bytes() == files[1].read_bytes()


def test_a_coupled_plant_agrees_with_its_process(tmp_path):
    """Its path under the wall's force at that very path, straight between samples, to the tolerance."""
    case = loaded(tmp_path, "stiffness_factor = 0.9\nforce_factor = 1.2\ncouple = true")
    run = run_compensation(case)
    assert run.finding_of(PLANT_REPLAY).coupling.converged
    rows = np.searchsorted(run.desired.time, case.desired.time)
    response = case.process.evaluate(run.finding_of(PLANT_REPLAY).path.at_rows(rows)).wrench
    expected = interpolate_rows(run.desired.time, response.time, 1.2 * response.wrench, axis=1)
    plant = run.finding_of(PLANT_REPLAY)
    met = plant.loads.on(plant.path).wrench
    np.testing.assert_allclose(met, expected, rtol=0, atol=1.2 * 2e5 * 1e-7)
    case = loaded(tmp_path, "stiffness_factor = 0.9\nforce_factor = 1.2")
    alone = on_plant(case, run.correction)
    maxima = [run.deviation(p.path).maximum for p in (alone, run.finding_of(PLANT_REPLAY))]
    assert abs(maxima[0] - maxima[1]) > 1e-6


def test_a_process_that_fails_on_the_plant_does_not_lose_the_run(tmp_path):
    (tmp_path / "own.py").write_text(
        "from coupling.errors import ProcessError\n"
        "from coupling.path.histories import WrenchHistory\n"
        "from coupling.process import ProcessResponse, ProcessTable\n"
        "import numpy as np\n"
        "class Twice:\n"
        "    identity, count = '', 0\n"
        "    def evaluate(self, path):\n"
        "        self.count += 1\n"
        "        if self.count > 2:\n"
        "            raise ProcessError('the press is closed')\n"
        "        return ProcessResponse(WrenchHistory.none(path.time))\n"
        "class Table(ProcessTable):\n"
        "    def process(self, task):\n"
        "        return Twice()\n"
    )
    case = moving(tmp_path, "damping_factor = 0.5\ncouple = true")
    text = case.read_text()
    text = text.replace('"elastic-wall"\nstiffness_N_m = 2.0e5', '"own.py:Table"')
    case.write_text(text)
    done = command("compensate", "-v", case, "-o", tmp_path / "out", exits=0)
    assert "the process failed on the plant's path: the press is closed" in done.stdout
    figures = json.loads((tmp_path / "out" / "result.json").read_text())["plant"]
    assert figures["coupling"] is None
    assert figures["deviation_m"]["maximum"] > 0.0


def test_a_payload_joins_the_one_that_is_there(example):
    """Mass, centre and inertia of both bodies about any point."""
    own = Body(12.0, (0.1, -0.2, 0.3), (0.5, 0.6, 0.7, 0.01, -0.02, 0.03))
    robot = replace(example, payload=own)
    difference = RobotDifference(payload=3.0, payload_position=(0.0, 0.5, -0.1))
    more = difference.applied(robot, "backlash").payload

    def about(body: Body, point: np.ndarray) -> np.ndarray:
        arm = np.array(body.com) - point
        return body.inertia_matrix + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))

    assert more.mass == 15.0
    for point in np.random.default_rng(1).normal(size=(5, 3)):
        added = Body(3.0, (0.0, 0.5, -0.1), (0.0, 0.0, 0.0))
        np.testing.assert_allclose(
            about(more, point), about(own, point) + about(added, point), atol=1e-12
        )
    carried = RobotDifference(payload=1.0).applied(example, "backlash").payload
    assert carried.com == example.tcp_position


def test_the_supporting_robot_has_a_table_of_its_own(tmp_path):
    text = (CASES / "two_robots.toml").read_text()
    text += "\n[plant]\nstiffness_factor = 0.9\n[plant.support]\npayload_kg = 3.0\n"
    (tmp_path / "cell.toml").write_text(text)
    first, second = load_case(tmp_path / "cell.toml").plant.robots
    stiffness = [robot.difference.amounts["stiffness"] for robot in (first, second)]
    assert stiffness == [(0.9,), (1.0,)]
    assert (first.difference.payload, second.difference.payload) == (0.0, 3.0)


# What is wrong with the plant, and what its message says.
BAD_PLANTS = {
    "unknown key": ("stiffness = 0.9", "did you mean 'stiffness_factor'"),
    "negative": (
        "stiffness_factor = -0.9",
        "stiffness_factor 1: expected a number greater than 0",
    ),
    "no stiffness": ("stiffness_factor = 0.0", "expected a number greater than 0"),
    "not finite": ("damping_factor = inf", "expected a finite number"),
    "wrong length": (
        "backlash_factor = [1.0, 1.1]",
        "expected one number, or 6, one for each joint",
    ),
    "empty": ("backlash_factor = []", "at least 1 item"),
    "words": ('force_factor = "much"', "force_factor: expected a valid number"),
    "no such robot": ('description = "icme2009"', "plant: description:"),
    "no cell": ("[plant.support]\npayload_kg = 1.0", "plant: support: expected none"),
    "unknown drive": ('drive = "torque"', "drive: expected 'ideal' or 'servo', got 'torque'"),
    "no motors": (
        'drive = "servo"',
        "drive: expected a [joint.drive] in the file of icme2008-example",
    ),
    "negative mass": ("payload_kg = -1.0", "payload_kg: expected a number greater than or equal"),
}


@pytest.mark.parametrize("name", BAD_PLANTS)
def test_a_bad_plant_is_one_message(tmp_path, name):
    plant, words = BAD_PLANTS[name]
    with pytest.raises(CaseError) as refused:
        loaded(tmp_path, plant)
    assert words in str(refused.value)
    assert "plant" in str(refused.value)


def test_a_robot_of_fewer_joints_cannot_stand_for_the_model(tmp_path):
    text = shipped_robots()["icme2008"].read_text()
    last = text.rindex("[[joint]]")
    (tmp_path / "short.toml").write_text(text[:last])
    with pytest.raises(CaseError, match=r"expected a robot of 6 joints.*got 5"):
        loaded(tmp_path, 'description = "short.toml"')
