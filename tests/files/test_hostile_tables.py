"""Gear, drive and balancer of a joint with strange, missing or too many keys: read or refused."""

import dataclasses
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from two_joint_file import two_joints

from coupling.files.robot_file import load_robot, parts_in_words
from coupling.native.robot_text import robot_text
from elastic_robot.description import Joint, Robot
from elastic_robot.errors import RobotFileError

Tree = dict[str, "str | Tree"]
STOP = "{ slip_torque = 1.0, slip_angle = 1e-5 }"
SINE = "{ amplitude = 5e-5, per_turn_of_motor = 2, phase = 0.5 }"
SPRING: Tree = {
    "base_point": "[-0.4, 0.0, 0.0]",
    "link_point": "[0.6, 0.0, 0.3]",
    "pressure_Pa": "1.2e7",
    "length_m": "1.0",
    "gas_volume_m3": "5e-3",
    "area_m2": "2e-3",
    "pulls": "true",
    "exponent": "1.3",
}
SERVO: Tree = {"position_gain": "20.0", "rate_bandwidth_Hz": "30.0", "integral_time_s": "0.02"}
FRICTION: Tree = {"coulomb_Nm": "90.0", "stiction_Nm": "120.0", "stribeck_rate": "0.02"}
FRICTION |= {"viscous_Nm_s": "40.0", "presliding_rad": "3e-5"}
DRIVE: Tree = {"rotor_inertia_kg_m2": "5e-3", "gear_ratio": "200", "max_torque_Nm": "5000.0"}
DRIVE |= {"torque_constant_Nm_A": "1.5", "friction": FRICTION, "servo": SERVO}
SHEET: Tree = {"hysteresis_width_arcmin": "0.4", "lost_motion_arcmin": "0.5"}
GAS: Tree = {"gas_spring": SPRING}
JOINT: Tree = {"stiffness": "1.7e6", "limits": "[-1.5, 1.2]"}
# Joints as they are.
USUAL: tuple[Tree, ...] = (
    {**JOINT, "gear": {"hysteresis": f"[{STOP}, {STOP}]"}, "backlash": "1e-4"},
    {**JOINT, "gear": {**SHEET, "rated_torque_Nm": "3000.0"}},
    {**JOINT, "gear": {"efficiency": "0.8", "kinematic_error": f"[{SINE}]"}, "drive": DRIVE},
    {**JOINT, "drive": DRIVE, "damping": "1e3"},
    {**JOINT, "balancer": GAS},
    {**JOINT, "balancer": {"torque_table": "[[-1.0, 50.0], [0.0, 20.0], [0.5, -30.5]]"}},
    {"gear": {"kinematic_error": "[{ amplitude = 1e-4, per_turn_of_joint = 3.0 }]"}},
)
FURTHER = {"gear.slip_torque", "drive.servo.rate_gain", "drive.servo.integral_gain"}
FURTHER |= {"drive.servo.rate_feed_forward", "gear.rated_torque_Nm"}


def places(tree: Tree, above: str = "") -> dict[str, str | Tree]:
    """All keys, of tables too, with what stands there."""
    found: dict[str, str | Tree] = {}
    for key, value in tree.items():
        found[above + key] = value
        if isinstance(value, dict):
            found |= places(value, f"{above}{key}.")
    return found


def changed(tree: Tree, place: str, value: str | None) -> Tree:
    """The tree with a value in a place; None takes out what is there."""
    key, _, below = place.partition(".")
    if not below:
        return {k: v for k, v in {**tree, key: value}.items() if v is not None}
    table = tree.get(key, {})
    return {**tree, key: changed(table, below, value)} if isinstance(table, dict) else tree


def text_of(tree: Tree) -> str:
    """An inline table."""
    return ", ".join(
        f"{key} = {f'{{ {text_of(value)} }}' if isinstance(value, dict) else value}"
        for key, value in tree.items()
    )


PLACES = sorted(FURTHER.union(*map(places, USUAL)))
numbers = st.one_of(
    st.floats(1e-9, 1e9),
    st.floats(-2.0, 2.0),
    st.sampled_from([0.0, -0.0, -1.0, 5e-324, 1e-300, 1e300, 1.7e308, 1, 10**30]),
).map(repr)
vectors = st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3).map(repr)
anything = st.sampled_from(
    [
        *("nan", "inf", "-inf", "1e400", "true", '"1.0"', "[]", "[[]]", "[{}]", "{}", "1979-05-27"),
        *("1" * 400, "1" * 5000, "[1.0]", "{ x = 1.0 }", "[1.0, {}]", f"[{1000 * '1.0, '}]"),
        *(f"[{count * f'{STOP}, '}]" for count in (1, 7, 5000)),
    ]
)


def hostile(usual: str | Tree) -> st.SearchStrategy[str | None]:
    """Mostly of the kind of what usually stands there; None takes it out."""
    if isinstance(usual, dict):
        return st.none() | anything
    alike = vectors if usual.startswith("[") else numbers
    return st.sampled_from([alike, alike, alike, st.none() | anything]).flatmap(lambda own: own)


@st.composite
def hostile_joints(draw, usual: Tree) -> Tree:
    """A joint with changes of what stands there, and of a key that could."""
    here = places(usual)
    for place in sorted(draw(st.sets(st.sampled_from(sorted(here)), max_size=3))):
        usual = changed(usual, place, draw(hostile(here[place])))
    if draw(st.integers(0, 3)) == 0:
        usual = changed(usual, draw(st.sampled_from(PLACES)), draw(numbers | anything))
    return usual


@pytest.mark.parametrize("usual", USUAL, ids=lambda usual: " ".join(usual))
def test_usual_joints_are_read(usual, tmp_path):
    lines = "\n".join(text_of({key: value}) for key, value in usual.items())
    assert parts_in_words(two_joints(tmp_path, lines, ""))


@pytest.mark.parametrize("usual", USUAL, ids=lambda usual: " ".join(usual))
@settings(max_examples=70)
@given(st.data())
def test_any_joint_is_read_or_refused_in_sentences_that_name_the_file(usual, data):
    """Whatever stands there: one exception, and where there is none a robot that an FMU can have."""
    joint = data.draw(hostile_joints(usual))
    lines = "\n".join(text_of({key: value}) for key, value in joint.items())
    with tempfile.TemporaryDirectory() as folder:
        file = two_joints(Path(folder), lines, "")
        found, refusals = [], []
        for reader in (load_robot, parts_in_words):
            try:
                found.append(reader(file))
            except RobotFileError as error:
                refusals += str(error).splitlines()
    assert [line for line in refusals if not line.startswith(f"{file}: ")] == []
    if refusals:
        return
    robot, words = found
    assert Robot.from_json(robot.to_json()) == robot
    joint = robot.joints[1]
    assert len(joint.hysteresis) <= 6
    for name, part in (
        ("gear", joint.hysteresis or joint.kinematic_error),
        ("drive", joint.drive),
        ("balancer", joint.balancer),
    ):
        assert any(line.startswith(f"joint[2].{name}") for line in words) == bool(part), name
    require_finite(joint, robot)


def require_finite(joint: Joint, robot: Robot) -> None:
    """The parts of a joint have finite numbers, which the native FMU is told as they are."""
    elements = (number for stop in joint.hysteresis for number in dataclasses.astuple(stop))
    assert np.isfinite([*elements, *np.ravel(joint.balancer or ())]).all()
    if joint.drive is None:
        return
    told = next(t for t in robot_text(robot, "{x}").splitlines() if t.startswith("motor "))
    own = dataclasses.replace(joint.drive, torque_limit=joint.drive.torque_limit or 0.0)
    keys = ("inertia", "friction", "slip_angle", "viscous", "stribeck", "stribeck_rate")
    keys += ("position_gain", "rate_gain", "integral_gain", "feed_forward", "torque_limit")
    numbers = [getattr(own, key) for key in (*keys, "load_friction")]
    assert [float(word) for word in told.split()[1:]] == numbers
    assert np.isfinite(numbers).all()
    assert min(own.inertia, own.position_gain, own.rate_gain) > 0.0
