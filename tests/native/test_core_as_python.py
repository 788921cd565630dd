"""Random robots, their gears with hysteresis or without: the core against the model in Python."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from native_core import CURVES, Core, CoreError
from native_derivatives import random_stiffness
from pendulum import held
from random_robots import hardly_loaded, make_robot, with_hysteresis
from touching import entries

from elastic_robot.errors import EquilibriumError
from elastic_robot.gear_parts import StopElement
from elastic_robot.plane_contact import PlaneContact
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import ContactSpring, Load, symmetric

UP = np.array([0.0, 0.0, 1.0])


def require_same(python: ElasticRobot, core: Core) -> None:
    """Compare all outputs at rest."""
    out = core.outputs(python.chain.elastic_count)
    expected = {"x": python.deflection()}
    expected |= {name: getattr(python, name)() for name in ("tcp", "rigid", "deviation")}
    for name, values in expected.items():
        np.testing.assert_allclose(out[name], values, rtol=0, atol=1e-12, err_msg=name)
    upper = python.compliance()[np.triu_indices(3)]
    scale = np.abs(upper).max()
    np.testing.assert_allclose(out["compliance"], upper, rtol=1e-8, atol=1e-7 * scale)


def loads(robot: ElasticRobot, rng: np.random.Generator) -> list[Load]:
    """Wrenches, alone, with a spring at the TCP, and with a plane there; anchors that move."""
    wrench, found = rng.normal(size=6) * 300.0, []
    for k in range(6):
        place = robot.tcp()[:3] + 1e-4 * rng.normal(size=3)
        stiffness = symmetric(random_stiffness(rng)) * (k % 3 == 1)
        plane = PlaneContact(1e6 * (k % 3 == 2), 0.0, 0.0, 0.0, 1e-3, UP)
        anchor = ContactSpring(place, 1e-4 * rng.normal(size=3), stiffness)
        found.append(Load(wrench * rng.uniform(-2.0, 2.0), anchor, contact=plane))
    return found


@pytest.mark.parametrize("has_elements", [False, True])
@pytest.mark.parametrize("kind", CURVES)
def test_random_robots_rest_as_in_python(kind, has_elements):
    """One equilibrium after another, upright and unloaded gears among them.

    Where Python finds none the core finds none.
    """
    for seed in range(28):
        rng, robot = np.random.default_rng(seed), make_robot(seed, 1 + seed % 8)
        robot = with_hysteresis(robot, seed) if has_elements else robot
        n = len(robot.joints)
        q = hardly_loaded(rng, n)[0] if seed % 2 else rng.uniform(-3.0, 3.0, n)
        python, core = ElasticRobot(robot, kind, quasistatic=True), Core(robot)
        python.reset(0.0, held(q), Load())
        core.reset(kind, 0.0, q, np.zeros(6), quasistatic=True)
        for k, load in enumerate(loads(python, rng), start=1):
            try:
                python.step(float(k), held(q), load)
            except EquilibriumError:
                with pytest.raises(CoreError, match="no static equilibrium"):
                    core.step(float(k), q, entries(load))
                break
            core.step(float(k), q, entries(load))
            require_same(python, core)


@pytest.mark.parametrize("plain", [True, False])
@pytest.mark.parametrize("has_elements", [False, True])
@pytest.mark.parametrize("kind", CURVES)
def test_random_robots_move_as_in_python(kind, has_elements, plain):
    """A force comes and goes; a spring takes hold, is stiffened, jumps and lets go, its anchor moving.

    At a tolerance of 1e-9 m at the TCP.
    """
    for seed in range(1 + plain, 8, 3):
        rng, robot = np.random.default_rng(seed), make_robot(seed, 1 + seed % 8)
        robot = with_hysteresis(robot, seed) if has_elements else robot
        q, wrench = rng.uniform(-2.0, 2.0, len(robot.joints)), rng.normal(size=6) * 300.0
        python, core = ElasticRobot(robot, kind, tolerance=1e-9), Core(robot, plain)
        python.reset(0.0, held(q), Load())
        core.reset(kind, 0.0, q, np.zeros(6), tolerance=1e-9)
        k, anchor = random_stiffness(rng), python.tcp()[:3] + 1e-4 * rng.normal(size=3)
        sprung = seed % 2
        for end, factor in ((0.003, 1.0), (0.007, 1.0), (0.02, 1.5), (0.021, 0.1), (0.06, 0.0)):
            velocity = 0.05 * rng.normal(size=3)
            spring = ContactSpring(anchor, velocity, symmetric(sprung * factor * k))
            load, length = Load(wrench * (factor != 0.1), spring), end - python.time
            python.step(end, held(q), load)
            core.step(end, q, entries(load))
            anchor = anchor + length * velocity
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
