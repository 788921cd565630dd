"""The core's Gauss method alone: order, energy, and flights through a backlash, in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from native_core import Core, with_settings
from pendulum import held, pendulum
from touching import entries, onto

from elastic_robot.plane_contact import PlaneContact
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load

STIFFNESS, INERTIA = 1e4, 50.0  # of `pendulum` [N m/rad, kg m^2]
ANYTHING = 1e9  # a tolerance that rejects no step [m]


def fixed(robot, step: float) -> Core:
    """Steps of one length [s], solved exactly."""
    return with_settings(robot, longest_step=step, first_step=step, iteration=1e-22)


def about_y(moment: float) -> np.ndarray:
    return np.array([0.0, 0.0, 0.0, 0.0, moment, 0.0])


def test_order_is_eight_at_the_steps_end():
    """Pressed, damped and rubbed by a plane that moves: halved steps leave nearly 1/256 of the error."""
    plane, ends = PlaneContact(1e5, 1.0, 0.02, 0.3, 0.5), []
    for steps in (4, 8, 16, 128):
        core = fixed(pendulum(damping=20.0), 0.1 / steps)
        core.reset("linear", 0.0, [0.0], entries(onto(plane, (0, 0, -0.03))), tolerance=ANYTHING)
        core.step(0.1, [0.0], entries(onto(plane, (0, 0, -0.03), (0.1, 0.0, 0.05))))
        ends.append(core.outputs(1)["x"][0])
        assert core.contact()[0][2] > 0.0
    errors = np.abs(np.array(ends[:-1]) - ends[-1])
    assert errors[0] > 1e4 * errors[2] > 1e-12
    assert np.log2(errors[0] / errors[1]) > 7.0


@pytest.mark.parametrize("omega_h", [0.3, 3.0, 10.0, 1e3])
def test_a_spring_of_any_stiffness_keeps_its_energy(omega_h):
    """An arm let go swings on in ten steps of 20 ms, each of omega h radians, and loses nothing."""
    stiffness = INERTIA * (omega_h / 0.02) ** 2
    core = fixed(pendulum(gravity=(0.0, 0.0, 0.0), stiffness=stiffness), 0.02)
    core.reset("linear", 0.0, [0.0], about_y(1e-5 * stiffness), tolerance=ANYTHING)
    for k in range(10):
        core.step(0.02 * (k + 1), [0.0], about_y(0.0))
        out = core.outputs(1)
        x, v = out["x"][0], out["velocity"][2]
        assert np.hypot(x, v * 0.02 / omega_h) == pytest.approx(1e-5, rel=1e-8)


def test_flight_through_the_backlash_and_bounces_follow_the_closed_form():
    """Free flight over the backlash 2 B, half a sine on each flank, from rest on one of them."""
    backlash, wound = 2e-3, 1e-2
    omega = np.sqrt(STIFFNESS / INERTIA)
    speed, bounce = omega * wound, np.pi / omega
    flight = 2.0 * backlash / speed
    core = Core(pendulum(gravity=(0.0, 0.0, 0.0), backlash=backlash))
    core.reset("backlash", 0.0, [0.0], about_y(STIFFNESS * wound), tolerance=1e-9)
    assert core.outputs(1)["x"][0] == pytest.approx(backlash + wound, abs=1e-12)
    for cycles in (0, 1, 5):
        core.step(0.5 * (bounce + flight) + 2.0 * cycles * (bounce + flight), [0.0], about_y(0.0))
        out = core.outputs(1)
        assert out["x"][0] == pytest.approx(0.0, abs=1e-8)
        assert out["velocity"][2] == pytest.approx(speed, abs=1e-7)


def test_a_grazing_touch_is_not_stepped_over():
    """A flight that is braked and reaches the other flank by 10 urad for a moment, in one call."""
    backlash, braking, beyond = 1e-3, 50.0, 1e-5
    left = (
        2.0 * braking / INERTIA * (2.0 * backlash + beyond)
    )  # speed squared where the flank is left
    amplitude = np.sqrt(left * INERTIA / STIFFNESS + (braking / STIFFNESS) ** 2)
    robot = pendulum(gravity=(0.0, 0.0, 0.0), backlash=backlash)
    start, push = (about_y(-STIFFNESS * amplitude - braking), about_y(-braking))
    core, python = Core(robot), ElasticRobot(robot, tolerance=1e-9)
    core.reset("backlash", 0.0, [0.0], start, tolerance=1e-9)
    python.reset(0.0, held([0.0]), Load(start))
    core.step(0.25, [0.0], push)
    python.step(0.25, held([0.0]), Load(push))
    assert core.outputs(1)["x"][0] == pytest.approx(python.deflection()[0], abs=1e-10)


@pytest.mark.parametrize("time", [0.0, 100.0])
@pytest.mark.parametrize("step", [1e-11, 1e-14])
def test_a_robot_moves_in_steps_of_any_length(step, time):
    """Newton's law over a thousand steps of a free arm; a step of usual length goes on from there."""
    core, moment = Core(pendulum(gravity=(0.0, 0.0, 0.0), stiffness=1.0)), 1e4
    core.reset("linear", time, [0.0], about_y(0.0), tolerance=1e-6)
    for k in range(1, 1001):
        core.step(k * step, [0.0], about_y(moment))
    rate = core.outputs(1)["velocity"][4]
    assert rate == pytest.approx(moment / INERTIA * 1000 * step, rel=1e-9)
    core.step(1e-3, [0.0], about_y(moment))
    assert core.outputs(1)["velocity"][4] == pytest.approx(moment / INERTIA * 1e-3, rel=1e-6)
