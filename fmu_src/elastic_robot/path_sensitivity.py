"""How a path follows the parameters: forward sensitivities through the time stepper.

Differentiating the collocation equations of a solved step at its stages i gives, for one parameter p,

    M_i da_i + K_i dX_i + D_i dV_i + dr_i/dp = 0,    dX_i = dx_0 + c_i h dv_0 + h^2 sum_j A2_ij da_j,
                                                     dV_i = dv_0 + h sum_j A1_ij da_j,

linear in the da_i, with the exact Jacobians of the residual.  The result is the derivative of the
numerical solution with its steps held.  Where a gear changes flank the torque is continuous, so that
the sensitivities are continuous too and need no correction there (docs/derivatives.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic_robot import gauss
from elastic_robot.collocation import State, Step
from elastic_robot.dynamics import Dynamics
from elastic_robot.motion import Drives
from elastic_robot.parameter_names import ByParameter, parameter_names
from elastic_robot.residual import OperatingPoint, residual_derivatives
from elastic_robot.tool_load import Acting, Load
from elastic_robot.torque_curves import TorqueCurve


@dataclass(frozen=True)
class PathSensitivity:
    """Derivatives of a path with respect to every parameter.

    Attributes:
        time: Times [s], (k,).
        tcp: Derivatives of the TCP: displacement [m], then small rotation [rad], base axes, (k, 6, p).
        x: Derivatives of the elastic coordinates [rad], (k, m, p).
    """

    time: np.ndarray
    tcp: ByParameter
    x: ByParameter


class ForwardSensitivity:
    """Derivatives of x and x' with respect to every parameter, carried from step to step.

    Args:
        dynamics: Forces of the robot.
        curve: Torque curve S.
        damping: d [N m s/rad], (m,).
        x: Derivatives of x at the start, (m, p); x' starts at zero whatever the parameters.
    """

    def __init__(
        self, dynamics: Dynamics, curve: TorqueCurve, damping: np.ndarray, x: np.ndarray
    ) -> None:
        self._dynamics = dynamics
        self._curve = curve
        self._damping = damping
        self.x = x
        self.rate = np.zeros_like(x)

    def follow(self, start: State, step: Step, drives: Drives, load: Load, since: float) -> None:
        """Carry the derivatives over a solved step.

        Args:
            start: State at its start.
            step: The step.
            drives: Motion of the drives.
            load: What acts on the tool.
            since: Start of the communication step that the load is held over [s].
        """
        h, (s, m) = step.length, (gauss.STAGES, len(self.x))
        a = step.rows[2:]
        motion = np.stack(
            [
                start.x + h * gauss.NODES[:, None] * start.v + h * h * gauss.A2 @ a,
                start.v + h * gauss.A1 @ a,
                a,
            ]
        )
        times = start.time + h * gauss.NODES
        acting = load.at(times - since)
        point = OperatingPoint(drives.at(times), motion, acting, start.region)
        by = residual_derivatives(self._dynamics, self._curve, self._damping, point)
        matrix = np.einsum("ij,iab->iajb", h * h * gauss.A2, by.x)
        matrix += np.einsum("ij,iab->iajb", h * gauss.A1, by.rate)
        stage = np.arange(s)
        matrix[stage, :, stage, :] += by.acceleration
        free = self.x + h * gauss.NODES[:, None, None] * self.rate
        right = by.parameters.values + by.x @ free + by.rate @ self.rate
        solved = np.linalg.solve(matrix.reshape(s * m, s * m), -right.reshape(s * m, -1))
        by_acceleration = solved.reshape(s, m, -1)
        self.x = self.x + h * self.rate + h * h * np.tensordot(gauss.B2, by_acceleration, 1)
        self.rate = self.rate + h * np.tensordot(gauss.B1, by_acceleration, 1)


def equilibrium_sensitivity(
    dynamics: Dynamics, curve: TorqueCurve, q: np.ndarray, x: np.ndarray, acting: Acting
) -> np.ndarray:
    """Return the derivatives of an equilibrium with respect to every parameter, (m, p).

    Each coordinate stays on its branch; a gear that carries no torque stays in the middle of its play.
    The arguments are those of `static_sensitivities`.
    """
    region = curve.region(x)
    drives = np.stack([q, np.zeros_like(q), np.zeros_like(q)])
    motion = np.stack([x, np.zeros_like(x), np.zeros_like(x)])
    point = OperatingPoint(drives, motion, acting, region)
    by = residual_derivatives(dynamics, curve, np.zeros_like(x), point)
    moving = np.flatnonzero((region != 0) | (x != 0.0))
    derivative = np.zeros((len(x), len(parameter_names(dynamics.chain))))
    stiffness = by.x[np.ix_(moving, moving)]
    derivative[moving] = -np.linalg.solve(stiffness, by.parameters.values[moving])
    return derivative
