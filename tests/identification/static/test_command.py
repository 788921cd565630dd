"""elastic-robot identify and robots, as a user types them."""

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from noisy_arm import exact, noisy
from pages import drawn_in
from places import EXAMPLES

from coupling.files.robot_file import load_robot, robot_numbers, shipped_robots
from coupling.identification.static.identification import SUPPORTED
from coupling.identification.static.measurements import read_measurements
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot, Tilt
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import RobotFileError
from elastic_robot.parameters import Parameters
from elastic_robot.static_sensitivity import static_sensitivities
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import LinearCurve

FANUC = EXAMPLES / "identify" / "fanuc_r2000ic.csv"
START = EXAMPLES / "identify" / "fanuc_start.toml"


def test_measurements_become_a_robot_file_a_report_and_figures(command, tmp_path):
    target = tmp_path / "new" / "fanuc.toml"
    tilt = "joint[3].tilt about [0, 0, 1]"
    done = command("identify", FANUC, "--robot", START, "--add", tilt, "-v", "-o", target, exits=0)
    assert "joint[6].stiffness" in done.stdout
    assert "not identified: its confidence interval includes a rigid joint" in done.stdout
    found = json.loads(target.with_suffix(".json").read_text())
    by_name = {entry["name"]: entry for entry in found["parameters"]}
    robot = load_robot(target)
    assert robot.joints[2].tilt[0].axis == (0.0, 0.0, 1.0)
    assert robot.joints[2].tilt[0].stiffness == by_name["joint[3].tilt[1].stiffness"]["written"]
    assert by_name["joint[6].stiffness"]["high"] is None
    page = target.with_suffix(".html").read_text()
    assert set(drawn_in(page)) >= {"residuals"}
    assert {line["name"] for line in drawn_in(page, "scenes")["arrows_scene"]["lines"]} == {
        "measured",
        "predicted",
    }
    assert "sample 17" in str(drawn_in(page)["residuals"])
    assert "joint[3].tilt[1]" in page
    assert "http-equiv" not in page
    places = dict.fromkeys(number.source for number in robot_numbers(target)[1])
    assert "identified, fanuc_r2000ic.csv, 43 measurements" in places
    # What was written is a start of its own, from which nothing moves.
    command("identify", FANUC, "--robot", target, "-o", tmp_path / "again.toml", exits=0)
    np.testing.assert_allclose(
        [joint.stiffness for joint in load_robot(tmp_path / "again.toml").joints],
        [joint.stiffness for joint in robot.joints],
        rtol=1e-4,
    )


def test_a_robot_of_a_urdf_keeps_its_frames(command, tmp_path):
    """The tilt that is added stands in the URDF joint's own frame."""
    pytest.importorskip(
        "rtbdata", reason="needs the package rtb-data, which is in the extra 'test'"
    )
    kuka = EXAMPLES / "robots" / "kuka_kr210.toml"
    true = load_robot(kuka)
    axis = tuple(np.cross(true.joints[2].axis, [1.0, 0.0, 0.0]).round(12).tolist())
    tilted = replace(true.joints[2], tilt=(Tilt(axis, 1.5e6, 0.0),))
    robot = replace(true, joints=(*true.joints[:2], tilted, *true.joints[3:]))
    rows = noisy(exact(robot, 16, seed=3), np.random.default_rng(0), 5e-6)
    names = [*(f"q{i}" for i in range(1, 7)), "fx", "fy", "fz", "dx", "dy", "dz"]
    table = tmp_path / "kuka.csv"
    lines = np.hstack([rows.q, rows.wrench[:, :3], rows.deflection])
    np.savetxt(table, lines, delimiter=",", header=",".join(names), comments="", fmt="%.17g")
    target = tmp_path / "found.toml"
    command("identify", table, "--robot", kuka, "--add", SUPPORTED, "-o", target, exits=0)
    found = load_robot(target)
    assert [len(joint.tilt) for joint in found.joints] == [0, 0, 1, 0, 0, 0]
    np.testing.assert_allclose(np.abs(found.joints[2].tilt[0].axis), np.abs(axis), atol=1e-12)
    assert found.joints[2].tilt[0].stiffness == pytest.approx(1.5e6, rel=0.05)


def test_a_plan_is_a_table_to_fill_in(command, tmp_path):
    target = tmp_path / "plan.csv"
    done = command("identify", "--plan", "--robot", START, "--count", 3, "-o", target, exits=0)
    assert "3 poses and loads are planned" in done.stdout
    assert "joint[6].stiffness" in target.with_suffix(".html").read_text()
    text = target.read_text()
    refused = command("identify", target, "--robot", START, exits=2)
    assert "dx: expected a finite number, got ''" in refused.stderr
    target.write_text(text.replace(",,,", ",1e-3,0,-1e-3"))
    assert read_measurements(target, 6).count == 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.csv"], "none.csv: cannot be read"),
        ([FANUC, "--robot", "fanuk"], "expected one of"),
        ([FANUC, "--robot", START, "--loss", "hubert"], "did you mean 'huber'"),
        ([FANUC, "--robot", START, "--torque-curve", "lineal"], "did you mean 'linear'"),
        ([FANUC, "--robot", START, "--sd-N", "5"], "--sd-m"),
        ([FANUC, "--robot", START, "--sd-m", "-1"], "> 0"),
        ([FANUC, "--robot", START, "--add", "joint[3].tilt"], "--add: expected"),
        ([FANUC, "--robot", START, "-o", "x.json"], "ends in .toml, got 'x.json'"),
    ],
)
def test_a_mistake_is_one_sentence_and_status_2(command, arguments, words, tmp_path):
    output = () if "-o" in arguments else ("-o", tmp_path / "x.toml")
    done = command("identify", *arguments, *output, exits=2)
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "x.toml").exists()


def test_where_nothing_is_identified_there_is_no_file_and_status_1(command, tmp_path):
    lines = FANUC.read_text().splitlines()
    table = tmp_path / "one.csv"
    table.write_text("\n".join(lines[:8]))
    done = command("identify", table, "--robot", START, "-o", tmp_path / "one.toml", exits=1)
    assert "NOT IDENTIFIED, no file was written: nothing is identified" in done.stdout
    assert not (tmp_path / "one.toml").exists()
    assert (tmp_path / "one.html").exists()


def test_every_number_of_every_shipped_robot_has_a_source(command):
    shipped = shipped_robots()
    assert set(shipped) >= {"icme2008", "fanuc_r2000ic", "abb_irb7600", "kuka_kr210", "kuka_kr300"}
    for file in shipped.values():
        assert [number.place for number in robot_numbers(file)[1] if not number.source] == []
    done = command("robots", exits=0)
    for name in shipped:
        assert f"{name} (" in done.stdout
    one = command("robots", "abb_irb7600")
    assert "joint[4].stiffness = 638000: Bharti 2024" in one.stdout


def rotational_trace(robot: Robot, q: np.ndarray) -> float:
    """Trace of the unloaded, weightless, unbalanced robot's rotational compliance [rad/(N m)]."""
    bare = [replace(joint, balancer=None) for joint in robot.joints]
    chain = build_chain(replace(robot, joints=tuple(bare)))
    dynamics = Dynamics(chain, np.zeros(3))
    curve = LinearCurve.build(Parameters.of(robot))
    x = np.zeros(chain.elastic_count)
    at_rest = static_sensitivities(dynamics, curve, q, x, ToolLoad())
    return float(np.trace(at_rest.tcp.wrench[3:, 3:]))


@pytest.mark.parametrize("name", sorted(shipped_robots()))
def test_the_trace_of_the_rotational_compliance_is_the_sum_of_compliances_in_every_pose(name):
    """trace(sum_j z_j c_j z_j^T) = sum_j c_j, since axes are unit vectors: a test that needs no pose."""
    if name == "kuka_kr210":
        pytest.importorskip("rtbdata", reason="needs rtb-data, which is in the extra 'test'")
    robot, rng = load_robot(shipped_robots()[name]), np.random.default_rng(0)
    expected = np.sum(1.0 / Parameters.of(robot).stiffness)
    for q in rng.uniform(-3.0, 3.0, (10, len(robot.joints))):
        assert rotational_trace(robot, q) == pytest.approx(expected, rel=1e-12)


def test_the_published_compliance_of_the_irb_7600_has_the_trace_of_its_stiffnesses():
    """Bharti 2024: the diagonal of the rotational block, 0.469, 1.85 and 3.4 urad/(N m)."""
    robot = load_robot(shipped_robots()["abb_irb7600"])
    published = 4.69e-7 + 18.5e-7 + 34e-7
    assert rotational_trace(robot, np.zeros(6)) == pytest.approx(published, rel=2e-3)


def test_a_source_of_no_number_is_refused(tmp_path):
    text = START.read_text().replace('"joint.mass" =', '"joint.weight" =')
    (tmp_path / "robot.toml").write_text(text)
    for read in (load_robot, robot_numbers):
        with pytest.raises(
            RobotFileError, match=r"sources: expected one of .* got 'joint\.weight'"
        ):
            read(tmp_path / "robot.toml")
    assert tomllib.loads(text)["sources"]["joint.weight"]
