"""The contact spring at the TCP in the C core: against Pinocchio, at rest, and in the stepper."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from native_core import CURVES, LANES, Core, CoreError, with_settings
from native_derivatives import random_stiffness
from random_robots import hardly_loaded, make_robot

from elastic_robot.chain import build_chain
from elastic_robot.dynamics import Dynamics
from elastic_robot.kinematics import base_from_tool, tcp_jacobian
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import ContactSpring, Load, symmetric

POSTURE = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])
NONE = np.zeros(6)
UPPER = np.triu_indices(3)


def as_core(load: Load) -> np.ndarray:
    spring = load.spring
    return np.concatenate([load.wrench, spring.position, spring.velocity, spring.stiffness[UPPER]])


@pytest.mark.parametrize("plain", [True, False])
def test_places_and_pulls_are_those_of_pinocchio(plain):
    """The TCP of four states and what a wrench on it adds to their loads, 1 to 8 joints: to 1e-12."""
    rng = np.random.default_rng(0)
    for seed in range(100):
        robot = make_robot(seed + 100 * plain, 1 + seed % 8)
        core, chain = Core(robot, plain), build_chain(robot)
        dynamics = Dynamics(chain, np.array(robot.gravity))
        theta, wrench = rng.normal(size=(LANES, chain.model.nv)), 1e3 * rng.normal(size=(LANES, 6))
        tcp, load = core.pull(theta, wrench, chain.elastic_count)
        for k in range(LANES):
            place = base_from_tool(chain, dynamics.data, theta[k]).translation
            lever = tcp_jacobian(chain, dynamics.data, theta[k])[:, chain.elastic]
            np.testing.assert_allclose(tcp[k], place, rtol=0, atol=1e-13)
            np.testing.assert_allclose(load[k], -wrench[k] @ lever, rtol=0, atol=1e-8)


@pytest.mark.parametrize("kind", ["backlash", "spline"])
def test_lined_up_robots_rest_on_springs_of_all_sizes(example, kind):
    """From 1e-2 to 3e9 N/m: left is an edge's 1e-6 N m, or rounding of the spring's torque."""
    rng, core = np.random.default_rng(1), Core(example)  # some start at a rounded flank's foot
    python = ElasticRobot(example, kind, quasistatic=True)
    dynamics, curve = python._dynamics, python._curve
    for _ in range(1000):
        q, wrench = hardly_loaded(rng, 6)
        with contextlib.suppress(CoreError):  # without a spring not every one has a rest
            core.reset(kind, 0.0, q, wrench, quasistatic=True)
        anchor = core.outputs(11)["tcp"][:3] + 10.0 ** rng.uniform(-6.0, -2.5) * rng.normal(size=3)
        k = random_stiffness(rng) * 10.0 ** rng.uniform(-2.0, 1.5)
        load = Load(wrench, ContactSpring(anchor, np.zeros(3), symmetric(k)))
        core.reset(kind, 0.0, q, as_core(load), quasistatic=True)
        x = core.outputs(11)["x"]
        left = dynamics.static_torque(python.chain.theta(q, x), load.at(0.0)) - curve.torque(x)
        assert np.abs(left).max() < 2e-6 + 1e-13 * np.abs(k).max()


def _spring(core: Core, stiffness: float) -> np.ndarray:
    """A load: a spring in all directions, its anchor above the tool by 10 um."""
    x, y, z = core.outputs(11)["tcp"][:3]
    spring = [
        x,
        y,
        z + 1e-5,
        0.0,
        0.0,
        0.0,
        *(stiffness * np.array([1.0, 0.0, 0.0, 1.0, 0.0, 1.0])),
    ]
    return np.append(NONE, spring)


def test_newtons_matrices_are_those_of_the_present_spring(example):
    """In steps of one length, whose matrices would serve on."""
    core = Core(example)
    core.reset("linear", 0.0, POSTURE, NONE)
    springs = [_spring(core, k) for k in (0.0, 1e5, 1e5, 1.001e5, 1e8, 0.0)]
    for number in range(60):
        spring = springs[number // 10]
        core.step(0.004 * (number + 1), POSTURE, spring)
        np.testing.assert_array_equal(core.spring_of_matrices(), spring[-6:])


@pytest.mark.parametrize("held_before", [True, False])
def test_a_stiff_spring_takes_steps_as_long_as_a_soft_one(example, held_before):
    """60 ms on 1e8 N/m, at 1e-4 m, in 9 tries; with matrices that leave it out it takes 23."""
    core = with_settings(example, most_tries=9.0, most_tries_per_longest=1e-9)
    core.reset("linear", 0.0, POSTURE, NONE, tolerance=1e-4)
    stiff = _spring(core, 1e8)
    for number, holds in enumerate((held_before, True, True, held_before, True)):
        core.step(0.06 * (number + 1), POSTURE, stiff if holds else NONE)


@pytest.mark.parametrize("plain", [True, False])
@pytest.mark.parametrize("quasistatic", [True, False])
@pytest.mark.parametrize("kind", CURVES)
def test_without_stiffness_an_anchor_changes_no_bit(example, kind, quasistatic, plain):
    rng = np.random.default_rng(2)
    cores, loads = (Core(example, plain), Core(example, plain)), []
    for core in cores:
        core.reset(kind, 0.0, POSTURE, NONE, quasistatic=quasistatic)
    for number in range(40):
        wrench = 300.0 * rng.normal(size=6) * (number % 5 < 3)
        anchor = np.concatenate([rng.normal(size=6), np.copysign(NONE, rng.normal(size=6))])
        q, end = POSTURE + 1e-3 * rng.normal(size=6), 0.004 * (number + 1)
        found = []
        for core, load in zip(cores, (wrench, np.append(wrench, anchor)), strict=True):
            core.step(end, q, load)
            found.append(b"".join(values.tobytes() for values in core.outputs(11).values()))
        assert found[0] == found[1]
        loads.append(found[0])
    assert len(set(loads)) == 40
