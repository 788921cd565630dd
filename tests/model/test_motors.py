"""Motors of the model in Python: a limited servo against tiny steps, states that are kept, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pendulum import held, pendulum
from random_robots import driven, limited, make_robot

from elastic_robot.drive import Drive
from elastic_robot.errors import ParameterError
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load

STIFFNESS, DAMPING, INERTIA = 1e5, 200.0, 50.0  # [N m/rad, N m s/rad, kg m^2] of the pendulum


def tiny_steps(drive: Drive, jump: float, end: float, count: int) -> np.ndarray:
    """Link's angle, motor's, both rates and z by RK4, the integral's waiting decided step by step."""
    limit = drive.torque_limit

    def rates(y: np.ndarray, waits: bool) -> np.ndarray:
        link, q, link_rate, rate, z = y
        wanted = drive.position_gain * (jump - q) - rate
        torque = min(max(drive.rate_gain * wanted + z, -limit), limit)
        gear = STIFFNESS * (link - q) + DAMPING * (link_rate - rate)
        growth = 0.0 if waits else drive.integral_gain * wanted
        return np.array([link_rate, rate, -gear / INERTIA, (torque + gear) / drive.inertia, growth])

    y, h = np.zeros(5), end / count
    for _ in range(count):
        wanted = drive.position_gain * (jump - y[1]) - y[3]
        asked = drive.rate_gain * wanted + y[4]
        waits = abs(asked) > limit and asked * wanted > 0.0
        a = rates(y, waits)
        b = rates(y + 0.5 * h * a, waits)
        c = rates(y + 0.5 * h * b, waits)
        y = y + h / 6.0 * (a + 2.0 * b + 2.0 * c + rates(y + h * c, waits))
    return y


def test_a_servo_slides_along_its_limit_as_tiny_steps_do():
    """At its limit, along it while z grows as much as keeps it there, below: to 5e-5 of the motion."""
    drive = Drive(20.0, 20.0, 4e3, 1e6, torque_limit=200.0)
    arm = pendulum(gravity=(0.0, 0.0, 0.0), stiffness=STIFFNESS, damping=DAMPING, drive=drive)
    model, jump, modes = ElasticRobot(arm, "linear", tolerance=1e-10, drive="servo"), 0.01, []
    model.reset(0.0, held([0.0]), Load())
    for k in range(60):
        model.step((k + 1) * 1e-3, held([jump]), Load())
        modes.append(int(model._motors.modes(model._instant())[0]))
    assert set(modes) == {0, 1, 2}
    motor = np.concatenate([model.motor_angle(), model.motor_rate(), model.servo_integral()])
    _, q, _, rate, z = tiny_steps(drive, jump, 0.06, 40009)
    apart = np.abs(np.array([q, rate, z]) - motor)
    assert np.all(apart < [5e-7, 5e-5, 0.5]), apart


@pytest.mark.parametrize(("step", "pieces"), [(3, 40), (19, 40)])
def test_what_falls_through_zero_beside_another_edge_is_seen(step, pieces):
    """A servo keeps its torque at the limit while gears pass their backlash: once, and in pieces."""
    robot = limited(driven(make_robot(11, 4), np.random.default_rng(11)), 60.0)
    robot, ends = replace(robot, gravity=(0.0, 0.0, 0.0)), []
    for last in (1, pieces):
        model, time = ElasticRobot(robot, "backlash", tolerance=1e-10, drive="servo"), 0.0
        model.reset(0.0, held(np.zeros(4)), Load())
        for k in range(step):
            load = Load(np.array([np.sin(0.7 * k), 0.0, np.cos(0.3 * k), 0.0, 0.0, 0.0]) * 200.0)
            for _ in range(last if k == step - 1 else 1):
                time += 4e-3 / (last if k == step - 1 else 1)
                model.step(time, held(np.full(4, 2e-3)), load)
        ends.append(np.concatenate([model.deflection(), model.motor_angle()]))
    np.testing.assert_allclose(*ends, rtol=0, atol=1e-11)


def test_what_knows_ideal_drives_alone_says_so():
    robot = driven(make_robot(5, 3), np.random.default_rng(5))
    model = ElasticRobot(robot, "linear", drive="servo")
    model.reset(0.0, held(np.zeros(3)), Load())
    with pytest.raises(ParameterError, match="linearise: expected ideal drives"):
        model.linearise()
    with pytest.raises(ParameterError, match="expected one of ideal, servo, torque, got 'fast'"):
        ElasticRobot(robot, drive="fast")
