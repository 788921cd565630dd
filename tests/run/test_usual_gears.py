"""Usual values of what robot files leave out."""

from dataclasses import replace

import numpy as np
import pytest
from placed_robots import placed_robot

from coupling.files.robot_file import find_robot, load_robot
from coupling.run.usual_gears import FRICTION, VISCOUS, completed, left_out, usual_drive


def names(robot, torque_curve="backlash", drive="ideal"):
    """Return what is left out."""
    return [own.name for own in left_out([placed_robot(robot, torque_curve, drive)])]


def without(robot, **values):
    """Return a robot of whose joints all have other values."""
    return replace(robot, joints=tuple(replace(joint, **values) for joint in robot.joints))


def test_a_usual_motor_is_the_median_of_the_published_ones():
    """Over the stiffness of the gear, of the nine gears of two robots."""
    joints = [
        joint
        for name in ("kuka_kr300", "manutec_r3")
        for joint in load_robot(find_robot(name)).joints
        if joint.drive
    ]
    assert len(joints) == 9

    def values(joint, drive):
        k, inertia = joint.stiffness, drive.inertia
        return k / inertia, drive.rate_gain / inertia, drive.position_gain

    published = np.array([values(joint, joint.drive) for joint in joints])
    usual = values(joints[0], usual_drive(joints[0]))
    np.testing.assert_allclose(usual, np.median(published, axis=0), rtol=5e-3)
    ratios = [(own.drive.friction, own.drive.viscous) / np.array(own.stiffness) for own in joints]
    np.testing.assert_allclose((FRICTION, VISCOUS), np.median(ratios, axis=0), rtol=1e-2)


def test_a_robot_is_completed_by_what_it_has_not(example):
    """The example has backlash alone; completed it lacks nothing, and what it had is as it was."""
    values = left_out([placed_robot(example)])
    assert [own.name for own in values] == [
        "hysteresis 0.5 arc minutes wide",
        "servos",
        "servos and friction",
    ]
    (whole,) = completed([placed_robot(example)], values)
    assert names(whole.description, whole.torque_curve, whole.drive) == []
    for own, old in zip(whole.description.joints, example.joints, strict=True):
        assert (own.stiffness, own.backlash) == (old.stiffness, old.backlash)
        assert (own.drive is None) == (own.stiffness is None)
    assert names(without(example, backlash=0.0))[0] == "backlash of 0.2 arc minutes"


def test_a_curve_without_backlash_leaves_it_out(example):
    """The file's own backlash counts then."""
    assert "backlash of 0.2 arc minutes" in names(example, "linear")
    (value,) = [own for own in left_out([placed_robot(example, "linear")]) if own.backlash]
    other = value.completed(placed_robot(example, "linear"))
    assert other.torque_curve == "backlash"
    assert other.description.joints[0].backlash == example.joints[0].backlash


@pytest.mark.parametrize(("drive", "said"), [("ideal", ["servos and friction"]), ("servo", [])])
def test_a_case_may_leave_out_servos_that_the_file_has(drive, said):
    robot = load_robot(find_robot("kuka_kr300"))
    assert [own for own in names(robot, drive=drive) if "servo" in own] == said
