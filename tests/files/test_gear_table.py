"""[joint.gear]: what no gear can be is refused, any other file is read."""

import tempfile
from pathlib import Path

import pytest
from gear_file import RATED, SHEET, K, sheet, written
from hypothesis import given, settings
from hypothesis import strategies as st

from coupling.files.robot_file import load_robot, parts_in_words
from elastic_robot.description import Robot
from elastic_robot.errors import RobotFileError

# Keys of the joint and of its gear, and the whole sentence behind the file's name.
MISTAKES = {
    "negative slip torque": (
        f"stiffness = {K}",
        "hysteresis = [{slip_torque = 1.0, slip_angle = 1.0}, {slip_torque = -4.0, slip_angle = 1e-5}]",
        "joint 2: gear: hysteresis 2: slip_torque: expected a finite number > 0 [N m], got -4.0",
    ),
    "slip angle of zero": (
        f"stiffness = {K}",
        "hysteresis = [{slip_torque = 4.0, slip_angle = 0.0}]",
        "joint 2: gear: hysteresis 1: slip_angle: expected a finite number > 0 [rad], got 0.0",
    ),
    "no slip angle": (
        f"stiffness = {K}",
        "hysteresis = [{slip_torque = 4.0}]",
        "joint 2: gear: hysteresis 1: key 'slip_angle' is missing",
    ),
    "seven elements": (
        f"stiffness = {K}",
        f"hysteresis = [{', '.join(7 * ['{slip_torque = 1.0, slip_angle = 1e-5}'])}]",
        "joint 2: gear: hysteresis: expected at most 6 items, got 7",
    ),
    "both forms": (
        f"stiffness = {K}",
        SHEET + "hysteresis = []",
        "joint 2: gear: expected either the elements of hysteresis or the numbers of a data sheet, got"
        " hysteresis and hysteresis_width_arcmin",
    ),
    "negative width": (
        f"stiffness = {K}",
        sheet(-1.0, RATED),
        "joint 2: gear: hysteresis_width_arcmin: expected a number greater than 0, got -1.0",
    ),
    "infinite width": (
        f"stiffness = {K}",
        "hysteresis_width_arcmin = 1e400\nrated_torque_Nm = 1.0",
        "joint 2: gear: hysteresis_width_arcmin: expected a finite number, got inf",
    ),
    "no rated torque": (
        f"stiffness = {K}",
        "hysteresis_width_arcmin = 1.0",
        "joint 2: gear: rated_torque_Nm: expected a number > 0 beside hysteresis_width_arcmin, got none",
    ),
    "no width": (
        f"stiffness = {K}",
        "lost_motion_arcmin = 1.0\nrated_torque_Nm = 3e3",
        "joint 2: gear: hysteresis_width_arcmin: expected a number > 0 beside lost_motion_arcmin, got"
        " none",
    ),
    "unknown key": (
        f"stiffness = {K}",
        "hysteresis_width = 1.0",
        "joint 2: gear: expected one of hysteresis, hysteresis_width_arcmin, lost_motion_arcmin,"
        " rated_torque_Nm, kinematic_error, efficiency, got unknown key 'hysteresis_width': did you mean"
        " 'hysteresis_width_arcmin'?",
    ),
    "rigid joint": (
        "",
        "hysteresis = [{slip_torque = 4.0, slip_angle = 1e-5}]",
        "joint 2: gear: expected a stiffness beside it, got none: the joint is rigid",
    ),
    "rigid joint with a data sheet": (
        "",
        SHEET,
        "joint 2: gear: expected a stiffness beside it, got none: the joint is rigid",
    ),
    "negative stiffness": (
        "stiffness = -1.0",
        SHEET,
        "joint 2: stiffness: expected a finite number > 0 [N m/rad], got -1.0",
    ),
    "no stiffness but zero": (
        "stiffness = 0.0",
        SHEET,
        "joint 2: stiffness: expected a finite number > 0 [N m/rad], got 0.0",
    ),
    "torque table": (
        f"stiffness = {K}\n"
        "torque_table = [[-2.0, -2.0], [-1.0, -1.0], [0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]",
        SHEET,
        "joint 2: gear: hysteresis_width_arcmin: expected no torque_table beside it, as the width is"
        " that of a gear with one stiffness, got one: give the elements of hysteresis",
    ),
    "backlash beside lost motion": (
        f"stiffness = {K}\nbacklash = 1e-4",
        SHEET,
        "joint 2: gear: lost_motion_arcmin: expected no backlash beside it, as it determines the"
        " backlash, got backlash = 0.0001",
    ),
    "lost motion of less than the stiffness gives": (
        f"stiffness = {K}",
        sheet(0.2, RATED, 0.3),
        "joint 2: gear: lost_motion_arcmin: expected at least 0.363997, by which the gear winds up"
        " between +-3 % of 3000 N m with stiffness = 1.7e+06 N m/rad, got 0.3",
    ),
    "lost motion of less than the width": (
        f"stiffness = {K}",
        sheet(0.6, RATED, 0.5),
        "joint 2: gear: lost_motion_arcmin: expected at least hysteresis_width_arcmin, 0.6, got 0.5:"
        " elements that slip at more than 3 % of the rated torque hide the backlash from the lost"
        " motion: leave it out and give backlash",
    ),
    "width of less than the backlash": (
        f"stiffness = {K}\nbacklash = 1e-3",
        sheet(1.0, RATED),
        "joint 2: gear: hysteresis_width_arcmin: expected more than 6.87549, the whole backlash by"
        " backlash, got 1",
    ),
    "width of less than the lost motion's backlash": (
        f"stiffness = {K}",
        sheet(0.2, RATED, 0.6),
        "joint 2: gear: hysteresis_width_arcmin: expected more than 0.236003, the whole backlash by"
        " lost_motion_arcmin, got 0.2",
    ),
    "slip torque near the rated torque": (
        f"stiffness = {K}",
        sheet(4.0, RATED),
        "joint 2: gear: rated_torque_Nm: expected at least 4450.59, from which to zero all elements"
        " slip, 989.02 N m together by hysteresis_width_arcmin = 4 and stiffness = 1.7e+06 N m/rad,"
        " got 3000",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_what_no_gear_can_be_is_refused_in_one_sentence(tmp_path, command, mistake):
    joint, gear, sentence = MISTAKES[mistake]
    file = written(tmp_path, joint, gear)
    with pytest.raises(RobotFileError) as caught:
        load_robot(file)
    assert str(caught.value) == f"{file}: {sentence}"
    if "stiffness: " in sentence:  # of the joint, which a list of numbers does not make
        sentence = "joint 2: gear: expected a stiffness > 0 [N m/rad] beside it, got "
    done = command("robots", file)
    assert done.returncode == 2
    assert sentence in " ".join(done.stderr.split())


numbers = st.one_of(
    st.floats(1e-9, 1e9),
    st.sampled_from([0.0, -0.0, -1.0, 5e-324, 1e-300, 1e300, 1.7e308, 1, 10**30]),
)
STOP = "{slip_torque = 1.0, slip_angle = 1e-5}"
hostile = st.one_of(
    numbers.map(repr),
    st.sampled_from(
        ["nan", "inf", "-inf", "1e400", "true", '"1.0"', "[]", "[[]]", "{}", "1979-05-27"]
    ),
    st.sampled_from(["1" * 400, "1" * 5000, f"[{1000 * '1.0, '}]", "[{}]", "[1.0, {}]"]),
    st.sampled_from([f"[{STOP}]", f"[{STOP.replace('1.0', 'nan')}]", f"[{5000 * f'{STOP}, '}]"]),
)
KEYS = ("hysteresis", "hysteresis_width_arcmin", "lost_motion_arcmin", "rated_torque_Nm")
# What a gear has.
USUAL = {
    "stiffness": st.floats(1e5, 1e7).map(repr),
    "backlash": st.floats(0.0, 1e-4).map(repr),
    "damping": st.floats(0.0, 1e4).map(repr),
    "hysteresis": st.integers(1, 7).map(lambda n: f"[{n * f'{STOP}, '}]"),
    "hysteresis_width_arcmin": st.floats(0.01, 1.0).map(repr),
    "lost_motion_arcmin": st.floats(0.01, 1.0).map(repr),
    "rated_torque_Nm": st.floats(1e3, 1e4).map(repr),
}


@st.composite
def files(draw) -> dict[str, str]:
    """Keys and what stands there, of a gear in one form or both, or of none."""
    form = draw(st.sampled_from([KEYS[:1], KEYS[1:], KEYS[1::2], KEYS]))
    keys = ["stiffness", *form, *sorted(draw(st.sets(st.sampled_from(["backlash", "damping"]))))]
    own = {key: draw(USUAL[key]) for key in keys}
    strange = draw(st.sets(st.sampled_from([*USUAL, "slip_torque"]), max_size=2))
    own |= {key: draw(hostile) for key in sorted(strange)}
    missing = draw(st.none() | st.sampled_from(sorted(own)))
    return {key: value for key, value in own.items() if key != missing}


@settings(max_examples=200)
@given(files())
def test_any_file_is_read_or_refused_in_sentences_that_name_it(own):
    """Whatever stands there: one exception, and where there is none, elements that slip."""
    lines = {key: f"{key} = {value}" for key, value in own.items()}
    of_gear = [lines.pop(key) for key in ("slip_torque", *KEYS) if key in own]
    with tempfile.TemporaryDirectory() as folder:
        file = written(Path(folder), "\n".join(lines.values()), "\n".join(of_gear))
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
    elements = robot.joints[1].hysteresis
    assert len(elements) <= 6
    assert bool(elements) == any(own.get(key, "[]") != "[]" for key in KEYS) == bool(words)
