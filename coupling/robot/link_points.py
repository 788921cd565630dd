"""A robot as simple links, to draw it."""

from __future__ import annotations

import numpy as np

from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.kinematics import base_from_tool


def link_points(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return base, centres of the joints and TCP of the undeflected robot, base frame [m].

    Args:
        q: Drive angles [rad], (joints,).

    Example:
        >>> from coupling.files.robot_file import find_robot, load_robot
        >>> robot = load_robot(find_robot("icme2008"))
        >>> link_points(robot, np.zeros(6)).shape
        (8, 3)
    """
    chain = build_chain(robot)
    data = chain.model.createData()
    tip = base_from_tool(chain, data, chain.theta(q)).translation
    # Angle k of the chain is that of Pinocchio's joint k + 1; joint 0 is the world.
    centres = [data.oMi[int(angle) + 1].translation for angle in chain.drive]
    return np.array([np.zeros(3), *centres, tip])
