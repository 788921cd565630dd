"""A robot's parameters by name: what is written is read again, and nothing else changes."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_robots import driven, make_robot

from coupling.files.robot_file import load_robot
from coupling.robot.parameter_table import PARAMETER_KINDS
from coupling.robot.parameters import apply_values, value_of
from coupling.robot.robot_edit import RobotEdit
from elastic_robot.description import Robot
from elastic_robot.gear_parts import KinematicError

# Some numbers, as a balancer's, are factors of what there is.
_OF_PAYLOAD = tuple(kind for kind in PARAMETER_KINDS if kind.startswith(("mass", "com.")))
_OF_JOINT = [
    key
    for key, kind in PARAMETER_KINDS.items()
    if "the start's" not in kind.unit and key not in _OF_PAYLOAD
]
# The sum of what there is in motion and what there is more of it at rest.
_AT_REST, _IN_DRIVE = "].friction", (".coulomb_Nm", ".more_at_rest")


def _robot(seed: int, joints: int) -> Robot:
    """Return a robot with motors that lose of what they carry, hysteresis, sines and a payload."""
    rng = np.random.default_rng(seed)
    robot = driven(make_robot(seed, joints), rng)
    lossy = [
        own if own.drive is None else replace(own, drive=replace(own.drive, load_friction=0.2))
        for own in robot.joints
    ]
    sines = KinematicError(1e-5, 3.0), KinematicError(2e-5, 7.0, 0.1)
    lossy = [replace(joint, kinematic_error=sines) for joint in lossy]
    return replace(robot, joints=tuple(lossy), payload=robot.joints[0].body)


def _names(robot: Robot) -> list[str]:
    """Return the names of all parameters that the robot has."""
    places = []
    for i, joint in enumerate(robot.joints, start=1):
        places += [f"joint[{i}]", *(f"joint[{i}].tilt[{k + 1}]" for k in range(len(joint.tilt)))]
    names = [f"{place}.{kind}" for place in places for kind in _OF_JOINT]
    names += [f"payload.{kind}" for kind in _OF_PAYLOAD]
    return [name for name in names if value_of(robot, name) != 0.0]


def _is_sum(name: str, other: str) -> bool:
    return name.endswith(_AT_REST) and other.endswith(_IN_DRIVE)


@given(st.integers(0, 10**6), st.integers(1, 7), st.floats(0.5, 2.0))
def test_what_is_written_is_read_again_and_nothing_else_changes(seed, joints, factor):
    robot = _robot(seed, joints)
    before = {name: value_of(robot, name) for name in _names(robot)}
    for name, value in before.items():
        changed = apply_values(robot, {name: factor * value})
        assert value_of(changed, name) == pytest.approx(factor * value, rel=1e-12)
        for other, known in before.items():
            if other != name and not (_is_sum(name, other) or _is_sum(other, name)):
                assert value_of(changed, other) == pytest.approx(known, rel=1e-12)


def test_a_robot_has_a_number_of_every_kind():
    kinds = {name.split("]", 1)[-1].split(".", 1)[1] for name in _names(_robot(1, 7))}
    assert kinds >= {*_OF_JOINT, *_OF_PAYLOAD}


@pytest.mark.parametrize(
    ("kind", "value"),
    [("hysteresis", -1.0), ("drive.inertia", 0.0), ("drive.load_friction", 2.0)],
)
def test_a_value_that_no_model_can_have_becomes_the_nearest_one_that_it_can(kind, value):
    robot = _robot(2, 4)
    name = next(name for name in _names(robot) if name.endswith(f"].{kind}"))
    bounds = PARAMETER_KINDS[kind].least, PARAMETER_KINDS[kind].most
    found = value_of(apply_values(robot, {name: value}), name)
    assert found == pytest.approx(np.clip(value, *bounds), rel=1e-12)


FILE = """
name = "arm"
[tcp]
position = [1.0, 0.0, 0.0]
[payload]
mass = 5.0
com = [0.2, 0.1, -0.1]
inertia = [0.1, 0.1, 0.1]
[[joint]]
origin = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
mass = 10.0
com = [0.5, 0.0, 0.0]
inertia = [0.1, 1.0, 1.0]
stiffness = 1e6
stiffness_range = [5e5, 2e6]
damping = 1e3
backlash = 1e-4
balancer = { torque_table = [[-1.0, -200.0], [0.0, 0.0], [1.0, 300.0]] }
[joint.gear]
efficiency = 0.8
hysteresis = [{ slip_torque = 40.0, slip_angle = 2e-5 }, { slip_torque = 9.0, slip_angle = 1e-4 }]
kinematic_error = [{ amplitude = 2e-5, per_turn_of_joint = 3.0 }]
[joint.drive]
rotor_inertia_kg_m2 = 1e-3
gear_ratio = 100.0
friction = { coulomb_Nm = 10.0, stiction_Nm = 15.0, viscous_Nm_s = 20.0 }
servo = { position_gain = 20.0, rate_gain = 2e3 }
"""


@pytest.mark.parametrize("key", PARAMETER_KINDS)
def test_a_file_that_is_changed_has_the_robot_with_the_value(key, tmp_path):
    """Of every kind that robot files have, and nothing else is changed."""
    kind, file = PARAMETER_KINDS[key], tmp_path / "robot.toml"
    file.write_text(FILE)
    robot = load_robot(file)
    name = f"{'payload' if key in _OF_PAYLOAD else 'joint[1]'}.{key}"
    value = 0.9 * value_of(robot, name)
    edit = RobotEdit(file, robot)
    edit.change(name, value, "fitted")
    edit.remark(name, "to 5 %")
    file.write_text(edit.text("Fitted.", file))
    has_place = kind.in_file is not None or kind.scaled_in_file
    expected = apply_values(robot, {name: value}) if has_place else robot
    np.testing.assert_allclose(_numbers(load_robot(file)), _numbers(expected), rtol=1e-12)
    assert ('= "fitted"' in file.read_text()) == bool(has_place)


def _numbers(robot: Robot) -> list[float]:
    """Return all numbers of a robot, in their order."""
    return [
        float(text) for text in re.findall(r"-?\d+\.\d+(?:e-?\d+)?|-?\d+e-?\d+", robot.to_json())
    ]
