"""[joint.drive]: what no drive can be is refused, any other file is read."""

import tempfile
import tomllib
from pathlib import Path

import numpy as np
import pytest
from drive_file import ELASTIC, lines, written
from hypothesis import given, settings
from hypothesis import strategies as st

from coupling.files.robot_file import load_robot, parts_in_words
from coupling.native.robot_text import robot_text
from elastic_robot.description import Robot
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


hostile = st.one_of(
    st.floats(1e-9, 1e9).map(repr),
    st.sampled_from([0.0, -0.0, -1.0, 5e-324, 1e-300, 1e300, 1.7e308, 1, 10**30]).map(repr),
    st.sampled_from(["nan", "inf", "1e400", "true", '"1.0"', "[]", "[{}]", "{}", "1979-05-27"]),
    st.sampled_from(["1" * 400, "1" * 5000, "[1.0]", "{ x = 1.0 }"]),
)
KEYS = {
    "": [
        "rotor_inertia_kg_m2",
        "gear_ratio",
        "max_torque_Nm",
        "torque_constant_Nm_A",
        "friction",
        "servo",
    ],
    "friction": ["coulomb_Nm", "stiction_Nm", "stribeck_rate", "viscous_Nm_s", "presliding_rad"],
    "servo": ["position_gain", "rate_bandwidth_Hz", "integral_time_s", "rate_feed_forward"],
}
KEYS["servo"] += ["rate_gain", "integral_gain"]


@st.composite
def files(draw) -> tuple[str, str]:
    """A usual drive of a usual joint, in which some keys are strange, missing or too many."""
    tree = tomllib.loads(lines())
    flat = {"": {}, **{table: dict(tree[table]) for table in ("friction", "servo")}}
    flat[""] = {k: v for k, v in tree.items() if k not in flat}
    written_as = {t: {k: repr(v) for k, v in keys.items()} for t, keys in flat.items()}
    places = [(table, key) for table, keys in KEYS.items() for key in keys]
    whole = {}
    for table, key in sorted(draw(st.sets(st.sampled_from(places), max_size=3))):
        value = draw(st.none() | hostile)
        if key in ("friction", "servo"):
            whole[key] = value
        elif value is None:
            written_as[table].pop(key, None)
        else:
            written_as[table][key] = value
    top = dict(written_as[""])
    for table in ("friction", "servo"):
        inline = ", ".join(f"{k} = {v}" for k, v in written_as[table].items())
        top[table] = whole.get(table, f"{{ {inline} }}")
    stiffness = draw(st.sampled_from([ELASTIC, ELASTIC, "", "stiffness = -1.0"]))
    return stiffness, "\n".join(f"{k} = {v}" for k, v in top.items() if v is not None)


@settings(max_examples=200)
@given(files())
def test_any_file_is_read_or_refused_in_sentences_that_name_it(own):
    """Whatever stands there: one exception, and where there is none, a drive that the FMU can have."""
    joint, drive = own
    with tempfile.TemporaryDirectory() as folder:
        file = written(Path(folder), drive, joint)
        robot, refusals = None, ""
        try:
            robot = load_robot(file)
        except RobotFileError as error:
            refusals = str(error)
        assert [line for line in refusals.splitlines() if not line.startswith(f"{file}: ")] == []
        if robot is None:
            return
        assert any(line.startswith("joint[2].drive") for line in parts_in_words(file))
    assert Robot.from_json(robot.to_json()) == robot
    found = robot.joints[1].drive
    assert found is not None
    numbers = [value for value in vars(found).values() if value is not None]
    assert np.all(np.isfinite(numbers))
    assert min(found.inertia, found.position_gain, found.rate_gain) > 0.0
    motor = next(
        line for line in robot_text(robot, "{x}").splitlines() if line.startswith("motor ")
    )
    assert [float(word) for word in motor.split()[1:]] == [
        *(found.inertia, found.friction, found.slip_angle, found.viscous, found.stribeck),
        *(found.stribeck_rate, found.position_gain, found.rate_gain, found.integral_gain),
        *(found.feed_forward, found.torque_limit or 0.0, found.load_friction),
    ]
