"""Equation of motion of the elastic coordinates under prescribed drives.

    M(theta) theta'' + h(theta, theta') - J(theta)^T w + S(x) + d x' = 0        rows of x

M, h and J come from Pinocchio; S is a torque curve; w is the wrench on the robot at the TCP.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from elastic_robot.chain import Chain
from elastic_robot.kinematics import tcp_force_gradient, tcp_jacobian


@dataclass(frozen=True)
class LoadDerivatives:
    """Derivatives of the loads M theta'' + h - J^T w in the rows of x, for k states at once.

    Attributes:
        angle: Derivative by theta [N m/rad], (k, m, angles).
        rate: Derivative by theta' [N m s/rad], (k, m, angles).
        acceleration: Derivative by theta'', the rows of x of the mass matrix [kg m^2],
            (k, m, angles).
        wrench: Derivative by the wrench [m, 1], (k, m, 6).
        gravity: Derivative by gravity [kg m], (k, m, 3).
    """

    angle: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    wrench: np.ndarray
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
        wrench: np.ndarray | None,
    ) -> np.ndarray:
        """Return M theta'' + h - J^T w in the rows of x [N m], (k, m), for k states at once.

        Args:
            theta, rate, acceleration: Angles of the chain and their derivatives, (k, angles).
            wrench: Wrench on the robot at the TCP, (6,); None for none.
        """
        model, data, rnea = self.chain.model, self.data, pin.rnea
        torque = np.empty_like(theta)
        for k in range(len(theta)):
            torque[k] = rnea(model, data, theta[k], rate[k], acceleration[k])
            if wrench is not None:
                torque[k] -= wrench @ tcp_jacobian(self.chain, data, theta[k])
        return torque.take(self.chain.elastic, axis=1)

    def load_derivatives(
        self, theta: np.ndarray, rate: np.ndarray, acceleration: np.ndarray, wrench: np.ndarray
    ) -> LoadDerivatives:
        """Return the derivatives of `loads`; the arguments are the same.

        Those of M theta'' + h are Pinocchio's (Carpentier and Mansard 2018, docs/references.md);
        those of J^T w are `tcp_force_gradient`; that by gravity is -m J_c^T with the mass m and the
        Jacobian J_c of the centre of mass of the whole robot.
        """
        model, data, rows, count = self.chain.model, self.data, self.chain.elastic, len(theta)
        by_angle, by_rate, by_acceleration = np.empty((3, count, model.nv, model.nv))
        jacobian, centre = np.empty((count, 6, model.nv)), np.empty((count, 3, model.nv))
        for k in range(count):
            by_angle[k], by_rate[k], by_acceleration[k] = pin.computeRNEADerivatives(
                model, data, theta[k], rate[k], acceleration[k]
            )
            jacobian[k] = tcp_jacobian(self.chain, data, theta[k])
            centre[k] = pin.jacobianCenterOfMass(model, data, theta[k]).reshape(3, -1)
        if wrench.any():
            by_angle -= tcp_force_gradient(jacobian, wrench)
        return LoadDerivatives(
            angle=by_angle[:, rows],
            rate=by_rate[:, rows],
            acceleration=by_acceleration[:, rows],
            wrench=-jacobian[:, :, rows].swapaxes(1, 2),
            gravity=-data.mass[0] * centre[:, :, rows].swapaxes(1, 2),
        )

    def mass_matrix(self, theta: np.ndarray) -> np.ndarray:
        """Return M in the rows and columns of x [kg m^2], (m, m)."""
        return pin.crba(self.chain.model, self.data, theta)[self._rows]

    def static_torque(self, theta: np.ndarray, wrench: np.ndarray) -> np.ndarray:
        """Return the torque J^T w - g that the elastic coordinates must carry at rest [N m], (m,)."""
        gravity = pin.computeGeneralizedGravity(self.chain.model, self.data, theta)
        jacobian = tcp_jacobian(self.chain, self.data, theta)
        return (wrench @ jacobian - gravity)[self.chain.elastic]

    def static_torque_gradient(self, theta: np.ndarray, wrench: np.ndarray) -> np.ndarray:
        """Return d(static_torque)/dx [N m/rad], (m, m)."""
        of_gravity = pin.computeGeneralizedGravityDerivatives(self.chain.model, self.data, theta)
        if not wrench.any():
            return -of_gravity[self._rows]
        jacobian = tcp_jacobian(self.chain, self.data, theta)
        return (tcp_force_gradient(jacobian, wrench) - of_gravity)[self._rows]
