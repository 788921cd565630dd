"""Conditions on the motion of the links at an instant: tool on the path, tilts in balance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.kinematics import base_from_tool, tcp_force_gradient, tcp_jacobian
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
    """

    def __init__(self, robot: Robot) -> None:
        self.chain = build_chain(robot)
        self.parameters = Parameters.of(robot)
        self._data = self.chain.model.createData()
        is_tilt = self.chain.elastic_tilt > 0
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
        mass = pin.crba(self.chain.model, self._data, self.chain.theta(q))
        return mass.diagonal()[self.tilts].copy()

    def yielding_inertia(self, theta: np.ndarray) -> np.ndarray:
        """Return the inertia of every gear while all other elastic angles yield [kg m^2], (k, gears).

        1 / (M^-1)_gg of the mass matrix in the elastic coordinates.

        Args:
            theta: Angles of the chain [rad], (k, angles).
        """
        elastic, gears = self.chain.elastic, self.chain.torsions
        mass = np.empty((len(theta), len(elastic), len(elastic)))
        for k, angles in enumerate(theta):
            mass[k] = pin.crba(self.chain.model, self._data, angles)[np.ix_(elastic, elastic)]
        inertia: np.ndarray = 1.0 / np.linalg.inv(mass)[:, gears, gears]
        return inertia

    def state(
        self, theta: np.ndarray, rate: np.ndarray, acceleration: np.ndarray, wrench: np.ndarray
    ) -> LinkState:
        """Return loads and poses; motion [rad, rad/s, rad/s^2], (k, angles), wrench [N, N m], (k, 6)."""
        placement = self.placement(theta)
        return LinkState(self.load(theta, rate, acceleration, wrench), *placement)

    def placement(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return position [m] and rotation of the TCP, (k, 3) and (k, 3, 3)."""
        chain, data = self.chain, self._data
        position, rotation = np.empty((len(theta), 3)), np.empty((len(theta), 3, 3))
        for k, angles in enumerate(theta):
            placement = base_from_tool(chain, data, angles)
            position[k], rotation[k] = placement.translation, placement.rotation
        return position, rotation

    def load(
        self, theta: np.ndarray, rate: np.ndarray, acceleration: np.ndarray, wrench: np.ndarray
    ) -> np.ndarray:
        """Return M theta'' + h - J^T w, balancers taken off [N m], (k, angles); arguments as `state`."""
        model, data, rnea = self.chain.model, self._data, pin.rnea
        load = np.empty_like(theta)
        for k in range(len(theta)):
            load[k] = rnea(model, data, theta[k], rate[k], acceleration[k])
        for k in np.flatnonzero(wrench.any(axis=1)).tolist():
            load[k] -= wrench[k] @ tcp_jacobian(self.chain, data, theta[k])
        self.chain.balancers.relieve(load, theta)
        return load

    def linearised(
        self, theta: np.ndarray, rate: np.ndarray, acceleration: np.ndarray, wrench: np.ndarray
    ) -> tuple[LinkState, LinkDerivatives]:
        """Return `state` and its derivatives; arguments in the same units, (k, angles), (k, 6)."""
        model, data, count, size = self.chain.model, self._data, len(theta), self.size
        by = np.empty((count, 3, size, size))
        load, columns = np.empty((count, size)), np.empty((count, size, 6))
        position, rotation = np.empty((count, 3)), np.empty((count, 3, 3))
        for k in range(count):
            by[k, 0], by[k, 1], by[k, 2] = pin.computeRNEADerivatives(
                model, data, theta[k], rate[k], acceleration[k]
            )
            load[k] = data.tau
            # On the way it has placed all joints, and found their velocities at the base's origin.
            columns[k] = data.J.T
            placement = pin.updateFramePlacement(model, data, self.chain.tcp)
            position[k], rotation[k] = placement.translation, placement.rotation
        jacobian = np.ascontiguousarray(columns.swapaxes(1, 2))
        jacobian[:, :3] += np.cross(jacobian[:, 3:], position[:, :, None], axis=1)
        load -= (wrench[:, None] @ jacobian)[:, 0]
        loaded = wrench.any(axis=1)
        by[loaded, 0] -= tcp_force_gradient(jacobian[loaded], wrench[loaded])
        self.chain.balancers.relieve(load, theta)
        self.chain.balancers.relieve_gradient(by[:, 0], theta)
        return LinkState(load, position, rotation), LinkDerivatives(by, jacobian)
