"""Robots whose gears have hysteresis: the core against the model in Python, at rest and in motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from native_core import CURVES, Core
from pendulum import held
from random_robots import hardly_loaded, make_robot, with_hysteresis
from touching import entries

from elastic_robot.gear_parts import StopElement
from elastic_robot.plane_contact import PlaneContact
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import ContactSpring, Load

UP = np.array([0.0, 0.0, 1.0])


def loads(robot: ElasticRobot, rng: np.random.Generator) -> list[Load]:
    """Wrenches, alone, with a spring at the TCP, and with a plane there."""
    wrench, found = rng.normal(size=6) * 300.0, []
    for k in range(6):
        place = robot.tcp()[:3] + 1e-4 * rng.normal(size=3)
        stiffness = np.diag(10.0 ** rng.uniform(4.0, 7.0, 3)) * (k % 3 == 1)
        plane = PlaneContact(1e6 * (k % 3 == 2), 0.0, 0.0, 0.0, 1e-3, UP)
        anchor = ContactSpring(place, np.zeros(3), stiffness)
        found.append(Load(wrench * rng.uniform(-2.0, 2.0), anchor, contact=plane))
    return found


@pytest.mark.parametrize("kind", CURVES)
def test_gears_with_a_past_rest_as_in_python(kind):
    """One equilibrium after another, upright and unloaded gears among them."""
    for seed in range(28):
        rng = np.random.default_rng(seed)
        robot = with_hysteresis(make_robot(seed, 1 + seed % 7), seed)
        n = len(robot.joints)
        q = hardly_loaded(rng, n)[0] if seed % 2 else rng.uniform(-3.0, 3.0, n)
        python, core = ElasticRobot(robot, kind, quasistatic=True), Core(robot)
        python.reset(0.0, held(q), Load())
        core.reset(kind, 0.0, q, np.zeros(6), quasistatic=True)
        for k, load in enumerate(loads(python, rng), start=1):
            python.step(float(k), held(q), load)
            core.step(float(k), q, entries(load))
            out = core.outputs(python.chain.elastic_count)
            np.testing.assert_allclose(out["x"], python.deflection(), rtol=0, atol=1e-12)
            np.testing.assert_allclose(out["tcp"], python.tcp(), rtol=0, atol=1e-12)
            upper = python.compliance()[np.triu_indices(3)]
            np.testing.assert_allclose(out["compliance"], upper, rtol=1e-8, atol=1e-17)


@pytest.mark.parametrize("kind", CURVES)
def test_slipping_gears_move_as_in_python(kind):
    """Let go, loaded and let go again, at a tolerance of 1e-9 m at the TCP."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        robot = with_hysteresis(make_robot(seed, 2 + seed % 4), seed)
        q, wrench = rng.uniform(-2.0, 2.0, len(robot.joints)), rng.normal(size=6) * 300.0
        python, core = ElasticRobot(robot, kind, tolerance=1e-9), Core(robot)
        python.reset(0.0, held(q), Load())
        core.reset(kind, 0.0, q, np.zeros(6), tolerance=1e-9)
        for end in (0.003, 0.02, 0.021, 0.06, 0.1):
            load = Load(wrench * (end < 0.05))
            python.step(end, held(q), load)
            core.step(end, q, load.wrench)
            out = core.outputs(python.chain.elastic_count)
            np.testing.assert_allclose(out["x"], python.deflection(), rtol=0, atol=1e-9)
            np.testing.assert_allclose(out["velocity"], python.velocity(), rtol=0, atol=1e-6)


@pytest.mark.parametrize(("kind", "parts"), [("backlash", (1.0,)), ("spline", (0.5, 1.5))])
def test_slip_angles_on_the_edge_of_the_backlash_are_passed_with_it(example, kind, parts):
    """From the undeflected gear an element slips and its curve bends at one moment: both are seen."""
    joints = tuple(
        replace(j, hysteresis=tuple(StopElement(40.0, part * j.backlash) for part in parts))
        if j.backlash > 0.0
        else j
        for j in example.joints
    )
    robot = replace(example, joints=joints)
    q = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])
    python = ElasticRobot(robot, kind, tolerance=1e-8)
    python.reset(0.0, held(q), Load(), undeflected=True)
    core = Core(robot)
    core.reset(kind, 0.0, q, np.zeros(6), tolerance=1e-8, undeflected=True)
    for k in range(30):
        wrench = np.array([300.0 * np.sin(1.1 * k), 0.0, 1500.0 * np.sin(0.5 * k), 0.0, 0.0, 0.0])
        end = 4e-3 * (k + 1)
        python.step(end, held(q), Load(wrench))
        core.step(end, q, wrench)
        out = core.outputs(python.chain.elastic_count)
        np.testing.assert_allclose(out["tcp"], python.tcp(), rtol=0, atol=1e-8)
