"""The core's rest is a minimum of the energy that Python writes down from docs/model.md."""

from dataclasses import replace

import numpy as np
import pytest
from native_core import CURVES, Core, CoreError
from native_derivatives import random_stiffness
from random_robots import hardly_loaded, make_robot, with_gear_parts, with_hysteresis

from coupling.files.robot_file import find_robot, load_robot
from elastic_robot.body import Body
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import EquilibriumError
from elastic_robot.hysteresis import Hysteresis, Past
from elastic_robot.kinematics import base_from_tool
from elastic_robot.parameters import Parameters
from elastic_robot.plane_contact import NO_CONTACT, PlaneContact
from elastic_robot.robot import ElasticRobot
from elastic_robot.statics import EnergyAtRest
from elastic_robot.tool_load import NO_SPRING, Load, ToolLoad, symmetric
from elastic_robot.torque_curves import TORQUE_CURVES, BacklashCurve
from elastic_robot.trajectory import HeldCommand

NORMAL = np.array([0.2, -0.3, 1.0])
UPPER = np.triu_indices(3)
LOADS = ("wrench", "spring", "contact", "spring and contact")
# Torque that a gear does not feel [N m], of docs/model.md; and rounding [rad]: a spring of 1e8 N/m 3 m
# away errs by 1e-7 N, which moves a gear of 1e6 N m/rad by 1e-13 rad.
NEUTRAL, ROUNDING = 1e-6, 1e-12


def at_rest(robot: Robot, curve: str, q: np.ndarray, acting: ToolLoad) -> EnergyAtRest:
    chain, parameters = build_chain(robot), Parameters.of(robot)
    past = Past.start(Hysteresis(chain.elements, parameters.hysteresis))
    law = TORQUE_CURVES[curve].build(parameters)
    output = chain.kinematic_errors.output_angle(q)
    dynamics = Dynamics(chain, parameters.gravity)
    return EnergyAtRest(dynamics, law, chain.theta(output), acting, past)


def drawn(seed: int, kind: str) -> tuple[Robot, np.ndarray, ToolLoad]:
    """A robot with balancers, kinematic errors, payload and, every other one, hysteresis; its load."""
    rng = np.random.default_rng([seed, LOADS.index(kind)])
    robot = with_gear_parts(make_robot(seed, 1 + seed % 6), seed)
    robot = with_hysteresis(robot, seed) if seed % 2 else robot
    payload = Body(20.0, tuple(rng.uniform(-0.1, 0.1, 3).tolist()), (0.3, 0.4, 0.5))
    robot = replace(robot, payload=payload)
    q = rng.uniform(-3.0, 3.0, len(robot.joints))
    chain = build_chain(robot)
    tool = base_from_tool(chain, chain.model.createData(), chain.theta(q)).translation
    anchor = tool + 10.0 ** rng.uniform(-5.0, -3.0) * rng.normal(size=3)
    stiffness = symmetric(random_stiffness(rng)) if "spring" in kind else NO_SPRING.stiffness
    plane = PlaneContact(10.0 ** rng.uniform(4.0, 7.0), radius=0.01, friction=0.3, normal=NORMAL)
    wrench = rng.normal(size=6) * [300.0, 300.0, 300.0, 30.0, 30.0, 30.0] * bool(seed % 3)
    contact = plane if "contact" in kind else NO_CONTACT
    return robot, q, ToolLoad(wrench, anchor, stiffness, contact)


def as_core(acting: ToolLoad) -> np.ndarray:
    plane = acting.contact
    of_plane = [plane.stiffness, plane.dissipation, plane.radius, plane.friction, plane.slip_speed]
    parts = (acting.wrench, acting.anchor, np.zeros(3), acting.stiffness[UPPER], of_plane)
    return np.concatenate([*parts, plane.normal])


def core_rest(core: Core, curve: str, q: np.ndarray, acting: ToolLoad, m: int) -> np.ndarray:
    core.reset(curve, 0.0, q, as_core(acting), quasistatic=True)
    return core.outputs(m)["x"]


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("kind", LOADS)
def test_the_energys_slopes_are_the_torques_out_of_balance(kind, curve):
    """Central differences over 1e-7 rad, without a moment, which has no potential.

    Rounding of some kJ over 1e-7 rad is 1e-5 N m, a curvature of 1e11 N m/rad^2 leaves 1e-3 N m.
    """
    for seed in range(8):
        robot, q, acting = drawn(seed, kind)
        acting = replace(acting, wrench=acting.wrench * [1, 1, 1, 0, 0, 0])
        energy = at_rest(robot, curve, q, acting)
        x = 3e-4 * np.random.default_rng(seed).normal(size=energy.count)
        for k, unit in enumerate(np.eye(energy.count)):
            rise = energy.energy(x + 1e-7 * unit) - energy.energy(x - 1e-7 * unit)
            slope = -energy.residual(x)[k]
            assert rise / 2e-7 == pytest.approx(slope, rel=1e-5, abs=1e-2), (seed, k)


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("kind", LOADS)
def test_random_robots_rest_where_the_energy_is_least(kind, curve):
    """No torque is left, the energy rises on all sides, and it is the minimum that the page names.

    Where there is none in Python there is none in the core.
    """
    count = 0
    for seed in range(40):
        robot, q, acting = drawn(seed, kind)
        energy, core = at_rest(robot, curve, q, acting), Core(robot)
        try:
            expected = energy.equilibrium()
        except EquilibriumError:
            with pytest.raises(CoreError, match="no static equilibrium"):
                core_rest(core, curve, q, acting, energy.count)
            continue
        x = core_rest(core, curve, q, acting, energy.count)
        assert np.abs(energy.residual(x)).max(initial=0.0) < 2.0 * NEUTRAL, seed
        np.testing.assert_allclose(x, expected, rtol=0, atol=ROUNDING, err_msg=f"{seed}")
        count += 1
    assert count > 30


@pytest.mark.parametrize("curve", ["backlash", "spline"])
@pytest.mark.parametrize("sprung", [False, True])
def test_of_several_equilibria_the_core_takes_the_one_that_the_page_names(example, curve, sprung):
    """Hardly loaded gears of the example robot, of which some hang in their backlash: to 1e-9 rad.

    1e-6 N m over a gradient of 1e3 N m/rad.  Where both flanks are as good, the core may take the
    other one: the TCP as near to the anchor to 0.1 nm, or rounded flanks that carry the same to 10 %,
    which it compares as if they were straight.
    """
    rng, core, others, hanging = np.random.default_rng(1), Core(example), 0, 0
    for _ in range(100):
        q, wrench = hardly_loaded(rng, 6)
        acting = ToolLoad(wrench)
        if sprung:
            chain = build_chain(example)
            tool = base_from_tool(chain, chain.model.createData(), chain.theta(q)).translation
            anchor = tool + 10.0 ** rng.uniform(-6.0, -3.0) * rng.normal(size=3)
            acting = ToolLoad(wrench, anchor, symmetric(random_stiffness(rng)))
        energy = at_rest(example, curve, q, acting)
        x, expected = core_rest(core, curve, q, acting, 11), energy.equilibrium()
        assert np.abs(energy.residual(x)).max() < 2.0 * NEUTRAL
        hanging += bool(((energy.curve.region(x) == 0) & (x != 0.0)).any())
        if np.abs(x - expected).max() < 1e-9:
            continue
        others += 1
        gear = int(np.abs(x - expected).argmax())
        ours, mirrored = energy.preference(x, gear), energy.preference(expected, gear)
        if sprung:
            assert ours == pytest.approx(mirrored, abs=1e-10)
        else:
            assert curve == "spline"
            assert ours == pytest.approx(mirrored, rel=0.1)
    assert others <= 6
    assert hanging > 5 * sprung


# Plays and drive angles [rad] at which the bent FANUC carries its flange upright, as it does under a
# command that corrects for what it bends: gear 6 is loaded by some 1e-8 N m, and turned in its backlash
# it loads itself more by way of the others.
UPRIGHT = (
    ((5e-4, 2.4e-4, 1.7e-4, 2.6e-4, 4e-4, 2.8e-4), (0.3, 0.25, -0.38, -2e-4, -0.9386729384, -0.85)),
    (
        (1.8e-4, 4.9e-4, 3.7e-4, 3.1e-4, 4.4e-4, 2.9e-4),
        (0.3, 0.25, -0.38, -2e-4, -0.9381745334, -0.45),
    ),
)


@pytest.mark.parametrize(("backlash", "q"), UPRIGHT)
def test_an_upright_gear_rests_with_nothing_left_to_balance(backlash, q):
    """Going from branch to branch of the torque curves ends in a ring there; core and Python agree."""
    fanuc = load_robot(find_robot("fanuc_r2000ic"))
    joints = [replace(own, backlash=b) for own, b in zip(fanuc.joints, backlash, strict=True)]
    robot, q = replace(fanuc, joints=tuple(joints)), np.array(q)
    python, core = ElasticRobot(robot, "backlash"), Core(robot)
    python.reset(0.0, HeldCommand(0.0, q, np.zeros(6), np.zeros(6)), Load(np.zeros(6)))
    core.reset("backlash", 0.0, q, np.zeros(6))
    chain, parameters = build_chain(robot), Parameters.of(robot)
    x, theta = python.deflection(), chain.theta(q)
    theta[chain.elastic] += x
    needed = Dynamics(chain, np.array(robot.gravity)).static_torque(theta, ToolLoad(np.zeros(6)))
    carried = BacklashCurve(parameters.stiffness, parameters.backlash).torque(x)
    np.testing.assert_allclose(carried, needed, rtol=0, atol=1e-9)
    assert np.abs(x[-1]) < backlash[-1] * (1.0 + 1e-6)
    np.testing.assert_allclose(core.outputs(len(x))["x"], x, rtol=0, atol=1e-9)
