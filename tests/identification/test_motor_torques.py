"""Measured torques that no motor can have, and those that look strange and are right."""

from dataclasses import replace

import numpy as np
import pytest

from coupling.errors import IdentifyError
from coupling.identification.motion.driven_fmu import DrivenFmu
from coupling.identification.motion.identification import identify_motion
from coupling.identification.motor_torques import MotorTorques, torque_remarks
from docs.scripts.motion_recovery import BANDWIDTH, arm, recorded
from elastic_robot.description import Robot

TIME = 0.004 * np.arange(1500)
ANGLE = 0.4 * np.sin(2.0 * np.pi * 0.4 * TIME) + 0.3 * np.sin(2.0 * np.pi * 0.17 * TIME)
RATE = np.gradient(ANGLE, TIME)
DRIVE = arm().joints[0].drive
NOISE = 10.0 * np.random.default_rng(3).standard_normal(len(TIME))


def load(weight: float = 900.0, rotor: float = 60.0, turned: float = 0.0) -> np.ndarray:
    """Torque of weight and acceleration [N m], of a joint whose axis is level, its mass turned [rad]."""
    return weight * np.cos(ANGLE + turned) + rotor * np.gradient(RATE, TIME)


def friction(dry: float = 120.0, viscous: float = 300.0) -> np.ndarray:
    return dry * np.tanh(RATE / 1e-3) + viscous * RATE


def told(
    measured: np.ndarray,
    predicted: np.ndarray,
    rows: slice = slice(None),
    robot: Robot | None = None,
) -> tuple[str, ...]:
    """Remarks on joint 1 of a robot, or of the arm, whose friction is that of `friction`."""
    columns = [own[rows, None] for own in (measured + NOISE, predicted, RATE)]
    torques = MotorTorques("motion.csv", [0], TIME[rows], *columns)
    return torque_remarks(torques, robot or arm(), IdentifyError)


def smooth_arm() -> Robot:
    """The arm without friction in its file."""
    first, second = arm().joints
    return replace(
        arm(), joints=(replace(first, drive=replace(DRIVE, friction=0.0, viscous=0.0)), second)
    )


@pytest.mark.parametrize("weight", [900.0, 0.0], ids=["level", "upright"])
@pytest.mark.parametrize(
    ("factor", "says"),
    [(-1.0, "is the sign reversed"), (1e-3, "in kN m"), (0.01, "the gear ratio")],
)
def test_another_sign_another_unit_and_the_motors_side_are_refused(weight, factor, says):
    torque = load(weight) + friction()
    measured = factor * (torque + NOISE) - NOISE
    with pytest.raises(IdentifyError, match=rf"motion.csv: joint 1: .* got {factor:.1g}.*{says}"):
        told(measured, torque)


@pytest.mark.parametrize("rows", [slice(None), slice(0, 400), slice(200, 260), slice(0, 150)])
@pytest.mark.parametrize(
    ("measured", "predicted"),
    [
        (load() + friction(1200.0, 3000.0), load() + friction()),
        (load(450.0, 40.0) + friction(), load() + friction()),
        (load(1350.0, 80.0) + friction(40.0, 50.0), load() + friction()),
        (load(0.0, 1.0) + friction(400.0, 900.0), load(0.0, 1.0) + friction()),
        (load() + friction() + 100.0, load() + friction()),
    ],
    ids=["much friction", "half the load", "more load", "upright", "an offset"],
)
def test_wrong_masses_and_friction_are_no_fault_of_torques(measured, predicted, rows):
    assert told(measured, predicted, rows) == ()


def test_a_torque_that_masses_may_explain_is_told():
    """A tool of five times the weight that the file has, or percent of a rated torque of 500 N m."""
    for factor in (5.0, 0.2):
        (words,) = told(factor * load() + friction(), load() + friction())
        assert f"got {factor:.1g}" in words
        assert "or a payload or balancer missing in the robot file?" in words


def test_a_weight_that_a_balancer_not_in_the_file_carries_is_told():
    """Of 2000 N m 40 are left, and friction: that of the file, or of a file without any."""
    for robot, known in ((arm(), friction()), (smooth_arm(), 0.0)):
        (words,) = told(load(40.0, 1.0) + friction(), load(2000.0, 50.0) + known, robot=robot)
        assert "got 0.02" in words


def test_a_turned_sign_is_refused_without_friction():
    with pytest.raises(IdentifyError, match=r"got -1 times .*sign reversed"):
        told(-load(), load(), robot=smooth_arm())


def test_weight_and_friction_are_not_told_apart_where_a_motor_moves_one_way():
    """Its centre of mass is 0.8 rad elsewhere; and so for less than a second."""
    measured = load(600.0, turned=-0.8) + friction()
    for rows in (slice(740, 1040), slice(1020, 1170)):
        assert told(measured, load() + friction(), rows) == ()


def test_what_a_motor_holds_at_rest_tells_nothing():
    """Between strokes it rests for 3 s, creeps, and holds 330 N m the other way, as before it rested."""
    moves, rests = np.arange(400), np.tile(np.repeat([1.0, -1.0], 375), 4)
    motion = (load(0.0, 1.0) + friction())[moves]
    measured = np.concatenate([motion, -330.0 * rests, motion])
    needed = np.concatenate([motion, np.zeros(len(rests)), motion])
    rate = np.concatenate([RATE[moves], 1e-4 * rests, RATE[moves]])
    columns = [own[:, None] for own in (measured, needed, rate)]
    time = 0.004 * np.arange(len(rate))
    assert torque_remarks(MotorTorques("", [0], time, *columns), arm(), IdentifyError) == ()


def test_a_recording_with_a_turned_sign_is_not_fitted():
    robot = arm()
    with DrivenFmu(robot) as fmu:
        good = recorded(fmu, robot, np.random.default_rng(9))
    bad = replace(good, name="bad.csv", torque=good.torque * [1.0, -1.0])
    for measured in ([bad], [good, replace(bad, is_held_out=True)]):
        with pytest.raises(
            IdentifyError, match=r"bad.csv: joint 2: .* got -[01.]+[0-9]* times .* sign"
        ):
            identify_motion(robot, measured, BANDWIDTH)
