"""The robot against a second implementation, MuJoCo (examples/mujoco_robot).

Mass matrix, bias forces, forward kinematics and Jacobian to 1e-10; equilibrium to rounding; motion as
far as MuJoCo's own convergence lets it be known.
"""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from conftest import reference
from places import REFERENCE
from random_robots import make_robot

from elastic_robot.body import Body
from elastic_robot.chain import build_chain
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.torque_curves import TORQUE_CURVES
from elastic_robot.trajectory import HeldCommand, read_trajectory

pytest.importorskip("mujoco", reason="needs the package mujoco, which is in the extra 'test'")
import itertools

from mujoco_differences import both_at_rest, largest_differences

from examples.mujoco_robot import MujocoRobot, MujocoSimulation


def test_the_example_robot_is_mujocos_in_a_thousand_states(example):
    assert largest_differences(example, 1000, seed=1).max() < 1e-10


@pytest.mark.parametrize("seed", range(50))
def test_random_robots_are_mujocos(seed):
    assert largest_differences(make_robot(seed, 3 + seed % 6), 20, seed).max() < 1e-10


def test_a_payload_counts_in_both(example):
    loaded = replace(example, payload=Body(50.0, (0.4, 0.1, 0.0), (1.0, 2.0, 2.5)))
    assert largest_differences(loaded, 50, seed=2).max() < 1e-10
    # The comparison sees the payload at all.
    chain, other = build_chain(example), MujocoRobot(loaded)
    theta = np.full(chain.model.nv, 0.3)
    other.set(theta, 0.0 * theta)
    light = pin.crba(chain.model, chain.model.createData(), theta)
    assert abs(light[0, 0] - other.mass_matrix()[0, 0]) > 1.0


def at_rest(q: np.ndarray) -> HeldCommand:
    return HeldCommand(0.0, q, np.zeros(len(q)), np.zeros(len(q)))


@pytest.mark.parametrize("curve", TORQUE_CURVES)
def test_both_come_to_rest_at_the_same_place(curve):
    """30 random robots under random wrenches: the same deflections to 1e-13 rad."""
    rng = np.random.default_rng(3)
    for seed in range(30):
        joints = 1 + seed % 8
        q, wrench = rng.uniform(-2, 2, joints), rng.normal(size=6) * [300, 300, 300, 50, 50, 50]
        ours, other = both_at_rest(make_robot(seed, joints), curve, q, wrench)
        np.testing.assert_allclose(ours, other, rtol=0, atol=1e-13)


def force_step() -> tuple:
    """-2000 N on 0.1 <= t < 0.3 s, samples of 1 ms."""
    times = np.arange(401) * 1e-3
    wrench = np.zeros((401, 6))
    wrench[(times > 0.1005) & (times < 0.3005), 2] = -2000.0
    return at_rest(np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])), times, wrench


def iso_path(end: float) -> tuple:
    times = np.arange(round(end / 0.01) + 1) * 0.01
    drives = read_trajectory(REFERENCE / "iso_path_joints.npz", 6)
    return drives, times, np.zeros((len(times), 6))


@pytest.mark.parametrize("scenario", [force_step(), iso_path(1.0)], ids=["force", "path"])
# A kink of the torque inside a step costs RK4 its order: two are left, about.
@pytest.mark.parametrize(("curve", "order"), [("linear", 4.0), ("spline", 4.0), ("backlash", 1.5)])
def test_mujoco_converges_to_our_motion(example, scenario, curve, order):
    """Steps of 1, 1/2, 1/4 ms; what MuJoCo still errs by follows from the order, and is the limit."""
    drives, times, wrench = scenario
    paths = []
    for step in (1e-3, 5e-4, 2.5e-4):
        simulation = MujocoSimulation(example, curve, drives, times, "RK4", step, wrench)
        paths.append(simulation.motion(simulation.run()).pose)
    first, second = (np.abs(a - b).max() for a, b in itertools.pairwise(paths))
    assert np.log2(first / second) > order - 0.2
    robot = ElasticRobot(example, curve, tolerance=1e-11 if curve == "linear" else 1e-9)
    robot.reset(times[0], drives, Load(wrench[0]))
    ours = [robot.tcp()]
    for end, load in zip(times[1:], wrench[1:], strict=True):
        robot.step(end, drives, Load(load))
        ours.append(robot.tcp())
    left = second / (2.0**order - 1.0)
    assert left < {1.5: 1e-8, 4.0: 1e-10}[order]
    assert np.abs(ours - paths[-1]).max() < 1.5 * left


@pytest.mark.parametrize("curve", ["nobacklash", "backlash"])
def test_implicitfast_converges_to_the_reference_at_first_order(example, curve):
    """Halving the step halves the error against the reference, 1 s of the path."""
    expected = reference(f"d_iso_{curve}_10ms")[:101, 1:8]
    name = {"nobacklash": "linear", "backlash": "backlash"}[curve]
    drives, times, _ = iso_path(1.0)
    errors = []
    for step in (2.5e-4, 1.25e-4, 6.25e-5):
        simulation = MujocoSimulation(example, name, drives, times, "implicitfast", step)
        errors.append(np.abs(simulation.motion(simulation.run()).pose - expected).max())
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 1.0, atol=0.1)
    assert errors[-1] < 1e-6
