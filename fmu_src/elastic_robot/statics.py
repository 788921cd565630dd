"""Static equilibrium of the elastic coordinates and the static compliance of the TCP."""

from __future__ import annotations

import numpy as np

from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import EquilibriumError
from elastic_robot.kinematics import tcp_jacobian
from elastic_robot.torque_curves import TorqueCurve

# Below this torque [N m] a gear with play counts as unloaded and rests in the middle of its gap.
# Rounding of the gravity torque of a heavy robot is 1e-12 N m, the smallest real load far larger.
NEUTRAL_TORQUE = 1e-6
# Newton ends when no coordinate moves by more [rad]; at 3 m reach that is 3e-14 m at the TCP.
_STEP_TOLERANCE = 1e-14
_MAX_ITERATIONS = 60


def equilibrium(
    dynamics: Dynamics, curve: TorqueCurve, q: np.ndarray, wrench: np.ndarray
) -> np.ndarray:
    """Return the elastic coordinates at rest: S(x) = J^T w - g.

    Newton's method, started at the deflection under the load of the undeflected robot, so that the
    result does not depend on history.  A gear with play rests on the flank that its load pushes it
    to; loaded by less than NEUTRAL_TORQUE in the middle of its gap it stays there; where the load
    changes sign inside the gap (the robot hangs in its play) it rests at that place.

    Args:
        dynamics: Forces of the robot.
        curve: Torque curve S.
        q: Drive angles [rad], (n,).
        wrench: On the robot at the TCP, base axes, (6,).

    Returns:
        x [rad], (m,).

    Raises:
        EquilibriumError: If Newton's method finds none, because the robot buckles under the load.
    """
    chain = dynamics.chain
    half_width = np.where(np.isfinite(curve.half_width), curve.half_width, 0.0)
    x = np.zeros(chain.elastic_count)
    if chain.elastic_count == 0:
        return x
    torque = dynamics.static_torque(chain.theta(q, x), wrench)
    neutral = (half_width > 0.0) & (np.abs(torque) < NEUTRAL_TORQUE)
    hanging = np.zeros_like(neutral)  # rests inside its play, held there by the load itself
    x = np.where(neutral, 0.0, curve.deflection(torque))
    for _ in range(_MAX_ITERATIONS):
        theta = chain.theta(q, x)
        torque = dynamics.static_torque(theta, wrench)
        matrix = -dynamics.static_torque_gradient(theta, wrench)
        matrix[np.diag_indices_from(matrix)] += np.where(hanging, 0.0, curve.slope(x))
        residual = torque - np.where(hanging, 0.0, curve.torque(x))
        matrix[neutral] = np.eye(len(x))[neutral]
        residual[neutral] = 0.0
        try:
            step = np.linalg.solve(matrix, residual)
        except np.linalg.LinAlgError:
            break
        new = x + step
        if not np.all(np.isfinite(new)) or np.max(np.abs(new)) > np.pi:
            break
        # A gear that was on a flank and is pulled off it either hangs in the gap or, if the load
        # still points the old way there, comes back to the flank.
        leaving = ~neutral & ~hanging & (half_width > 0.0) & (np.sign(x) * new < half_width)
        hanging |= leaving
        torque_there = dynamics.static_torque(chain.theta(q, new), wrench)
        slipping = hanging & (np.abs(new) > half_width)
        hanging &= ~slipping
        new = np.where(slipping, curve.deflection(torque_there), new)
        moved = np.max(np.abs(new - x))
        x = new
        if moved < _STEP_TOLERANCE and not np.any(leaving | slipping):
            return x
    raise EquilibriumError(
        f"no static equilibrium found at q = {np.round(q, 4).tolist()} rad under the wrench"
        f" {np.round(wrench, 3).tolist()} N, N m; the joints are too soft for this load"
    )


def tcp_compliance(
    dynamics: Dynamics, curve: TorqueCurve, q: np.ndarray, x: np.ndarray, wrench: np.ndarray
) -> np.ndarray:
    """Return the static translational compliance d(TCP position)/d(force) [m/N], (3, 3).

    J (diag(S') - d(J^T w - g)/dx)^-1 J^T at the present state.  A gear inside its play counts with
    the stiffness of its flank: the gap is a jump, not a compliance.
    """
    theta = dynamics.chain.theta(q, x)
    matrix = -dynamics.static_torque_gradient(theta, wrench)
    matrix[np.diag_indices_from(matrix)] += curve.flank_slope(x)
    jacobian = tcp_jacobian(dynamics.chain, dynamics.data, theta)[:3, dynamics.chain.elastic]
    if jacobian.shape[1] == 0:
        return np.zeros((3, 3))
    return jacobian @ np.linalg.solve(matrix, jacobian.T)
