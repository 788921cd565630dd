"""Robot as its links move: angles behind the gears, and tilts."""

from __future__ import annotations

import numpy as np

from coupling.native.desk_robot import DeskRobot
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters


class LinkModel:
    """Motion of the links: angles behind the gears, phi = q + e, and tilts.

    The drives do not appear in the equation of motion of the tilts, so backlash does not either.

    Args:
        robot: The robot.

    Attributes:
        chain: Its chain.
        parameters: Its numbers.
        tilts: Index in theta of every tilt, (t,).
        gears: Index in theta of every elastic joint, (g,).
        gear_joint: Number of the joint of every gear, from 0, (g,).
        tilt_stiffness, tilt_damping: Stiffness and damping of every tilt [N m/rad], [N m s/rad], (t,).
        desk: The chain in C.

    Raises:
        RobotFileError: If it has more joints than the desk library holds.
    """

    def __init__(self, robot: Robot) -> None:
        self.chain = build_chain(robot)
        self.parameters = Parameters.of(robot)
        self.desk = DeskRobot(robot)
        self._is_tilt = is_tilt = self.chain.elastic_tilt > 0
        self.tilts = self.chain.elastic[is_tilt]
        self.gears = self.chain.elastic[~is_tilt]
        self.gear_joint = self.chain.elastic_joint[~is_tilt]
        self.tilt_stiffness = self.parameters.stiffness[is_tilt]
        self.tilt_damping = self.parameters.damping[is_tilt]
        arms = [np.linalg.norm(joint.origin) for joint in robot.joints]
        self.reach = float(np.sum(arms) + np.linalg.norm(robot.tcp_position))

    @property
    def size(self) -> int:
        """Number of angles of the chain."""
        return int(self.chain.model.nv)

    def tilt_inertia(self, q: np.ndarray) -> np.ndarray:
        """Return the inertia of every tilt at drive angles (joints,) [kg m^2], (t,)."""
        (mass,) = self.desk.masses(self.chain.theta(q)[None])
        inertia: np.ndarray = mass.diagonal()[self._is_tilt]
        return inertia

    def yielding_inertia(self, theta: np.ndarray) -> np.ndarray:
        """Return the inertia of every gear while all other elastic angles yield [kg m^2], (k, gears).

        1 / (M^-1)_gg of the mass matrix in the elastic coordinates.

        Args:
            theta: Angles of the chain [rad], (k, angles).
        """
        gears = self.chain.torsions
        inertia: np.ndarray = 1.0 / np.linalg.inv(self.desk.masses(theta))[:, gears, gears]
        return inertia
