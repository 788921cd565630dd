"""[joint.drive]: what no drive can be is refused."""

import pytest
from drive_file import lines, written

from coupling.files.robot_file import load_robot, parts_in_words
from elastic_robot.errors import RobotFileError


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
        " max_torque_Nm, torque_constant_Nm_A, got unknown key 'inertia'",
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
    done = command("robots", file)
    assert done.returncode == 2
    assert said in " ".join(done.stderr.split())
