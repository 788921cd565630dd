"""The chain against MuJoCo: mass matrix, bias forces, forward kinematics and Jacobian, to 1e-10."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from random_robots import make_robot

from elastic_robot.chain import build_chain
from elastic_robot.description import Body, Robot
from elastic_robot.kinematics import base_from_tool, tcp_jacobian

pytest.importorskip("mujoco", reason="needs the package mujoco, which is in the extra 'test'")
from mujoco_robot import MujocoRobot


def largest_differences(robot: Robot, states: int, seed: int) -> np.ndarray:
    """Return relative differences of M, bias, TCP position, TCP rotation and Jacobian."""
    chain, other = build_chain(robot), MujocoRobot(robot)
    model, data = chain.model, chain.model.createData()
    rng = np.random.default_rng(seed)
    worst = np.zeros(5)
    for _ in range(states):
        theta, rate = rng.uniform(-3, 3, model.nv), rng.uniform(-2, 2, model.nv)
        other.set(theta, rate)
        mass = pin.crba(model, data, theta).reshape(model.nv, model.nv)
        mass = np.triu(mass) + np.triu(mass, 1).T
        bias = pin.nonLinearEffects(model, data, theta, rate)
        jacobian = tcp_jacobian(chain, data, theta)
        tcp = base_from_tool(chain, data, theta)
        position, rotation = other.tcp()
        pairs = [
            (mass, other.mass_matrix()),
            (bias, other.bias()),
            (tcp.translation, position),
            (tcp.rotation, rotation),
            (jacobian, other.jacobian()),
        ]
        differences = [np.abs(a - b).max() / np.abs(b).max() for a, b in pairs]
        worst = np.maximum(worst, differences)
    return worst


def test_example_robot_over_a_thousand_states(example):
    assert largest_differences(example, 1000, seed=1).max() < 1e-10


@pytest.mark.parametrize("seed", range(50))
def test_random_robots(seed):
    assert largest_differences(make_robot(seed, 3 + seed % 6), 20, seed).max() < 1e-10


def test_payload_counts_in_both(example):
    loaded = replace(example, payload=Body(50.0, (0.4, 0.1, 0.0), (1.0, 2.0, 2.5)))
    assert largest_differences(loaded, 50, seed=2).max() < 1e-10
    # The comparison sees the payload at all.
    chain, other = build_chain(example), MujocoRobot(loaded)
    theta = np.full(chain.model.nv, 0.3)
    other.set(theta, 0.0 * theta)
    light = pin.crba(chain.model, chain.model.createData(), theta)
    assert abs(light[0, 0] - other.mass_matrix()[0, 0]) > 1.0
