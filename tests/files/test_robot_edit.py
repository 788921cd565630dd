"""A robot file with other numbers: what is changed is read back, and everything else is as it was."""

import copy
import re
import tomllib

import numpy as np
import pytest

from coupling.files.provenance import load_provenance
from coupling.files.robot_file import load_robot, shipped_robots
from coupling.robot.robot_edit import RobotEdit


@pytest.mark.parametrize("name", sorted(shipped_robots()))
def test_what_is_changed_is_read_back_and_all_comments_stay(name, tmp_path):
    """Every joint's and tilt's stiffness, beside a URDF by the joint's place in the file."""
    start, target = shipped_robots()[name], tmp_path / "new.toml"
    robot, rng = load_robot(start), np.random.default_rng(1)
    edit, expected = RobotEdit(start, robot), {}
    for number, joint in enumerate(robot.joints, start=1):
        names = [f"joint[{number}]"] if joint.stiffness else []
        names += [f"joint[{number}].tilt[{k}]" for k, _ in enumerate(joint.tilt, start=1)]
        for own in names:
            expected[own] = float(rng.uniform(1e5, 1e7))
            edit.change(f"{own}.stiffness", expected[own], "drawn")
            edit.remark(f"{own}.stiffness", f"mark of\n {own}")
    target.write_text(edit.text("Other springs.", target))
    found = load_robot(target)
    for number, joint in enumerate(found.joints, start=1):
        if joint.stiffness:
            assert joint.stiffness == expected[f"joint[{number}]"]
        for k, tilt in enumerate(joint.tilt, start=1):
            assert tilt.stiffness == expected[f"joint[{number}].tilt[{k}]"]
    lines = target.read_text().splitlines()
    assert lines[0] == "# Other springs."
    for own, value in expected.items():
        (line,) = [line for line in lines if line.endswith(f"# mark of {own}")]
        assert re.search(rf"stiffness *= {value}", line)
    assert [
        c for c in map(_own_comment, start.read_text().splitlines()) if c and c not in lines
    ] == []
    # The range of a stiffness that was typical of a class goes with it.
    assert not any(
        joint.get("stiffness_range") for joint in tomllib.loads("\n".join(lines))["joint"]
    )
    before, after = (_without_springs(file) for file in (start, target))
    assert before == after


def _own_comment(line: str) -> str:
    """Return a line that is a comment and nothing else, outside of what is made anew: a tilt's array."""
    return line if line.startswith("#") else ""


def _without_springs(file) -> dict:
    """Return a robot file but for springs and their ranges, sources and the place of its URDF."""
    content = copy.deepcopy(tomllib.loads(file.read_text()))
    content.pop("sources", None)
    content.get("urdf", {}).pop("file", None)
    for joint in content["joint"]:
        joint.pop("stiffness", None)
        joint.pop("stiffness_range", None)
        for tilt in joint.get("tilt", []):
            tilt.pop("stiffness")
    return content


def test_the_sources_of_a_file_are_kept_beside_new_ones(tmp_path):
    start = shipped_robots()["icme2008"]
    robot = load_robot(start)
    edit = RobotEdit(start, robot)
    edit.change("joint[2].tilt[1].stiffness", 3e6, "a hammer test")
    edit.add_tilt(
        4, {"axis": [1.0, 0.0, 0.0], "stiffness": 1e6, "damping": 10.0}, {"axis": "tested"}
    )
    text = edit.text("More.", tmp_path / "new.toml")
    sources = tomllib.loads(start.read_text()).get("sources", {})
    count = len(robot.joints[3].tilt) + 1
    assert tomllib.loads(text)["sources"] == sources | {
        "joint[2].tilt[1].stiffness": "a hammer test",
        f"joint[4].tilt[{count}].axis": "tested",
    }


FIRST = "{ slip_torque = 30.0, slip_angle = 2e-5 }"
SECOND = "{ slip_torque = 10.0, slip_angle = 1e-4 }"
MOTOR = "rotor_inertia_kg_m2 = 1e-3, gear_ratio = 100.0"
FRICTION = "{ coulomb_Nm = 10.0, stiction_Nm = 15.0 }"
SERVO = "{ position_gain = 20.0, rate_gain = 2e3 }"
FORMS = {
    "inline": f"gear = {{ hysteresis = [{FIRST}, {SECOND}] }}\n"
    f"drive = {{ {MOTOR}, friction = {FRICTION}, servo = {SERVO} }}\n",
    "dotted": f"gear.hysteresis = [\n    {FIRST},\n    {SECOND},\n]\ndrive.rotor_inertia_kg_m2 = 1e-3\n"
    f"drive.gear_ratio = 100.0\ndrive.friction = {FRICTION}\ndrive.servo = {SERVO}\n",
    "tables": """[[joint.gear.hysteresis]]
slip_torque = 30.0
slip_angle = 2e-5
[[joint.gear.hysteresis]]
slip_torque = 10.0
slip_angle = 1e-4
[joint.drive]
rotor_inertia_kg_m2 = 1e-3
gear_ratio = 100.0
[joint.drive.friction]
coulomb_Nm = 10.0
stiction_Nm = 15.0
[joint.drive.servo]
position_gain = 20.0
rate_gain = 2e3
""",
}


@pytest.mark.parametrize("form", [*FORMS, "sheet"])
def test_hysteresis_and_friction_are_changed_with_all_their_parts(tmp_path, form):
    """In whatever form a file has them; a data sheet's numbers make room for its elements."""
    text = FORMS.get(form, FORMS["inline"])
    if form == "sheet":
        own = "gear = { hysteresis_width_arcmin = 1.0, rated_torque_Nm = 1e4 }"
        text = own + text[text.index("\n") :]
    start, target = tmp_path / "robot.toml", tmp_path / "new.toml"
    start.write_text(
        'name = "arm"\n[tcp]\nposition = [1.0, 0.0, 0.0]\n[[joint]]\norigin = [0.0, 0.0, 0.0]\n'
        "axis = [0.0, 1.0, 0.0]\nmass = 10.0\ncom = [0.5, 0.0, 0.0]\ninertia = [0.1, 1.0, 1.0]\n"
        f"stiffness = 1e6\n{text}"
    )
    robot = load_robot(start)
    (before,) = robot.joints
    edit = RobotEdit(start, robot)
    edit.change("joint[1].hysteresis", 60.0, "measured")
    edit.change("joint[1].friction", 30.0, "warm")
    edit.remark("joint[1].hysteresis", "to 1 %")
    edit.remark("joint[1].friction", "to 2 %")
    target.write_text(edit.text("Slips otherwise.", target))
    (after,) = load_robot(target).joints
    whole = sum(stop.slip_torque for stop in before.hysteresis)
    for old, new in zip(before.hysteresis, after.hysteresis, strict=True):
        assert new.slip_torque == pytest.approx(60.0 / whole * old.slip_torque, rel=1e-12)
        assert new.slip_angle == old.slip_angle
    assert (after.drive.friction, before.drive.friction) == (30.0, 15.0)
    assert after.drive.stribeck == pytest.approx(before.drive.stribeck, rel=1e-12)
    found = tomllib.loads(target.read_text())["sources"]
    assert found["joint[1].gear.hysteresis"] == "measured"
    assert found["joint[1].drive.friction"] == "warm"
    assert {"to 1 %", "to 2 %"} <= set(re.findall(r"to \d %", target.read_text()))


@pytest.mark.parametrize("name", sorted(shipped_robots()))
def test_an_interval_takes_the_place_of_the_range_of_a_class(name, tmp_path):
    """The file states it of the changed gears, with its source, and of no tilt; it is read back."""
    start, target = shipped_robots()[name], tmp_path / "new.toml"
    robot = load_robot(start)
    edit, expected = RobotEdit(start, robot), dict(load_provenance(start, robot).stiffness_ranges)
    for number, joint in enumerate(robot.joints, start=1):
        if not joint.stiffness:
            continue
        low, high = 0.9 * joint.stiffness, 1.2 * joint.stiffness
        edit.change(f"joint[{number}].stiffness", joint.stiffness, "identified", (low, high))
        expected[number] = (low, high)
        for k, tilt in enumerate(joint.tilt, start=1):
            edit.change(f"joint[{number}].tilt[{k}].stiffness", tilt.stiffness, "so", (1.0, 2e9))
    target.write_text(edit.text("Measured.", target))
    assert dict(load_provenance(target, load_robot(target)).stiffness_ranges) == expected
    content = tomllib.loads(target.read_text())
    assert not any("range" in key for table in content["joint"] for key in str(table.get("tilt")))
    sources = [text for place, text in content["sources"].items() if "stiffness_range" in place]
    assert sources.count("95 % interval, identified") == len(expected)
