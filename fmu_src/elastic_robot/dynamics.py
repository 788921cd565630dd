"""Equation of motion of the elastic coordinates under prescribed drives.

    M(theta) theta'' + h(theta, theta') - J(theta)^T w + S(x) + d x' = 0        rows of x

M, h and J come from Pinocchio; S is a torque curve; w is the wrench on the robot at the TCP, with
the force K (a - p) of a spring there that follows the TCP's position p, and that of a contact.  h has
the balancers in it (`balancers.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from elastic_robot.chain import Chain
from elastic_robot.kinematics import tcp_force_gradient, tcp_jacobian, tcp_velocity_gradient
from elastic_robot.tool_load import ToolLoad


@dataclass(frozen=True)
class LoadDerivatives:
    """Derivatives of the loads M theta'' + h - J^T w in the rows of x, for k states at once.

    Attributes:
        angle: Derivative by theta [N m/rad], (k, m, angles).
        rate: Derivative by theta' [N m s/rad], (k, m, angles).
        acceleration: Derivative by theta'', the rows of x of the mass matrix [kg m^2],
            (k, m, angles).
        wrench: Derivative by the wrench [m, 1], (k, m, 6).
        anchor: Derivative by the spring's anchor [N], (k, m, 3).
        spring: Derivative by the spring's stiffness, xx xy xz yy yz zz [m^2], (k, m, 6).
        gravity: Derivative by gravity [kg m], (k, m, 3).
    """

    angle: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    wrench: np.ndarray
    anchor: np.ndarray
    spring: np.ndarray
    gravity: np.ndarray


class Dynamics:
    """Forces on the elastic coordinates of one chain.

    Args:
        chain: The robot's chain; its model is used, and its gravity written, by this object alone.
        gravity: Gravity [m/s^2] in base axes, (3,).
    """

    def __init__(self, chain: Chain, gravity: np.ndarray) -> None:
        self.chain = chain
        self.data = chain.model.createData()
        self._tcp = self.data.oMf[chain.tcp].translation  # which Pinocchio overwrites
        self._rows = np.ix_(chain.elastic, chain.elastic)
        self.gravity = gravity

    @property
    def gravity(self) -> np.ndarray:
        """Gravity [m/s^2] in base axes, (3,)."""
        return self.chain.model.gravity.linear.copy()

    @gravity.setter
    def gravity(self, value: np.ndarray) -> None:
        self.chain.model.gravity.linear = value

    def loads(
        self,
        theta: np.ndarray,
        rate: np.ndarray,
        acceleration: np.ndarray,
        acting: ToolLoad | None,
    ) -> np.ndarray:
        """Return M theta'' + h - J^T w in the rows of x [N m], (m,) or of k states (k, m).

        Args:
            theta, rate, acceleration: Motion of the chain [rad, rad/s, rad/s^2], (angles,) or
                (k, angles).
            acting: Loads on the tool in all states, or in each of them; None for nothing.
        """
        torque = self._inverse_dynamics(theta, rate, acceleration)
        if acting is not None and acting.acts:
            jacobian, position = self._tool(theta)
            total = acting.total(position)
            if acting.contact.holds:
                total += self._contact_wrench(jacobian, position, rate, acting)
            torque -= (total[..., None, :] @ jacobian)[..., 0, :]
        self.chain.balancers.relieve(torque, theta)
        return torque.take(self.chain.elastic, axis=-1)

    def load_derivatives(
        self, theta: np.ndarray, rate: np.ndarray, acceleration: np.ndarray, acting: ToolLoad
    ) -> LoadDerivatives:
        """Return the derivatives of `loads`; arguments in the same units, (k, angles).

        Those of M theta'' + h are Pinocchio's (Carpentier and Mansard 2018, docs/references.md);
        those of J^T w are `tcp_force_gradient`, and -J^T K J of the spring; that by gravity is
        -m J_c^T with the mass m and the Jacobian J_c of the centre of mass of the whole robot.
        """
        model, data, rows, count = self.chain.model, self.data, self.chain.elastic, len(theta)
        by_angle, by_rate, by_acceleration = np.empty((3, count, model.nv, model.nv))
        centre = np.empty((count, 3, model.nv))
        for k in range(count):
            by_angle[k], by_rate[k], by_acceleration[k] = pin.computeRNEADerivatives(
                model, data, theta[k], rate[k], acceleration[k]
            )
            centre[k] = pin.jacobianCenterOfMass(model, data, theta[k]).reshape(3, -1)
        self.chain.balancers.relieve_gradient(by_angle, theta)
        jacobian, position = self._tool(theta)
        lever = jacobian[:, :3].swapaxes(1, 2)
        of_anchor = -lever[:, rows] @ acting.stiffness
        if acting.is_sprung:
            total = acting.total(position)
            by_angle += lever @ acting.stiffness @ jacobian[:, :3]
            if acting.contact.holds:
                total += self._contact_wrench(jacobian, position, rate, acting)
                point = _point_jacobian(jacobian, acting.contact.offset)
                gap, velocity = _relative(point, position, rate, acting)
                by_place, by_velocity = acting.contact.force_gradient(gap, velocity)
                along = np.stack(
                    [
                        _point_jacobian(tcp_velocity_gradient(j, v), acting.contact.offset)
                        for j, v in zip(jacobian, rate, strict=True)
                    ]
                )
                onto = point.swapaxes(1, 2)
                of_contact = onto @ by_place
                by_angle -= of_contact @ point + onto @ by_velocity @ along
                by_rate -= onto @ by_velocity @ point
                of_anchor = of_anchor + of_contact[:, rows]
            by_angle -= tcp_force_gradient(jacobian, total)
        elif acting.wrench.any():
            by_angle -= tcp_force_gradient(jacobian, acting.wrench)
        return LoadDerivatives(
            angle=by_angle[:, rows],
            rate=by_rate[:, rows],
            acceleration=by_acceleration[:, rows],
            wrench=-jacobian[:, :, rows].swapaxes(1, 2),
            anchor=of_anchor,
            spring=-lever[:, rows] @ acting.force_by_stiffness(position),
            gravity=-data.mass[0] * centre[:, :, rows].swapaxes(1, 2),
        )

    def mass_matrix(self, theta: np.ndarray) -> np.ndarray:
        """Return M in the rows and columns of x [kg m^2], (m, m)."""
        return pin.crba(self.chain.model, self.data, theta)[self._rows]

    def support(self, theta: np.ndarray, acting: ToolLoad) -> np.ndarray:
        """Return J^T K J of spring and contact at rest, as x feels it [N m/rad], (m, m)."""
        jacobian, place = self._tool(theta)
        lever = jacobian[:3, self.chain.elastic]
        return lever.T @ acting.support(place) @ lever

    def contact_state(
        self, theta: np.ndarray, rate: np.ndarray, acting: ToolLoad
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the contact's depth [m], approach [m/s] and wrench at the TCP, (6,) or (k, 6)."""
        jacobian, position = self._tool(theta)
        point = _point_jacobian(jacobian, acting.contact.offset)
        gap, velocity = _relative(point, position, rate, acting)
        wrench = self._contact_wrench(jacobian, position, rate, acting)
        return acting.contact.depth(gap), acting.contact.approach(velocity), wrench

    def static_torque(self, theta: np.ndarray, acting: ToolLoad) -> np.ndarray:
        """Return the torque J^T w - g that the elastic coordinates must carry at rest [N m], (m,)."""
        load = pin.computeGeneralizedGravity(self.chain.model, self.data, theta)
        self.chain.balancers.relieve(load, theta)
        jacobian = tcp_jacobian(self.chain, self.data, theta)
        return (self._wrench(acting) @ jacobian - load)[self.chain.elastic]

    def static_torque_gradient(self, theta: np.ndarray, acting: ToolLoad) -> np.ndarray:
        """Return d(static_torque)/dx [N m/rad], (m, m)."""
        gravity_gradient = pin.computeGeneralizedGravityDerivatives(
            self.chain.model, self.data, theta
        )
        self.chain.balancers.relieve_gradient(gravity_gradient, theta)
        if not acting.acts:
            return -gravity_gradient[self._rows]
        jacobian = tcp_jacobian(self.chain, self.data, theta)
        gradient = (tcp_force_gradient(jacobian, self._wrench(acting)) - gravity_gradient)[
            self._rows
        ]
        return gradient - self.support(theta, acting) if acting.is_sprung else gradient

    def _inverse_dynamics(
        self, theta: np.ndarray, rate: np.ndarray, acceleration: np.ndarray
    ) -> np.ndarray:
        """Return M theta'' + h without balancers [N m], (angles,) or (k, angles)."""
        if theta.ndim == 1:
            return pin.rnea(self.chain.model, self.data, theta, rate, acceleration)
        torque = np.empty_like(theta)
        for k in range(len(theta)):
            torque[k] = self._inverse_dynamics(theta[k], rate[k], acceleration[k])
        return torque

    def _tool(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return Jacobian and position of the TCP, (6, angles) and (3,), or of k states.

        The next call overwrites the position of one state.
        """
        if theta.ndim == 1:
            return tcp_jacobian(self.chain, self.data, theta), self._tcp
        jacobian, position = np.empty((len(theta), 6, theta.shape[1])), np.empty((len(theta), 3))
        for k, angles in enumerate(theta):
            jacobian[k], position[k] = self._tool(angles)
        return jacobian, position

    def _contact_wrench(
        self, jacobian: np.ndarray, position: np.ndarray, rate: np.ndarray, acting: ToolLoad
    ) -> np.ndarray:
        """Return the contact's wrench at the TCP [N, N m], (6,) or (k, 6)."""
        offset = acting.contact.offset
        gap, velocity = _relative(_point_jacobian(jacobian, offset), position, rate, acting)
        force = acting.contact.force(gap, velocity)
        return np.concatenate([force, force @ pin.skew(offset).T], axis=-1)

    def _wrench(self, acting: ToolLoad) -> np.ndarray:
        """Return the wrench with the forces at rest at the angles of the last Jacobian, (6,)."""
        return acting.at_rest(self._tcp)


def _point_jacobian(jacobian: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """Return the translational Jacobian of a point at an offset from the TCP, (..., 3, angles)."""
    return jacobian[..., :3, :] - pin.skew(offset) @ jacobian[..., 3:, :]


def _relative(
    point: np.ndarray, position: np.ndarray, rate: np.ndarray, acting: ToolLoad
) -> tuple[np.ndarray, np.ndarray]:
    """Return the way from the TCP to the anchor and the lowest point's velocity over the plane."""
    return acting.anchor - position, (point @ rate[..., None])[..., 0] - acting.velocity
