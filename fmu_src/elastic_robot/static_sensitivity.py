"""Derivatives of the static equilibrium by the load on the tool, the drives and every parameter.

The equilibrium satisfies F(x; w, q, p) = S(x; p) + H + g(theta) - J(theta)^T w = 0.  By the implicit
function theorem dx/dy = -K^-1 dF/dy with K = dF/dx, for y the wrench w, anchor and stiffness of the
spring at the TCP, the drives q or a parameter p (docs/derivatives.md).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from elastic_robot.dynamics import Dynamics
from elastic_robot.hysteresis import NO_HYSTERESIS, HeldHysteresis
from elastic_robot.kinematics import tcp_jacobian
from elastic_robot.parameter_names import ByParameter
from elastic_robot.residual import OperatingPoint, residual_derivatives
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import TorqueCurve


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives of one quantity of the equilibrium with r entries.

    Attributes:
        wrench: Derivative by the wrench [1/N, 1/(N m)], (r, 6).
        anchor: Derivative by the position of the spring's anchor [1/m], (r, 3).
        spring: Derivative by its stiffness, entries xx xy xz yy yz zz [m/N], (r, 6).
        drives: Derivative by the drives at their gears' outputs, or after `by_motors` by the motors
            [1/rad], (r, n).
        parameters: Derivative by each parameter [1 per its unit], (r, p).
    """

    wrench: np.ndarray
    anchor: np.ndarray
    spring: np.ndarray
    drives: np.ndarray
    parameters: ByParameter

    def by_motors(self, slope: np.ndarray) -> Sensitivity:
        """Return it by the motors, with `KinematicErrors.slope` [1], (n,)."""
        return replace(self, drives=self.drives * slope)


@dataclass(frozen=True)
class StaticSensitivities:
    """Derivatives of the equilibrium and of the TCP's pose there.

    Attributes:
        x: Derivatives of the elastic coordinates [rad], r = m.
        tcp: Derivatives of the TCP: displacement [m], then small rotation [rad], base axes, r = 6.
            `tcp.wrench` is the static compliance: [m/N, m/(N m)] over [rad/N, rad/(N m)], on the
            spring at the TCP where there is one.
    """

    x: Sensitivity
    tcp: Sensitivity

    def by_motors(self, slope: np.ndarray) -> StaticSensitivities:
        """Return them by the motors, with `KinematicErrors.slope` [1], (n,)."""
        return StaticSensitivities(self.x.by_motors(slope), self.tcp.by_motors(slope))


def static_sensitivities(
    dynamics: Dynamics,
    curve: TorqueCurve,
    q: np.ndarray,
    x: np.ndarray,
    acting: ToolLoad,
    hysteresis: HeldHysteresis = NO_HYSTERESIS,
) -> StaticSensitivities:
    """Return the derivatives of the equilibrium at the present state.

    A gear inside its backlash counts with the stiffness of its flank: the backlash is a jump, not a
    compliance.  Elements of hysteresis stick or slip as they do in this state.

    Args:
        dynamics: Forces of the robot.
        curve: Torque curve S.
        q: Drive angles at the gears' outputs [rad], (n,).
        x: Elastic coordinates at rest [rad], (m,).
        acting: Loads on the tool.
        hysteresis: What the elements of the gears add.
    """
    chain, none = dynamics.chain, np.zeros((2, len(x)))
    drives = np.stack([q, 0.0 * q, 0.0 * q])
    point = OperatingPoint(
        drives, np.stack([x, *none]), acting.resting, curve.region(x), hysteresis
    )
    by = residual_derivatives(dynamics, curve, none[0], point)
    forces = [by.wrench, by.anchor, by.spring, by.drive, by.parameters.values]
    stiffness = -dynamics.static_torque_gradient(chain.theta(q, x), acting)
    stiffness[np.diag_indices_from(stiffness)] += curve.flank_slope(x) + hysteresis.slope
    by_force = -np.linalg.solve(stiffness, np.hstack(forces))
    parts = np.split(by_force, np.cumsum([matrix.shape[1] for matrix in forces[:-1]]), axis=1)
    jacobian = tcp_jacobian(chain, dynamics.data, chain.theta(q, x))
    of_tcp = [jacobian[:, chain.elastic] @ part for part in parts]
    of_tcp[3] += jacobian[:, chain.drive]

    def sensitivity(wrench: np.ndarray, *others: np.ndarray) -> Sensitivity:
        anchor, spring, drives, values = others
        by_parameters = ByParameter(by.parameters.names, values)
        return Sensitivity(wrench, anchor, spring, drives, by_parameters)

    return StaticSensitivities(sensitivity(*parts), sensitivity(*of_tcp))
