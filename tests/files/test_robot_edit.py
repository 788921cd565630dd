"""A robot file with other numbers: what is changed is read back, and everything else is as it was."""

import copy
import re
import tomllib

import numpy as np
import pytest

from coupling.files.robot_edit import RobotEdit
from coupling.files.robot_file import load_robot, shipped_robots


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
    before, after = (_without_springs(file) for file in (start, target))
    assert before == after


def _own_comment(line: str) -> str:
    """Return a line that is a comment and nothing else, outside of what is made anew: a tilt's array."""
    return line if line.startswith("#") else ""


def _without_springs(file) -> dict:
    """Return the content of a robot file but for its springs, its sources and where its URDF is."""
    content = copy.deepcopy(tomllib.loads(file.read_text()))
    content.pop("sources", None)
    content.get("urdf", {}).pop("file", None)
    for joint in content["joint"]:
        joint.pop("stiffness", None)
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
