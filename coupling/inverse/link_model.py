"""Conditions on the motion of the links at an instant: tool on the path, tilts in balance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.native.desk_robot import DeskRobot
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters


@dataclass(frozen=True)
class LinkState:
    """Robot at several instants.

    Attributes:
        load: M theta'' + h - J^T w less the balancers' torques, that all angles of the chain need [N m],
            (k, angles).
        position, rotation: Pose of the TCP, base frame [m], (k, 3) and (k, 3, 3).
    """

    load: np.ndarray
    position: np.ndarray
    rotation: np.ndarray


@dataclass(frozen=True)
class LinkDerivatives:
    """Derivatives of a `LinkState`.

    Attributes:
        load: Derivatives of the loads by theta, theta', theta'' [N m/rad, ..], (k, 3, angles, angles).
        jacobian: Jacobian of the TCP, base axes [m/rad, rad/rad], (k, 6, angles).
    """

    load: np.ndarray
    jacobian: np.ndarray


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

    def state(
        self, theta: np.ndarray, rate: np.ndarray, acceleration: np.ndarray, wrench: np.ndarray
    ) -> LinkState:
        """Return loads and poses; motion [rad, rad/s, rad/s^2], (k, angles), wrench [N, N m], (k, 6)."""
        placement = self.placement(theta)
        return LinkState(self.load(theta, rate, acceleration, wrench), *placement)

    def placement(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return position [m] and rotation of the TCP, (k, 3) and (k, 3, 3)."""
        return self.desk.placements(theta)

    def load(
        self, theta: np.ndarray, rate: np.ndarray, acceleration: np.ndarray, wrench: np.ndarray
    ) -> np.ndarray:
        """Return M theta'' + h - J^T w, balancers taken off [N m], (k, angles); arguments as `state`."""
        return self.desk.loads(theta, rate, acceleration, wrench)

    def linearised(
        self, theta: np.ndarray, rate: np.ndarray, acceleration: np.ndarray, wrench: np.ndarray
    ) -> tuple[LinkState, LinkDerivatives]:
        """Return `state` and its derivatives; arguments in the same units, (k, angles), (k, 6)."""
        load, by, jacobian, position, rotation = self.desk.linearised(
            theta, rate, acceleration, wrench
        )
        return LinkState(load, position, rotation), LinkDerivatives(by, jacobian)
