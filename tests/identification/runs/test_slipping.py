"""Hysteresis of gears and friction of motors are learned beside stiffness, backlash and damping."""

from dataclasses import replace

import numpy as np
import pytest
from circling_robots import Robots
from slipping_servos import slipping

from coupling.identification.runs.effect import ParameterEffect, SecantEffect, moved_by_load
from coupling.identification.runs.parameters import factors_between, learnable
from coupling.identification.runs.slow_part import SlowPart
from coupling.robot.parameters import apply_values, scaled_values
from elastic_robot.drive import Drive


@pytest.fixture(scope="module")
def robots(example, models):
    return Robots(slipping(example), models, seconds=5.0, drive="servo")


def test_slipping_parameters_make_a_robot_and_come_back_from_it(example):
    """Elements keep shares and slip angles; under ideal drives nothing tells friction."""
    robot = slipping(example)
    parameters = learnable(robot, "backlash", "servo")
    x = 0.1 * np.arange(len(parameters))
    other = apply_values(robot, scaled_values(parameters, x))
    np.testing.assert_allclose(factors_between(parameters, other), x, rtol=0, atol=1e-12)
    for old, new in zip(robot.joints, other.joints, strict=True):
        ratios = {
            round(b.slip_torque / a.slip_torque, 12)
            for a, b in zip(old.hysteresis, new.hysteresis, strict=True)
        }
        assert len(ratios) <= 1
        assert [e.slip_angle for e in old.hysteresis] == [e.slip_angle for e in new.hysteresis]
    kinds = [own.kind for own in parameters]
    assert (kinds.count("hysteresis"), kinds.count("friction")) == (5, 5)
    ideal = learnable(robot, "backlash", "ideal")
    assert [own for own in parameters if own.kind != "friction"] == list(ideal)


@pytest.mark.parametrize("integral_gain", [0.0, 4e5])
def test_friction_moves_a_motor_at_a_constant_rate_by_its_loop_at_rest(integral_gain):
    """-F / (Kp Kv) without an integral, nothing for long with one."""
    drive = Drive(50.0, 20.0, 1e4, integral_gain)
    time = np.arange(0.0, 3.0, 2e-3)
    moved = moved_by_load(drive, time, np.minimum(time / 2e-4, 1.0) * 40.0)
    assert moved[-1] == pytest.approx(-40.0 / 2e5 if integral_gain == 0.0 else 0.0, abs=1e-9)
    assert np.abs(moved).max() > 5e-6


def test_what_the_equations_say_of_hysteresis_and_friction_is_what_simulations_do(robots):
    """Without backlash, below 1 Hz: slipping shakes the robot at 10 Hz, as simulations know."""
    tight = replace(
        robots.robot, joints=tuple(replace(own, backlash=0.0) for own in robots.robot.joints)
    )
    own = Robots(tight, robots.models, seconds=4.0, drive="servo")
    one = own.measured(own.moved(own.none), every=3)
    effect = ParameterEffect(tight, "backlash", own.parameters, one)
    secant = SecantEffect((own.fmu,), one, effect, 0.02)
    slow = SlowPart.of(one.measured.time, 1.0)
    told, found = (slow(by(own.none, one.measured.time)[:, :3]) for by in (effect, secant))
    apart: dict[str, list[float]] = {"hysteresis": [], "friction": []}
    for k, parameter in enumerate(own.parameters):
        left = np.sum((told[:, :, k] - found[:, :, k]) ** 2)
        # Wrists are too light to be left alone by what their friction shakes.
        if parameter.kind in apart and parameter.gear < 3:
            apart[parameter.kind].append(float(np.sqrt(left / np.sum(found[:, :, k] ** 2))))
    assert max(apart["hysteresis"]) < 0.02
    assert max(apart["friction"]) < 0.2
