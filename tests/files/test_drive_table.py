"""[joint.drive]: what is read is the motor of the data sheet, at the gear's output, or is refused."""

import math
import re
import tempfile
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from drive_file import lines, written
from hypothesis import assume, given
from hypothesis import strategies as st
from places import DOCS

from coupling.files.robot_file import load_robot, parts_in_words, shipped_robots
from coupling.fmu_export.build import build_fmu
from coupling.fmu_export.index_html import index_html
from coupling.robot.robot_edit import RobotEdit
from elastic_robot.description import Robot
from elastic_robot.drive import Drive
from elastic_robot.errors import RobotFileError


def read(drive: str) -> Drive:
    """Return the drive as it is read, through JSON as an FMU in Python has it."""
    with tempfile.TemporaryDirectory() as folder:
        robot = load_robot(written(Path(folder), drive))
    assert Robot.from_json(robot.to_json()) == robot
    assert robot.joints[0].drive is None
    found = robot.joints[1].drive
    assert found is not None
    return found


def test_a_data_sheet_at_the_output_of_the_gear():
    """The rotor's energy J w^2 / 2 is the same on both sides of the gear, so J goes with its square."""
    drive = read(lines())
    rate_gain = 200.0 * 2.0 * math.pi * 30.0
    expected = Drive(
        *(200.0, 20.0, rate_gain, rate_gain / 0.02, 0.9, 120.0, 3e-5, 40.0),
        stribeck=0.25,
        stribeck_rate=0.02,
        torque_limit=5000.0,
        torque_per_current=300.0,
    )
    for key, value in vars(expected).items():
        assert getattr(drive, key) == pytest.approx(value, rel=1e-15), key


numbers = st.floats(-3.0, 3.0).map(lambda power: 10**power)


@given(numbers, numbers, numbers, st.floats(-1.0, 3.0).map(lambda power: 10**power), numbers)
def test_both_forms_of_a_servo_are_one(rotor, ratio, position, bandwidth, time):
    """A rotor alone follows rates as a low-pass of the bandwidth; the integral is a time behind."""
    assume(2.0 * np.pi * bandwidth > 1.01 / (time + 1.0 / position))  # others swing up
    own = {"rotor_inertia_kg_m2": repr(rotor), "gear_ratio": repr(ratio)}
    told = read(
        lines(
            servo=f"{{ position_gain = {position!r}, rate_bandwidth_Hz = {bandwidth!r},"
            f" integral_time_s = {time!r} }}",
            **own,
        )
    )
    np.testing.assert_allclose(told.rate_gain / told.inertia, 2 * np.pi * bandwidth, rtol=1e-14)
    np.testing.assert_allclose(told.rate_gain / told.integral_gain, time, rtol=1e-14)
    assert told.inertia / rotor == pytest.approx(ratio**2, rel=1e-14)
    gains = f"rate_gain = {told.rate_gain!r}, integral_gain = {told.integral_gain!r}"
    assert told == read(lines(servo=f"{{ position_gain = {position!r}, {gains} }}", **own))


@given(numbers, st.floats(1.0, 10.0), numbers, numbers)
def test_friction_is_that_of_the_file_at_rest_and_at_high_rates(coulomb, more, rate, viscous):
    text = f"coulomb_Nm = {coulomb!r}, stiction_Nm = {coulomb * more!r}, viscous_Nm_s = {viscous!r}"
    drive = read(lines(friction=f"{{ {text}, stribeck_rate = {rate!r} }}", max_torque_Nm=None))
    at_rest = drive.friction_torque(drive.friction, 1.0, 0.0, 0.0)
    assert at_rest == coulomb * more
    fast = 10.0 * rate
    moving = drive.friction_torque(drive.friction, -1.0, -fast, 0.0)
    assert moving == pytest.approx(-coulomb - viscous * fast, rel=1e-12)
    assert drive.torque_limit is None


def test_what_a_file_leaves_out_is_what_the_page_says():
    """Without friction and feed-forward of a part, without an integral, without a limit."""
    least = lines(
        friction=None,
        servo="{ position_gain = 20, rate_gain = 1e4 }",
        max_torque_Nm=None,
        torque_constant_Nm_A=None,
    )
    assert read(least) == Drive(200.0, 20.0, 1e4)
    alike = [
        read(lines(friction=f"{{ coulomb_Nm = 90.0{more} }}"))
        for more in ("", ", stiction_Nm = 90")
    ]
    assert alike[0] == alike[1]
    assert (alike[0].friction, alike[0].stribeck) == (90.0, 0.0)


@pytest.mark.parametrize("name", ["icme2008", "kuka_kr210"])
def test_a_drive_is_read_in_a_complete_file_and_beside_a_urdf_and_stays_in_a_written_one(
    name, tmp_path
):
    start = shipped_robots()[name]
    tables = start.read_text().split("[[joint]]")
    tables[2] = f"{tables[2].rstrip()}\n\n[joint.drive]\n{lines()}\n\n"
    file = tmp_path / "robot.toml"
    file.write_text("[[joint]]".join(tables))
    robot = load_robot(file)
    assert robot.joints[1].drive == read(lines())
    undriven = [replace(joint, drive=None) for joint in robot.joints]
    assert tuple(undriven) == load_robot(start).joints
    edit = RobotEdit(file, robot)
    edit.change("joint[2].stiffness", 2e6, "fitted")
    file.write_text(edit.text("Fitted.", file))
    assert f"[joint.drive]\n{lines()}\n" in file.read_text()
    assert load_robot(file).joints[1].drive == robot.joints[1].drive


def test_the_list_of_numbers_has_the_drive_at_the_output_and_its_sources(tmp_path, command):
    sources = '"joint.drive" = "the maker"\n"joint[2].drive.friction.coulomb_Nm" = "measured"\n'
    out = command("robots", written(tmp_path, lines(), after=f"[sources]\n{sources}")).stdout
    said = " ".join(out.split())
    assert "joint[2].drive.gear_ratio = 200: the maker" in said
    assert "joint[2].drive.friction.coulomb_Nm = 90: measured" in said
    assert (
        "joint[2].drive, at the gear's output: rotor 200 kg m2; friction 120 N m at rest, 90 N m and 40"
        " N m s/rad in motion; servo 20 1/s, 3.77e+04 N m s/rad, 1.885e+06 N m/rad; at most 5000 N m"
    ) in said
    assert ".drive" not in command("robots", "icme2008").stdout


def test_the_page_in_an_fmu_tells_of_motors_where_there_are_any(tmp_path):
    robot = load_robot(written(tmp_path, lines()))
    page = index_html(robot, [], "2.0", "1", "")
    assert "<td>joint[2]</td><td>rotor 200 kg m2; friction 120 N m at rest" in page
    plain = tuple(replace(joint, drive=None) for joint in robot.joints)
    assert "motor" not in index_html(replace(robot, joints=plain), [], "2.0", "1", "")


def test_the_drive_of_the_page_has_the_figures_of_the_page(tmp_path):
    """At a constant rate the torque is Coulomb's and viscous friction, however the rotor got there."""
    page = (DOCS / "robot_file.md").read_text()
    part = page[page.index("## Motor, servo and friction") : page.index("## Kinematic error")]
    (text,) = re.findall(r"```toml\n(.*?)```", part, re.DOTALL)
    (tmp_path / "robot.toml").write_text(text)
    robot = load_robot(tmp_path / "robot.toml")
    drive = robot.joints[0].drive
    rows = dict(re.findall(r"^\| [^|]* \| ([^|]*) \| ([^|]*) \|$", part, re.MULTILINE))
    told = [float(value.split()[0]) for value in list(rows.values())[1:]]
    derived = [drive.inertia, drive.rate_gain, drive.integral_gain, drive.friction, drive.stribeck]
    np.testing.assert_allclose(told, derived, rtol=5e-4)
    command = np.array(
        [(0.0, 0.0, 0.1), (2.0, 0.2, 0.1)],
        dtype=[("time", float), ("q_cmd[1]", float), ("qd_cmd[1]", float)],
    )
    result = fmpy.simulate_fmu(
        str(build_fmu(robot, tmp_path / "Robot.fmu")),
        stop_time=2.0,
        step_size=0.01,
        output_interval=0.01,
        start_values={"drive": "servo", "qd_cmd[1]": 0.1},
        input=command,
        output=["motor_angle[1]", "motor_torque[1]"],
    )[-1]
    torque, lag = result["motor_torque[1]"], 1e3 * (0.2 - result["motor_angle[1]"])
    said = re.search(r"delivers (\S+) N m and lags by (\S+) mrad", part)
    np.testing.assert_allclose([torque, lag], [94.0, 0.5], atol=5e-4)
    assert (float(said[1]), float(said[2])) == (94.0, 0.5)


def servo(rest: str) -> str:
    return f"{{ position_gain = 20.0, {rest} }}"


def sentence(keys: str, expected: str, got: str) -> str:
    return f"joint 2: drive: {keys}expected {expected}, got {got}"


POSITIVE, NOT_NEGATIVE = "a number greater than 0", "a number greater than or equal to 0"
ROTOR = " with a rotor of 200 kg m2 at the gear's output"
# Lines of the drive and the whole sentence behind the file's name.
MISTAKES = {
    **{
        f"{key} = {value}": (lines(**{key: value}), sentence(f"{key}: ", POSITIVE, got))
        for key, value, got in (
            ("rotor_inertia_kg_m2", "0.0", "0.0"),
            ("rotor_inertia_kg_m2", "-1e-3", "-0.001"),
            ("gear_ratio", "0", "0"),
            ("gear_ratio", "-200.0", "-200.0"),
            ("max_torque_Nm", "0.0", "0.0"),
        )
    },
    **{
        f"friction {key} = {value}": (
            lines(friction=f"{{ {key} = {value} }}"),
            sentence(f"friction: {key}: ", bound, value),
        )
        for key, value, bound in (
            ("coulomb_Nm", "-1.0", NOT_NEGATIVE),
            ("stiction_Nm", "-1.0", NOT_NEGATIVE),
            ("viscous_Nm_s", "-1.0", NOT_NEGATIVE),
            ("stribeck_rate", "0.0", POSITIVE),
            ("presliding_rad", "0.0", POSITIVE),
        )
    },
    **{
        f"servo {key} = {value}": (
            lines(servo=servo(f"rate_gain = 1e4, {key} = {value}")),
            sentence(f"servo: {key}: ", bound, value),
        )
        for key, value, bound in (
            ("integral_time_s", "0.0", POSITIVE),
            ("integral_gain", "-1.0", NOT_NEGATIVE),
            ("rate_feed_forward", "-0.5", NOT_NEGATIVE),
            ("rate_bandwidth_Hz", "-30.0", POSITIVE),
        )
    },
    "servo without position": (
        lines(servo="{ rate_gain = 1e4 }"),
        "joint 2: drive: servo: key 'position_gain' is missing",
    ),
    "position gain of zero": (
        lines(servo="{ position_gain = 0.0, rate_gain = 1e4 }"),
        sentence("servo: position_gain: ", POSITIVE, "0.0"),
    ),
    "rate gain of zero": (
        lines(servo=servo("rate_gain = 0.0")),
        sentence("servo: rate_gain: ", POSITIVE, "0.0"),
    ),
    "no rotor": (
        lines(rotor_inertia_kg_m2=None),
        "joint 2: drive: key 'rotor_inertia_kg_m2' is missing",
    ),
    "no ratio": (lines(gear_ratio=None), "joint 2: drive: key 'gear_ratio' is missing"),
    "no servo": (lines(servo=None), "joint 2: drive: key 'servo' is missing"),
    "two rate loops": (
        lines(servo=servo("rate_gain = 1e4, rate_bandwidth_Hz = 30.0")),
        sentence("servo: ", "either rate_bandwidth_Hz or rate_gain", "both"),
    ),
    "no rate loop": (
        lines(servo=servo("integral_time_s = 0.02")),
        sentence("servo: ", "rate_bandwidth_Hz or rate_gain", "neither"),
    ),
    "two integrals": (
        lines(servo=servo("rate_gain = 1e4, integral_time_s = 0.02, integral_gain = 0.0")),
        sentence("servo: ", "either integral_time_s or integral_gain", "both"),
    ),
    "coulomb above stiction": (
        lines(friction="{ coulomb_Nm = 90.0, stiction_Nm = 80.0 }"),
        sentence("friction: stiction_Nm: ", "at least coulomb_Nm, 90 N m", "80 N m"),
    ),
    "stiction alone": (
        lines(friction="{ stiction_Nm = 80.0 }"),
        sentence("friction: coulomb_Nm: ", "one beside stiction_Nm = 80.0", "none"),
    ),
    "weaker than its friction": (
        lines(max_torque_Nm="120.0"),
        sentence("max_torque_Nm: ", "more than the friction at rest, 120 N m", "120 N m"),
    ),
    "inertia beyond numbers": (
        lines(rotor_inertia_kg_m2="1e300", gear_ratio="1e5"),
        sentence(
            "rotor_inertia_kg_m2: ", "a finite rotor_inertia_kg_m2 gear_ratio^2 > 0 [kg m^2]", "inf"
        ),
    ),
    "inertia below numbers": (
        lines(gear_ratio="1e-200"),
        sentence(
            "rotor_inertia_kg_m2: ", "a finite rotor_inertia_kg_m2 gear_ratio^2 > 0 [kg m^2]", "0.0"
        ),
    ),
    "bandwidth beyond numbers": (
        lines(servo=servo("rate_bandwidth_Hz = 1e308")),
        sentence("servo: rate_bandwidth_Hz: ", "a finite 2 pi f J > 0 [N m s/rad]", "inf"),
    ),
    "integral beyond numbers": (
        lines(servo=servo("rate_gain = 1e9, integral_time_s = 1e-308")),
        sentence("servo: integral_time_s: ", "a finite Kp / T > 0 [N m/rad]", "inf"),
    ),
    "rate loop of an hour": (
        lines(servo=servo("rate_bandwidth_Hz = 0.001")),
        sentence(
            "servo: rate_bandwidth_Hz: ", "a rate loop of 0.1 to 10000 Hz", f"0.001 Hz{ROTOR}"
        ),
    ),
    "rate gain at the motor": (
        lines(servo=servo("rate_gain = 1e8")),
        sentence("servo: rate_gain: ", "a rate loop of 0.1 to 10000 Hz", f"7.958e+04 Hz{ROTOR}"),
    ),
    "loops that swing up": (
        lines(servo=servo("rate_bandwidth_Hz = 2.0, integral_time_s = 0.02")),
        sentence(
            "servo: ",
            "loops in which the rotor comes to rest",
            "a rate loop of 2 Hz that swings up with its integral and position_gain = 20: more than"
            " 2.274 Hz, or less of these",
        ),
    ),
    "unknown key": (
        lines(inertia="1.0"),
        "joint 2: drive: expected one of rotor_inertia_kg_m2, gear_ratio, friction, servo,"
        " max_torque_Nm, torque_constant_Nm_A, got unknown key 'inertia': did you mean"
        " 'rotor_inertia_kg_m2'?",
    ),
    "unknown key of the friction": (
        lines(friction="{ coulomb = 90.0 }"),
        "joint 2: drive: friction: expected one of coulomb_Nm, stiction_Nm, stribeck_rate,"
        " viscous_Nm_s, presliding_rad, got unknown key 'coulomb': did you mean 'coulomb_Nm'?",
    ),
    "not a number": (
        lines(gear_ratio="nan"),
        sentence("gear_ratio: ", "a finite number", "nan"),
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_what_no_drive_can_be_is_refused_in_one_sentence(tmp_path, mistake):
    drive, said = MISTAKES[mistake]
    file = written(tmp_path, drive)
    for reader in (load_robot, parts_in_words):
        with pytest.raises(RobotFileError) as caught:
            reader(file)
        assert str(caught.value) == f"{file}: {said}"


@pytest.mark.parametrize("drive", [lines(), lines(friction=None)])
def test_a_rigid_joint_has_no_drive(tmp_path, command, drive):
    file = written(tmp_path, drive, joint="")
    said = "joint 2: drive: expected a stiffness beside it, got none: the joint is rigid"
    with pytest.raises(RobotFileError) as caught:
        load_robot(file)
    assert str(caught.value) == f"{file}: {said}"
    done = command("robots", file, exits=2)
    assert said in " ".join(done.stderr.split())
