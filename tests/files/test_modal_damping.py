"""Damping by a ratio of all modes: a closed form, the workspace of robots, and the file."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_robots import make_robot
from two_joint_file import two_joints

from coupling.files.modal_damping import with_damping_ratio
from coupling.files.robot_file import load_robot, shipped_robots
from coupling.modes.locked_robot import LockedRobot
from coupling.robot.robot_edit import RobotEdit
from elastic_robot.body import Body
from elastic_robot.chain import build_chain
from elastic_robot.description import Joint, Robot
from elastic_robot.errors import RobotFileError


@given(st.floats(1.0, 500.0), st.floats(1e3, 1e8), st.floats(0.005, 0.3))
@settings(max_examples=20)
def test_a_single_gear_has_the_damping_of_its_closed_form(mass, stiffness, ratio):
    """d = 2 zeta sqrt(k I) with I about the axis."""
    body = Body(mass=mass, com=(0.4, 0.0, 0.0), inertia=(0.1 * mass, 0.2 * mass, 0.2 * mass))
    joint = Joint((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), body, stiffness=stiffness)
    robot = Robot("one", (joint,), (0.0, 0.0, -9.81), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    damped = with_damping_ratio(robot, ratio).joints[0].damping
    inertia = mass * (0.16 + 0.2)
    assert damped == pytest.approx(2.0 * ratio * np.sqrt(stiffness * inertia), rel=1e-6)


@pytest.mark.parametrize("name", sorted(shipped_robots()))
def test_modes_of_the_shipped_robots_have_about_the_ratio_wherever_they_are(name):
    """The slowest three modes in 40 postures that the fit has not seen."""
    robot = with_damping_ratio(load_robot(shipped_robots()[name]), 0.04)
    locked, rng = LockedRobot(robot, "linear"), np.random.default_rng(7)
    ratios = []
    for q in rng.uniform(-1.0, 1.0, (40, len(robot.joints))):
        values = locked.linear(q, np.zeros(6)).modes.damping_ratio
        ratios += values[np.isfinite(values)][:3].tolist()
    assert 0.025 < np.median(ratios) < 0.045
    assert min(ratios) > 0.01
    assert max(ratios) < 0.13


@given(st.integers(0, 10**6), st.integers(2, 7))
@settings(max_examples=20, deadline=None)
def test_all_gears_and_tilts_of_random_robots_are_damped_in_proportion(seed, joints):
    """None is undamped, and twice the ratio is twice each damper."""
    robot = make_robot(seed, joints)
    once, twice = (with_damping_ratio(robot, ratio) for ratio in (0.03, 0.06))
    for joint, doubled in zip(once.joints, twice.joints, strict=True):
        assert joint.damping > 0.0 or joint.stiffness is None
        assert doubled.damping == pytest.approx(2.0 * joint.damping)
        assert [tilt.damping for tilt in doubled.tilt] == pytest.approx(
            [2.0 * tilt.damping for tilt in joint.tilt]
        )
    bare = [
        replace(joint, damping=0.0, tilt=tuple(replace(t, damping=0.0) for t in joint.tilt))
        for joint in robot.joints
    ]
    assert replace(once, joints=tuple(bare)) == replace(robot, joints=tuple(bare))
    assert build_chain(once).elastic_names == build_chain(robot).elastic_names


def test_a_file_states_a_ratio_or_each_damping(tmp_path):
    ratio = "[modal_damping]\nratio = 0.04\n"
    robot = load_robot(two_joints(tmp_path, "stiffness = 2e5", "", ratio))
    assert robot == with_damping_ratio(robot, 0.04)
    assert robot.joints[1].damping > 0.0
    with pytest.raises(
        RobotFileError, match=r"joint 2: damping: expected none beside \[modal_damping\]"
    ):
        load_robot(two_joints(tmp_path, "stiffness = 2e5\ndamping = 3.0", "", ratio))
    for wrong in ("0.0", "-0.1", "0.6", "nan", '"a"'):
        with pytest.raises(RobotFileError, match=r"modal_damping: ratio"):
            load_robot(two_joints(tmp_path, "stiffness = 2e5", "", ratio.replace("0.04", wrong)))


def test_other_stiffness_leaves_the_damping_that_a_ratio_gave(tmp_path):
    """A fitted file states each damping, whose source names the ratio."""
    start = shipped_robots()["icme2008"]
    text = re.sub(r"(?m)^damping.*\n", "", start.read_text())
    text = re.sub(r',\s*damping = [0-9.e]+|(?m:^"joint(\.tilt)?\.damping".*\n)', "", text)
    file, target = tmp_path / "ratio.toml", tmp_path / "new.toml"
    file.write_text(text.replace("[tcp]", "[modal_damping]\nratio = 0.03\n\n[tcp]", 1))
    robot = load_robot(file)
    edit = RobotEdit(file, robot)
    edit.change("joint[2].stiffness", 1e6, "a test")
    target.write_text(edit.text("Softer.", target))
    written = load_robot(target)
    assert [j.damping for j in written.joints] == [j.damping for j in robot.joints]
    assert [t.damping for j in written.joints for t in j.tilt] == [
        t.damping for j in robot.joints for t in j.tilt
    ]
    assert "a damping ratio of 0.03 of all modes" in target.read_text()
