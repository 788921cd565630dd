"""A base turned against gravity, and a tool tilted on its part."""

import io
import json
import tomllib
import zipfile
from pathlib import Path

import numpy as np
import pytest
import tomlkit
from places import CASES, LINE_CASE
from scipy.spatial.transform import Rotation

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.errors import CaseError
from coupling.fmu_export.ssp import SspSystem
from coupling.path.deviation import measure
from coupling.run.execute import run_coupling
from coupling.toolpaths.tilt import APPROACH

BASE = [7.0, -4.0, 20.0]


def changed(folder: Path, case: Path, **tables: dict) -> Case:
    data = tomllib.loads(case.read_text())
    for table, keys in tables.items():
        data.setdefault(table, {}).update(keys)
    file = folder / "case.toml"
    file.write_text(tomlkit.dumps(data))
    return load_case(file)


def turned_and_by_hand(folder: Path) -> tuple[Case, Case]:
    """The line on a turned base; and on an upright one with gravity and part turned the other way."""
    folder.mkdir(exist_ok=True)
    turned = changed(folder, LINE_CASE, robot={"base_rpy_deg": BASE})
    base_from_world = Rotation.from_euler("xyz", BASE, degrees=True).inv()
    file = Path("coupling/files/robots/icme2008.toml")
    text = (CASES.parents[1] / file).read_text()
    gravity = base_from_world.apply([0.0, 0.0, -9.81]).tolist()
    inclined = folder / "inclined.toml"
    old = next(line for line in text.splitlines() if line.startswith("gravity"))
    inclined.write_text(text.replace(old, f"gravity = {gravity}"))
    part = turned.task.part
    seen = {
        "position_m": base_from_world.apply(part.position).tolist(),
        "rpy_deg": (base_from_world * part.rotation).as_euler("xyz", degrees=True).tolist(),
    }
    hand = {"description": str(inclined)}
    return turned, changed(folder, LINE_CASE, robot=hand, part=seen)


def test_a_turned_base_is_gravity_and_part_turned_the_other_way(tmp_path):
    """Joints and deviations of the loaded robot are the same; paths are told in the world."""
    cases = turned_and_by_hand(tmp_path)
    own, hand = (run_coupling(case) for case in cases)
    joints = [run.correction.joints.q[0] for run in (own, hand)]
    np.testing.assert_allclose(*joints, rtol=0, atol=1e-8)
    at = cases[0].robots[0].world_from_base
    in_base = own.before.transformed(at.inverse())
    np.testing.assert_allclose(in_base.position, hand.before.position, rtol=0, atol=1e-8)
    deviations = [measure(run.before, run.desired).maximum for run in (own, hand)]
    assert deviations[0] == pytest.approx(deviations[1], rel=1e-5)
    assert deviations[0] > 1e-3
    # The part stays where it is in the world.
    upright = load_case(LINE_CASE)
    np.testing.assert_array_equal(own.desired.position[0, 0], upright.desired.position[0, 0])


def test_a_turned_base_makes_the_robot_sag_sideways(tmp_path):
    """A robot that leans to its right is pulled to its right."""
    leaning = changed(tmp_path, LINE_CASE, robot={"base_rpy_deg": [10.0, 0.0, 0.0]})
    gravity = np.array(leaning.robots[0].description.gravity)
    np.testing.assert_allclose(
        gravity, 9.81 * np.array([0.0, -np.sin(np.deg2rad(10)), -np.cos(np.deg2rad(10))])
    )


def test_the_plant_and_the_second_robot_stand_as_their_models_do(tmp_path):
    plant = changed(
        tmp_path, LINE_CASE, robot={"base_rpy_deg": BASE}, plant={"description": "fanuc_r2000ic"}
    )
    assert plant.plant is not None
    assert plant.plant.robots[0].description.gravity == plant.robots[0].description.gravity
    hanging = changed(
        tmp_path, CASES / "two_robots.toml", support={"base_rpy_deg": [0.0, 180.0, 0.0]}
    )
    np.testing.assert_allclose(hanging.robots[1].description.gravity, [0, 0, 9.81], atol=1e-12)
    np.testing.assert_array_equal(hanging.robots[0].description.gravity, [0, 0, -9.81])


def test_an_ssp_of_a_turned_robot_is_in_the_frame_of_its_base(tmp_path):
    """The wall in its process FMU is that of the case that is turned by hand."""
    laws = []
    for k, case in enumerate(turned_and_by_hand(tmp_path)):
        with zipfile.ZipFile(
            SspSystem.of(case).write(tmp_path / f"{k}.ssp", ["linux64"])
        ) as system:
            inner = io.BytesIO(system.read("resources/Process.fmu"))
        with zipfile.ZipFile(inner) as fmu:
            law = json.loads(fmu.read("resources/law.json"))
        laws.append(
            np.concatenate([law["pose_at_start"], *map(np.ravel, law["constants"].values())])
        )
    np.testing.assert_allclose(*laws, rtol=0, atol=1e-9)


TILT = {"lead_deg": 12.0, "lean_deg": -25.0, "rotation_deg": 40.0}


def test_a_tilted_tool_is_turned_about_the_parts_axes_and_its_own(tmp_path):
    """R = Rx(lean) Ry(lead) R_upright Rx(rotation), seen from the part."""
    plain, tilted = load_case(LINE_CASE), changed(tmp_path, LINE_CASE, tool_path=TILT)
    part = plain.task.part
    turn = Rotation.from_euler("x", -25.0, degrees=True) * Rotation.from_euler(
        "y", 12, degrees=True
    )
    upright = part.rotation.inv() * plain.desired.rotations[0][3]
    expected = part.rotation * turn * upright * Rotation.from_euler("x", 40.0, degrees=True)
    assert (expected * tilted.desired.rotations[0][3].inv()).magnitude() < 1e-12
    np.testing.assert_array_equal(tilted.desired.position, plain.desired.position)


def test_the_tcp_stays_the_lowest_point_of_the_tools_sphere(tmp_path):
    """The sphere's centre is where the upright tool has it, and the robot's TCP is below it."""
    case = CASES / "cone.toml"
    plain, tilted = load_case(case), changed(tmp_path, case, tool_path=TILT)
    radius, row = 0.005, 100
    below = np.array([0.0, 0.0, -radius])
    for own in (plain, tilted):
        robot = own.robots[0].description
        body_from_tool = Rotation.from_euler("xyz", robot.tcp_rpy)
        tip = np.array(plain.robots[0].description.tcp_position)
        center_on_tool = tip - body_from_tool.apply(radius * APPROACH)
        from_center = body_from_tool.inv().apply(np.array(robot.tcp_position) - center_on_tool)
        assert np.linalg.norm(from_center) == pytest.approx(radius)
        world = own.desired.rotations[0][row].apply(from_center)
        np.testing.assert_allclose(world, below, atol=1e-15)
    np.testing.assert_array_equal(tilted.desired.position, plain.desired.position)


def test_a_force_law_does_not_know_how_the_tool_is_held_by_its_sphere(tmp_path):
    """Nor does the computed sheet: tests/toolpaths/test_tilt.py has it of a tool that turns."""
    path = {"depth_m": 0.001, "radius_m": 0.03}
    plain = changed(tmp_path, CASES / "cone.toml", tool_path=path)
    tilted = changed(tmp_path, CASES / "cone.toml", tool_path=path | TILT)
    forces = [case.process.evaluate(case.desired).wrench.wrench for case in (plain, tilted)]
    assert np.abs(forces[0]).max() > 50.0
    np.testing.assert_allclose(forces[1], forces[0], rtol=0, atol=1e-5)


def test_a_sphere_on_a_tool_that_is_turned_along_its_path_is_led_by_its_centre(tmp_path):
    """Tilted, its centre stays where the rows alone have it; with other processes the tip stays."""
    rows = ["time,x,y,z,qx,qy,qz,qw"]
    for k in range(12):
        about = Rotation.from_euler("yz", [90.0 + 2.0 * k, 3.0 * k], degrees=True)
        x, y, z, w = about.as_quat()
        rows.append(f"{0.1 * k},{0.001 * k},0,0,{x},{y},{z},{w}")
    (tmp_path / "path.csv").write_text("\n".join(rows))
    path = {"kind": "csv", "file": str(tmp_path / "path.csv")}
    data = tomllib.loads((CASES / "cone.toml").read_text())
    wall = data["process"] | {"wall_angle_deg": 45.0, "step_down_m": 0.0005}
    file, found = tmp_path / "case.toml", []
    for process in (wall, {"model": "elastic-wall", "stiffness_N_m": 1e4}):
        for tilt in ({"rotation_deg": 30.0}, {"lead_deg": 5.0}):
            file.write_text(tomlkit.dumps(data | {"process": process, "tool_path": path | tilt}))
            found.append(load_case(file))
    plain, tilted, tip, tilted_tip = (case.desired for case in found)
    centre = plain.position[0] - 0.005 * plain.rotations[0].apply(APPROACH)
    np.testing.assert_allclose(tilted.position[0], centre, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(tilted_tip.position, tip.position)
    np.testing.assert_array_equal(found[1].task.contact, np.zeros(3))


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"tool_path": {"lead_deg": 90.0}}, "lead_deg: expected a number less than 90, got 90.0"),
        ({"robot": {"base_rpy_deg": [1.0]}}, "base_rpy_deg: expected at least 3"),
        ({"place": {"x_m": [2.0, 1.0]}}, r"x_m: expected \[low, high\], low <= high, got"),
        ({"place": {"lean_deg": [-95.0, 0.0]}}, "lean_deg: expected angles between -89 and 89"),
        (
            {"place": {"optimise": "speed"}},
            "optimise: expected 'stiffness', 'backlash', 'both' or 'stability'",
        ),
        ({"place": {"roll": [0.0, 1.0]}}, "expected one of x_m"),
    ],
)
def test_what_cannot_be_is_refused_with_its_place(tmp_path, tables, words):
    with pytest.raises(CaseError, match=words):
        changed(tmp_path, LINE_CASE, **tables)
