"""How far a robot of this project is from the same in MuJoCo: mechanics in random states, and rest."""

import numpy as np
import pinocchio as pin

from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.kinematics import base_from_tool, tcp_jacobian
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand
from examples.mujoco_robot import INTEGRATORS, ElasticModel, MujocoRobot
from examples.mujoco_robot.rest import settle


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


def both_at_rest(
    robot: Robot, curve: str, q: np.ndarray, wrench: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the elastic coordinates at rest [rad], ours and MuJoCo's.

    Args:
        robot: Description.
        curve: Torque curve's name.
        q: Drive angles [rad], (n,).
        wrench: On the tool [N, N m], (6,).
    """
    model = ElasticModel(robot, curve, INTEGRATORS["RK4"], 1e-3, range(6))
    ours = ElasticRobot(robot, curve, quasistatic=True)
    ours.reset(0.0, HeldCommand(0.0, q, np.zeros(len(q)), np.zeros(len(q))), Load(wrench))
    return ours.deflection(), settle(model, q, wrench)
