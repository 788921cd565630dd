"""The contact spring at the TCP in the C core: against Pinocchio, the Python model and closed forms."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from native_core import CURVES, LANES, Core, CoreError, with_settings
from native_derivatives import random_stiffness
from pendulum import held, pendulum
from random_robots import hardly_loaded, make_robot

from elastic_robot.chain import build_chain
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import EquilibriumError
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


@pytest.mark.parametrize("kind", CURVES)
def test_random_robots_rest_on_springs_as_in_python(kind):
    """Rest and outputs on springs of 1 to 1e8 N/m; where Python finds none the core finds none."""
    rng, found = np.random.default_rng(7), 0
    for seed in range(80):
        robot = make_robot(seed, 1 + seed % 8)
        n = len(robot.joints)
        q, wrench = rng.uniform(-3.0, 3.0, n), rng.normal(size=6) * 300.0 * bool(seed % 3)
        python, core = ElasticRobot(robot, kind, quasistatic=True), Core(robot)
        m = python.chain.elastic_count
        try:
            python.reset(0.0, held(q), Load(wrench), undeflected=True)
            tool, size = python.tcp()[:3], 10.0 ** rng.uniform(-5.0, -2.0)
            anchor, k = tool + size * rng.normal(size=3), random_stiffness(rng)
            load = Load(wrench, ContactSpring(anchor, 0.1 * rng.normal(size=3), symmetric(k)))
            python.reset(0.0, held(q), load)
        except EquilibriumError:
            with pytest.raises(CoreError, match=r"no static equilibrium .* and a spring of \["):
                core.reset(kind, 0.0, q, as_core(load), quasistatic=True)
            continue
        core.reset(kind, 0.0, q, as_core(load), quasistatic=True)
        np.testing.assert_allclose(core.outputs(m)["x"], python.deflection(), rtol=0, atol=1e-13)
        found += 1
        # And 10 ms later, where the anchor is then.
        try:
            python.step(0.01, held(q), load)
        except EquilibriumError:
            continue
        core.step(0.01, q, as_core(load))
        out = core.outputs(m)
        np.testing.assert_allclose(out["x"], python.deflection(), rtol=0, atol=1e-13)
        np.testing.assert_allclose(out["tcp"], python.tcp(), rtol=0, atol=1e-13)
        upper = python.compliance()[UPPER]
        scale = np.abs(upper).max()
        np.testing.assert_allclose(out["compliance"], upper, rtol=0, atol=1e-7 * scale)
    assert found > 60


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


@pytest.mark.parametrize("plain", [True, False])
@pytest.mark.parametrize("kind", CURVES)
def test_random_robots_move_on_springs_as_in_python(kind, plain):
    """A spring takes hold, is stiffened, jumps and lets go, its anchor moving: 1e-9 m of each other."""
    for seed in range(1, 8):
        rng, robot = np.random.default_rng(seed), make_robot(seed, 1 + seed % 8)
        n = len(robot.joints)
        q, wrench = rng.uniform(-2.0, 2.0, n), rng.normal(size=6) * 100.0
        python, core = ElasticRobot(robot, kind, tolerance=1e-8), Core(robot, plain)
        try:
            python.reset(0.0, held(q), Load())
        except EquilibriumError:
            continue
        core.reset(kind, 0.0, q, NONE, tolerance=1e-8)
        k, anchor = random_stiffness(rng), python.tcp()[:3] + 1e-4 * rng.normal(size=3)
        for end, factor in ((0.003, 1.0), (0.007, 1.0), (0.02, 1.5), (0.021, 0.1), (0.04, 0.0)):
            velocity = 0.05 * rng.normal(size=3)
            load = Load(wrench, ContactSpring(anchor, velocity, symmetric(factor * k)))
            length = end - python.time
            python.step(end, held(q), load)
            core.step(end, q, as_core(load))
            anchor = anchor + length * velocity
            out = core.outputs(python.chain.elastic_count)
            np.testing.assert_allclose(out["tcp"], python.tcp(), rtol=0, atol=1e-9)
            np.testing.assert_allclose(out["velocity"], python.velocity(), rtol=0, atol=1e-6)


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


def test_of_two_rests_the_one_nearer_to_the_anchor_is_taken():
    """An upright arm falls either way in its backlash; 1 N/m does not hold it up, but tells the side."""
    core = Core(pendulum(backlash=2e-3))
    for side in (1.0, -1.0):
        for lean in (5e-4, -5e-4):
            spring = ContactSpring(np.array([side * 1e-2, 0.0, 1.0]), np.zeros(3), np.eye(3))
            q = np.array([lean - np.pi / 2])
            core.reset("backlash", 0.0, q, as_core(Load(spring=spring)), quasistatic=True)
            out = core.outputs(1)
            assert np.sign(out["x"][0]) == np.sign(out["tcp"][0]) == side
            assert abs(out["x"][0]) > 2e-3
