"""A robot of one joint with closed forms, drives that stand, and what statics needs of any robot."""

import numpy as np

from elastic_robot.body import Body
from elastic_robot.chain import build_chain
from elastic_robot.description import Joint, Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.parameters import Parameters
from elastic_robot.trajectory import HeldCommand


def dynamics_of(robot: Robot) -> tuple[Dynamics, Parameters]:
    parameters = Parameters.of(robot)
    return Dynamics(build_chain(robot), parameters.gravity), parameters


def held(q) -> HeldCommand:
    q = np.asarray(q, dtype=float)
    return HeldCommand(0.0, q, np.zeros_like(q), np.zeros_like(q))


def pendulum(gravity=(0.0, 0.0, -9.81), **joint) -> Robot:
    """Return a 1 m arm about the y axis with 50 kg at its end, stiffness 1e4 N m/rad."""
    link = Body(mass=50.0, com=(1.0, 0.0, 0.0), inertia=(0.0, 0.0, 0.0))
    values = {"stiffness": 1e4, **joint}
    return Robot(
        "pendulum",
        (Joint((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), link, **values),),
        gravity=gravity,
        tcp_position=(1.0, 0.0, 0.0),
    )
