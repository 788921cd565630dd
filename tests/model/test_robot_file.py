"""robot.toml: complete validation, messages that say place, value and need; and what is read of it."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_robots import robots
from scipy.spatial.transform import Rotation

from build_fmu import main as build_main
from coupling.files.robot_file import find_robot, load_robot, shipped_robots
from elastic_robot.body import Body
from elastic_robot.description import Robot
from elastic_robot.errors import RobotFileError
from elastic_robot.parameters import Parameters

TEXT = shipped_robots()["icme2008"].read_text()


def broken(old: str, new: str, count: int = 1) -> str:
    assert old in TEXT
    return TEXT.replace(old, new, count)


def rated_gear(torque: str) -> str:
    origin = "origin    = [0.0, 0.0, 0.0]"
    return broken(origin, f"{origin}\ngear_torque_Nm = {torque}")


# What is changed in the example robot, and what the message must contain.
MISTAKES = {
    "negative mass": (
        broken("mass      = 700.0", "mass = -1.0"),
        ["joint 1", "mass", "-1.0", ">= 0"],
    ),
    "negative stiffness": (
        broken("stiffness = 1718873.3853924698", "stiffness = -5.0"),
        ["joint 4", "stiffness", "-5.0", "> 0", "N m/rad"],
    ),
    "negative tilt stiffness": (
        broken("stiffness = 3.0e7", "stiffness = -3.0e7"),
        ["joint 1", "tilt 1", "stiffness", "> 0"],
    ),
    "zero stiffness": (
        broken("stiffness = 17188733.853924697 ", "stiffness = 0.0 "),
        ["joint 1", "stiffness", "> 0"],
    ),
    "negative damping": (broken("damping   = 1.0e4", "damping = -1.0"), ["joint 1", "damping"]),
    "negative backlash": (
        broken("backlash  = 1.0e-4", "backlash = -2e-3"),
        ["joint 1", "backlash", "-0.002", ">= 0"],
    ),
    "negative inertia": (
        broken("[100.0, 100.0, 100.0]", "[100.0, 100.0, -1.0]"),
        ["joint 1", "inertia", "-1"],
    ),
    "inertia of no body": (
        broken("[130.0, 130.0, 20.0]", "[130.0, 20.0, 20.0]"),
        ["joint 2", "inertia", "none exceeds the sum"],
    ),
    "inertia with two entries": (broken("[1.0, 5.0, 5.0]", "[1.0, 5.0]"), ["joint 5", "inertia"]),
    "inertia with four entries": (
        broken("[1.0, 5.0, 5.0]", "[1.0, 5.0, 5.0, 0.0]"),
        ["joint 5", "inertia", "xy"],
    ),
    "NaN": (
        broken("com       = [0.10, 0.0, 0.45]", "com = [nan, 0.0, 0.45]"),
        ["joint 1", "com", "nan"],
    ),
    "infinite": (broken("mass      = 700.0", "mass = inf"), ["joint 1", "mass", "inf"]),
    "zero axis": (broken("axis      = [0, 0, 1]", "axis = [0, 0, 0]"), ["joint 1", "axis", "unit"]),
    "long axis": (
        broken("axis      = [0, 0, 1]", "axis = [0, 1, 1]"),
        ["joint 1", "axis", "1.414"],
    ),
    "long tilt axis": (
        broken("axis = [1, 0, 0], stiffness = 3.0e7", "axis = [2, 0, 0], stiffness = 3.0e7"),
        ["joint 1", "tilt 1", "axis", "length 2"],
    ),
    "unknown key": (
        broken("damping   = 1.0e4", "dampning = 1.0e4"),
        ["joint 1", "dampning", "'damping'"],
    ),
    "unknown tilt key": (
        broken("stiffness = 3.0e7, damping", "stifness = 3.0e7, damping"),
        ["joint 1", "tilt 1", "stifness", "'stiffness'"],
    ),
    "unknown table": (TEXT + "\n[tool]\nmass = 1.0\n", ["unknown key 'tool'", "tcp"]),
    "wrong type": (
        broken("mass      = 700.0", 'mass = "heavy"'),
        ["joint 1", "mass", "heavy", "number"],
    ),
    "missing key": (broken("mass      = 700.0", ""), ["joint 1", "mass", "missing"]),
    "short vector": (broken("[0.10, 0.0, 0.45]", "[0.10, 0.0]"), ["joint 1", "com"]),
    "backlash on a rigid joint": (
        broken("inertia   = [0.1, 1.0, 1.0]", "inertia = [0.1, 1.0, 1.0]\nbacklash = 1e-4"),
        ["joint 6", "beside backlash = 0.0001, got none"],
    ),
    "three tilts": (
        broken("tilt      = []", "tilt = [" + 3 * "{axis=[0,0,1],stiffness=1e7}," + "]"),
        ["joint 4", "tilt", "at most 2"],
    ),
    "tilt along the joint's axis": (
        broken("tilt      = []", "tilt = [{axis=[1,0,0],stiffness=1e7}]"),
        ["joint 4", "expected an inertia of its own to move"],
    ),
    "limits the wrong way": (
        broken("origin    = [0.0, 0.0, 0.0]", "origin = [0.0, 0.0, 0.0]\nlimits = [1.0, -1.0]"),
        ["joint 1", "limits", "low < high"],
    ),
    "maximum rate zero": (
        broken("origin    = [0.0, 0.0, 0.0]", "origin = [0.0, 0.0, 0.0]\nmax_rate = 0.0"),
        ["joint 1", "max_rate"],
    ),
    "negative acceleration": (
        broken("origin    = [0.0, 0.0, 0.0]", "origin = [0.0, 0.0, 0.0]\nmax_acceleration = -1.0"),
        ["joint 1: max_acceleration: expected a finite number > 0 [rad/s^2], got -1.0"],
    ),
    "negative rated load": (
        broken("payload_N = 2650.0", "payload_N = -2650.0"),
        ["payload_N: expected a number greater than 0, got -2650.0"],
    ),
    "negative gear torque": (
        rated_gear("{ peak = -1.0 }"),
        ["joint 1: gear_torque_Nm: peak: expected a number greater than 0, got -1.0"],
    ),
    "peak gear torque above the one in an emergency": (
        rated_gear("{ peak = 5000.0, emergency = 4000.0 }"),
        ["joint 1: gear_torque_Nm: emergency: expected at least peak, 5000 N m, got 4000 N m"],
    ),
    "gear torque of no kind": (
        rated_gear("{}"),
        ["joint 1: gear_torque_Nm: expected peak, emergency or both [N m], got neither"],
    ),
    "gear torque on a rigid joint": (
        broken(
            "inertia   = [0.1, 1.0, 1.0]",
            "inertia = [0.1, 1.0, 1.0]\ngear_torque_Nm = { peak = 900.0 }",
        ),
        ["joint 6: gear_torque_Nm: expected a stiffness beside it", "got none"],
    ),
    "payload without mass": (
        TEXT + "\n[payload]\nmass=0.0\ncom=[0.0,0.0,0.0]\ninertia=[1.0,1.0,1.0]\n",
        ["payload", "mass"],
    ),
    "no joint": (TEXT[: TEXT.index("[[joint]]")], ["joint", "missing"]),
    "not TOML": ("name = ", ["not valid TOML"]),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_broken_robot_is_refused_with_place_value_and_need(tmp_path, capsys, mistake):
    text, words = MISTAKES[mistake]
    file = tmp_path / "broken.toml"
    file.write_text(text)
    with pytest.raises(RobotFileError) as caught:
        load_robot(file)
    message = str(caught.value)
    assert message.startswith(str(file))
    assert [word for word in words if word not in message] == []
    # The build refuses it with the same words, status 2 and without leaving anything.
    assert build_main(["--robot", str(file), "-o", str(tmp_path / "out" / "R.fmu")]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.rglob("*.fmu"))


def test_a_file_that_cannot_be_read_is_named_and_a_shipped_robot_suggested(tmp_path):
    with pytest.raises(RobotFileError, match=re.escape("did you mean 'icme2008'")):
        find_robot("icme2009")
    with pytest.raises(RobotFileError, match="cannot be read"):
        load_robot(tmp_path / "none.toml")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RobotFileError, match="not valid TOML"):
        load_robot(binary)


def test_the_example_robot_is_read_as_the_paper_gives_it(example: Robot):
    parameters = Parameters.of(example)
    assert [joint.stiffness is None for joint in example.joints] == [False] * 5 + [True]
    assert [len(joint.tilt) for joint in example.joints] == [2, 2, 2, 0, 0, 0]
    assert parameters.stiffness[0] == pytest.approx(3e5 * 180.0 / 3.141592653589793, rel=1e-15)
    assert parameters.backlash.tolist() == [1e-4, 0, 0, 1e-4, 0, 0, 1e-4, 0, 0, 1e-4, 1e-4]


def test_limits_rates_and_payload_are_read(tmp_path):
    text = broken(
        "origin    = [0.0, 0.0, 0.0]",
        "origin = [0.0, 0.0, 0.0]\nname = 'base'\nlimits = [-3.0, 3.0]\n"
        "max_rate = 1.5\nmax_acceleration = 4.0",
    )
    file = tmp_path / "robot.toml"
    file.write_text(text + "\n[payload]\nmass=20.0\ncom=[0.3,0.0,0.0]\ninertia=[0.1,0.2,0.2]\n")
    robot = load_robot(file)
    assert robot.joints[0].limits == (-3.0, 3.0)
    assert robot.joints[0].max_rate == 1.5
    assert robot.joints[0].max_acceleration == 4.0
    assert Robot.from_json(robot.to_json()) == robot
    assert robot.joints[0].name == "base"
    assert robot.payload is not None
    assert robot.payload.mass == 20.0


def test_the_shipped_file_says_which_numbers_are_the_papers():
    assert "From the paper" in TEXT


@given(robots())
def test_json_round_trip_is_exact(robot: Robot):
    assert Robot.from_json(robot.to_json()) == robot


@given(st.integers(0, 10**6))
def test_a_body_placed_in_another_frame_has_the_energy_it_had(seed):
    """Kinetic energy of a rotation about the frame's origin, written in either frame."""
    rng = np.random.default_rng(seed)
    turn, shift = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    square = rng.normal(size=(3, 3))
    second_moments = square @ square.T
    inertia = np.trace(second_moments) * np.eye(3) - second_moments
    body = Body.from_matrix(3.0, rng.normal(size=3), inertia)
    placed, spin = body.placed(turn, shift), rng.normal(size=3)

    def energy(of: Body, spin: np.ndarray, origin: np.ndarray) -> float:
        velocity = np.cross(spin, np.array(of.com) - origin)
        return 0.5 * of.mass * velocity @ velocity + 0.5 * spin @ of.inertia_matrix @ spin

    found, expected = energy(placed, turn @ spin, shift), energy(body, spin, np.zeros(3))
    assert found == pytest.approx(expected, rel=1e-12)
    assert energy(body.scaled(2.0), spin, np.zeros(3)) == pytest.approx(2.0 * expected, rel=1e-12)
