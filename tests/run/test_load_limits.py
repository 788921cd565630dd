"""Loads beyond what a robot is rated for, and values out of what is usual: never in silence."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from line_case import changed_text, moving_line
from places import CASES, EXAMPLES

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.files.provenance import Ratings, load_provenance
from coupling.files.robot_file import find_robot, load_robot
from coupling.files.robot_schema import GearTorque
from coupling.inverse.diagnosis import diagnose, gear_loads
from coupling.inverse.inversion import DesiredMotion, MovingRobot
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.robot.robot_edit import RobotEdit
from coupling.run.gear_loads import exceeded
from coupling.run.plausibility import remarks

HOME = np.deg2rad([0.0, 10.0, 20.0, 0.0, 60.0, 0.0])
ICME = find_robot("icme2008")
# Joint 2's own, so that no other joint's line is changed.
JOINT_2 = "origin    = [0.35, 0.0, 0.75]         # in body 1\n"
RATED_2 = "gear_torque_Nm = { peak = 3000.0, emergency = 6000.0 }\n"
FORCED = 20_000.0


def held_still(robot, force) -> DesiredMotion:
    """The tool 1.6 m before the base for 1 s, under one force."""
    time = np.linspace(0.0, 1.0, 51)
    half = np.sqrt(0.5)
    path = ToolPath(time, np.tile([1.6, 0.0, 0.8, 0.0, half, 0.0, half], (len(time), 1)))
    rigid = InverseKinematics(robot, HOME).plan(path)
    return DesiredMotion(
        path, rigid, WrenchHistory.of_forces(time, [np.tile(force, (len(time), 1))])
    )


def test_the_gear_of_a_vertical_axis_carries_the_force_across_times_its_arm(example):
    """No weight turns it, so 1.6 m times the force is all; tilts under load shift the arm a little."""
    gear = diagnose(MovingRobot(example, "linear"), held_still(example, [0.0, 2000.0, 0.0]))[0]
    assert gear.torque == pytest.approx(1.6 * 2000.0, rel=2e-3)


def test_the_time_of_the_largest_torque_is_that_of_the_largest_force(example):
    wanted = held_still(example, [0.0, 1000.0, 0.0])
    bump = np.exp(-(((wanted.path.time - 0.7) / 0.1) ** 2))
    loads = WrenchHistory(wanted.path.time, wanted.wrench.wrench * bump[:, None])
    gear = diagnose(
        MovingRobot(example, "linear"), DesiredMotion(wanted.path, wanted.rigid, loads)
    )[0]
    assert gear.torque_time == pytest.approx(0.7, abs=0.03)


def test_a_force_that_jumps_is_carried_as_it_is(example):
    """Tilts that spring back within 4 ms would need more than a tenth more of the gear."""
    wanted = held_still(example, [0.0, 2000.0, 0.0])
    on = (wanted.path.time > 0.5)[:, None]
    loads = WrenchHistory(wanted.path.time, wanted.wrench.wrench * on)
    robot, sudden = MovingRobot(example, "linear"), DesiredMotion(wanted.path, wanted.rigid, loads)
    # What smooths the force between samples overshoots a jump by a few percent.
    assert diagnose(robot, sudden)[0].torque == pytest.approx(1.6 * 2000.0, rel=0.05)
    assert np.abs(gear_loads(robot, sudden).torque[:, 0]).max() > 1.1 * 1.6 * 2000.0


def test_each_rating_warns_above_itself_and_not_below(example):
    wanted = held_still(example, [0.0, 2000.0, 0.0])
    gears = diagnose(MovingRobot(example, "linear"), wanted)
    torque = gears[0].torque

    def names(payload=None, **rated: float) -> list[str]:
        ratings = Ratings(payload, {1: GearTorque(**rated)} if rated else {})
        return [warning.name for warning in exceeded(ratings, wanted.wrench, gears)]

    assert names() == []
    assert names(payload=2001.0) == []
    assert names(payload=1999.0) == ["payload"]
    assert names(peak=1.001 * torque, emergency=2.0 * torque) == []
    assert names(peak=0.999 * torque, emergency=2.0 * torque) == ["gear-torque-peak"]
    assert names(peak=0.5 * torque, emergency=0.999 * torque) == ["gear-torque-emergency"]
    assert names(emergency=1.001 * torque) == []


def test_a_warning_says_joint_value_time_and_limit(example):
    wanted = held_still(example, [0.0, 2000.0, 0.0])
    gears = diagnose(MovingRobot(example, "linear"), wanted)
    ratings = Ratings(1500.0, {1: GearTorque(peak=3000.0)})
    force, gear = map(str, exceeded(ratings, wanted.wrench, gears, "support"))
    assert force == (
        "support: the force on the tool is 2000 N at t = 0.000 s; the robot's rated load is 1500 N"
    )
    assert gear.startswith("support: joint 1: its gear carries 32")
    assert gear.endswith("its peak torque is 3000 N m")


def test_ratings_are_read_and_change_no_robot(tmp_path):
    """The model, and with it the FMU, is the same robot with and without them."""
    text = ICME.read_text()
    file = tmp_path / "robot.toml"
    file.write_text(text.replace(JOINT_2, JOINT_2 + RATED_2))
    robot = load_robot(file)
    assert robot == load_robot(ICME)
    assert load_provenance(file, robot).ratings == Ratings(
        2650.0, {2: GearTorque(peak=3e3, emergency=6e3)}
    )


def test_beside_a_urdf_gears_are_found_by_the_names_of_their_joints(tmp_path):
    text = (EXAMPLES / "robots" / "kuka_kr210.toml").read_text()
    first, third = '[[joint]]\nname = "joint_a1"\n', '[[joint]]\nname = "joint_a3"\n'
    assert text.index(first) < text.index(third)
    # The third joint's table comes first.
    text = text.replace(third, "[[joint]]\n").replace(first, third)
    text = text.replace("[[joint]]\nstiffness", f"{first}stiffness")
    file = tmp_path / "kuka.toml"
    file.write_text(text.replace(third, f"{third}gear_torque_Nm = {{ peak = 7000.0 }}\n"))
    found = load_provenance(file, load_robot(file)).ratings
    assert found == Ratings(1470.0, {3: GearTorque(peak=7000.0)})


def test_a_written_robot_file_keeps_its_ratings(tmp_path):
    file = tmp_path / "rated.toml"
    file.write_text(ICME.read_text().replace(JOINT_2, JOINT_2 + RATED_2))
    text = RobotEdit(file, load_robot(file)).text("As it was.", file)
    assert tomllib.loads(text) == tomllib.loads(file.read_text())


@pytest.mark.parametrize("name", sorted(file.stem for file in CASES.glob("*.toml")))
def test_every_example_is_read_and_not_remarked_upon(name):
    """With the answer to the desired path where that is a formula's."""
    case = load_case(CASES / f"{name}.toml")
    assert len(case.desired.time) > 10
    wrench = case.process.evaluate(case.desired).wrench if case.process_table.FORMULA else None
    assert remarks(case, wrench) == ()


def changed(folder: Path, name: str, *changes: tuple[str, str]) -> Case:
    """Return an example with changes of its text."""
    file = folder / f"{name}.toml"
    file.write_text(changed_text(CASES / file.name, *changes))
    return load_case(file)


# An example, what is changed in it, and how its only remark ends.
SLIPS = {
    "strength in MPa": (
        "cone",
        ("tensile_strength_Pa       = 1.05e8", "tensile_strength_Pa = 310.0"),
        "got 310 Pa: did you mean 3.1e+08 Pa (310 MPa)?",
    ),
    "modulus in GPa": (
        "cone_fem",
        ("youngs_modulus_Pa  = 7.0e10", "youngs_modulus_Pa = 70.0"),
        "got 70 Pa: did you mean 7e+10 Pa (70 GPa)?",
    ),
    "stiffness in N/mm": (
        "cone",
        ("penetration_stiffness_N_m = 1.2e5", "penetration_stiffness_N_m = 120.0"),
        "got 120 N/m: did you mean 1.2e+05 N/m (120 N/mm)?",
    ),
    "thickness in mm": (
        "cone",
        ("sheet_thickness_m         = 0.001", "sheet_thickness_m = 1.0"),
        "got 1 m: did you mean 0.001 m (1 mm)?",
    ),
    "feed in mm/s": (
        "measured_line",
        ("feed_m_s = 0.05", "feed_m_s = 50.0"),
        "got 50 m/s: did you mean 0.05 m/s (50 mm/s) or 0.8333 m/s (50 m/min) or 0.0008333 m/s"
        " (50 mm/min)?",
    ),
    "cutting coefficient in MPa": (
        "milling_20000",
        ("K_tc_Pa           = 7.67e8", "K_tc_Pa = 767.0"),
        "got 767 Pa: did you mean 7.67e+08 Pa (767 MPa)?",
    ),
    "depth of three diameters": (
        "milling_20000",
        ("[0.06, 0.0, -0.003], [0.14, 0.0, -0.003]", "[0.06, 0.0, -0.048], [0.14, 0.0, -0.048]"),
        "slots to about one deep, walls to two), got 3 diameters of the cutter",
    ),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_what_is_legal_but_unusual_is_remarked_upon_once(tmp_path, slip):
    name, change, end = SLIPS[slip]
    case = changed(tmp_path, name, *files_of(name), change)
    (said,) = remarks(case)
    assert said.endswith(end)


def files_of(name: str) -> list[tuple[str, str]]:
    """Return the change that lets a copy of an example find its file."""
    measured = EXAMPLES / "measured" / "line_force.csv"
    return [("../measured/line_force.csv", str(measured))] if name == "measured_line" else []


def test_a_force_of_zero_everywhere_is_remarked_upon_unless_there_is_no_contact_at_all():
    case = load_case(CASES / "cone.toml")
    none = WrenchHistory.none(case.desired.time)
    (said,) = remarks(case, none)
    assert said.startswith("process: expected a force along the path, got 0 N everywhere")
    assert remarks(load_case(CASES / "iso9283.toml"), none) == ()


def test_a_gear_with_slip_angles_in_arc_minutes_is_remarked_upon(tmp_path):
    """And with 30 kN m of friction; what is usual beside it is not."""
    usual = "{ slip_torque = 40.0, slip_angle = 2e-5 }"
    gear = f"gear.hysteresis = [{usual}, {{ slip_torque = 3e4, slip_angle = 0.5 }}]\n"
    (tmp_path / "robot.toml").write_text(ICME.read_text().replace(JOINT_2, JOINT_2 + gear))
    (tmp_path / "line.toml").write_text(moving_line(('"icme2008"', '"robot.toml"')))
    torque, angle = remarks(load_case(tmp_path / "line.toml"))
    place = "robot icme2008-example: joint 2: "
    assert torque.startswith(f"{place}hysteresis: expected 0.001 to 1e+04 N m")
    assert "got 30040 N m" in torque
    assert angle.startswith(f"{place}gear: hysteresis 2: slip_angle: expected 1e-07 to 0.003 rad")
    assert angle.endswith(
        "got 0.5 rad: did you mean 2.424e-06 rad (0.5 arcsec) or 0.0001454 rad (0.5 arcmin)?"
    )


def test_a_home_posture_beyond_the_limits_is_remarked_upon(tmp_path):
    """It is where inverse kinematics starts, no more: the path may be planned from it all the same."""
    limited = JOINT_2 + "limits = [-1.0, 1.0]\n"
    (tmp_path / "robot.toml").write_text(ICME.read_text().replace(JOINT_2, limited))
    text = moving_line(('"icme2008"', '"robot.toml"'))
    home = tomllib.loads(text)["robot"]["home_deg"]
    assert abs(home[1]) < 57.0
    (tmp_path / "line.toml").write_text(text)
    assert not any("home_deg" in said for said in remarks(load_case(tmp_path / "line.toml")))
    (tmp_path / "line.toml").write_text(text.replace(str(home), str([home[0], 90.0, *home[2:]])))
    (said,) = remarks(load_case(tmp_path / "line.toml"))
    assert "home_deg of joint 2: expected -57.3 to 57.3 deg, its limits, got 90" in said


def test_drives_are_remarked_upon_where_they_are_not_usual_and_where_they_do_not_move(tmp_path):
    """A rotor in kg cm2, a position gain in m/min/mm, a rate gain of another rotor."""
    drive = "drive = {{ rotor_inertia_kg_m2 = {}, gear_ratio = 200.0, servo = {{ {} }} }}\n"

    def said(rotor: str, servo: str, plant: str = "", drives: str = "ideal") -> tuple[str, ...]:
        text = ICME.read_text().replace(JOINT_2, JOINT_2 + drive.format(rotor, servo))
        (tmp_path / "robot.toml").write_text(text)
        line = moving_line(('"icme2008"', f'"robot.toml"\ndrive = "{drives}"')) + plant
        (tmp_path / "line.toml").write_text(line)
        return remarks(load_case(tmp_path / "line.toml"))

    usual = "5e-3", "position_gain = 20.0, rate_gain = 4e4"
    ideal = (
        "robot icme2008-example: its drives are ideal, all figures are without following error and"
        ' friction: drive = "servo" in [robot] computes the command of its servos'
    )
    assert said(*usual) == (ideal,)
    assert said(*usual, '[plant]\ndrive = "ideal"\n') == (ideal,)
    assert said(*usual, '[plant]\ndrive = "servo"\n') == ()
    assert said(*usual, drives="servo") == ()
    first, rate, rotor, gain = said("50.0", "position_gain = 1.2, rate_gain = 1e7")
    place = "robot icme2008-example: joint 2: "
    assert rotor.startswith(f"{place}drive: rotor_inertia_kg_m2: expected 1e-07 to 1 kg m2")
    assert "got 50 kg m2: did you mean 0.005 kg m2 (50 kg cm2)" in rotor
    assert gain.startswith(f"{place}drive: servo: position_gain: expected 3 to 100 1/s")
    assert gain.endswith("got 1.2 1/s: did you mean 20 1/s (1.2 m/min/mm)?")
    assert rate.startswith(f"{place}rate loop: expected 2 to 500 Hz")
    assert first == ideal


@pytest.fixture
def forced(tmp_path, monkeypatch, command):
    """Function that runs a command on a short line under 20 kN; returns what was said."""
    (tmp_path / "force.csv").write_text(
        f"distance,fx,fy,fz\n0,0,0,0\n0.02,{-FORCED},0,0\n0.04,{-FORCED},0,0\n0.07,0,0,0\n"
    )
    text = ICME.read_text().replace(JOINT_2, JOINT_2 + RATED_2)
    (tmp_path / "robot.toml").write_text(text)
    (tmp_path / "line.toml").write_text(
        moving_line(
            ('"icme2008"', '"robot.toml"'),
            ('model         = "elastic-wall"', 'model = "measured"'),
            ("stiffness_N_m = 2.0e5", 'file = "force.csv"'),
        )
    )
    monkeypatch.chdir(tmp_path)

    def run(*words: str) -> str:
        done = command(*words, "-v", "-o", "out" if words[0] != "check" else "check.html", exits=0)
        return done.stdout

    return run


PUSHED = "Warning: the force on the tool is 20000 N at t = "


def test_check_warns_of_the_process_s_force_when_it_is_asked_for(forced):
    said = forced("check", "line.toml", "--evaluate")
    assert PUSHED.removeprefix("Warning: ") in said
    assert "joint 2: its gear carries " in said
    assert "its torque in an emergency stop is 6000 N m" in said
    assert "its rated load" not in said
    page = Path("check.html").read_text()
    assert "the force on the tool is 20000 N" in page


def test_check_without_the_process_judges_weight_and_motion_alone(forced):
    """Joint 2 carries 1.4 t at about a metre, more than the 3000 N m that its file allows."""
    said = forced("check", "line.toml")
    assert "the force on the tool" not in said
    assert "joint 2: its gear carries " in said


@pytest.mark.parametrize("kind", ["couple", "compensate"])
def test_a_run_warns_in_console_result_and_report(forced, kind):
    said = forced(kind, "line.toml")
    assert PUSHED in said
    assert "Remark" not in said
    result = json.loads(Path("out", "result.json").read_text())
    force, gear, *others = result["warnings"]
    # Of 20 kN that begin between two samples it is told as well what that costs.
    assert [warning["name"] for warning in others] == ["sampling"]
    assert (force["name"], force["robot"], force["joint"]) == ("payload", "forming", None)
    assert force["value"] == pytest.approx(FORCED, rel=1e-6)
    assert force["limit"] == 2650.0
    assert (gear["name"], gear["joint"], gear["limit"]) == ("gear-torque-emergency", 2, 6000.0)
    (of_2,) = [own for own in result["gears"] if own["joint"] == 2]
    assert gear["value"] == of_2["torque_Nm"]
    assert gear["time"] == of_2["torque_time_s"]
    assert result["remarks"] == result["rate_warnings"] == []
    page = Path("out", "report.html").read_text()
    for own in (force, gear, *others):
        assert f"Warning: {own['text']}" in said
        assert f"Warning: {own['text']}".replace("'", "&#x27;") in page


def test_a_remark_stands_in_console_result_and_report(forced):
    Path("force.csv").write_text("distance,fx,fy,fz\n0,0,0,0\n0.07,0,0,0\n")
    said = forced("couple", "line.toml")
    assert "Remark: process: expected a force along the path, got 0 N everywhere" in said
    (remark,) = json.loads(Path("out", "result.json").read_text())["remarks"]
    page = Path("out", "report.html").read_text()
    assert f"Remark: {remark}" in page
