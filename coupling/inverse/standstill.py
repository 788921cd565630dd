"""The robot standing with its tool on a pose: where a motion from rest begins, to rounding."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.inverse.link_model import LinkModel

# Newton's method from the rigid robot's angles: each iteration contracts by the tilts' share of the sag.
_ITERATIONS, _SETTLED = 30, 1e-15


def equilibrium_angles(
    model: LinkModel, q: np.ndarray, position: np.ndarray, rotation: Rotation, wrench: np.ndarray
) -> np.ndarray:
    """Return the angles of the chain with the tool on a pose and the tilts in balance, (angles,).

    Args:
        model: The robot.
        q: Angles of the rigid robot that has its tool there [rad], (joints,).
        position: Position of the TCP [m], (3,).
        rotation: base_from_tool.
        wrench: Wrench on the robot at the TCP, base axes [N, N m], (6,).
    """
    theta = model.chain.theta(q[None])
    rest, load = np.zeros_like(theta), wrench[None]
    for _ in range(_ITERATIONS):
        state, by = model.linearised(theta, rest, rest, load)
        turn = (Rotation.from_matrix(state.rotation[0]) * rotation.inv()).as_rotvec()
        missed = np.concatenate([state.position[0] - position, turn])
        step = np.zeros(model.size)
        step[model.tilts] = -state.load[0, model.tilts] / model.tilt_stiffness
        step[model.tilts] -= theta[0, model.tilts]
        missed += by.jacobian[0] @ step
        drives = by.jacobian[0][:, model.chain.drive]
        step[model.chain.drive] = -np.linalg.lstsq(drives, missed, rcond=None)[0]
        theta[0] += step
        if np.abs(step).max() < _SETTLED:
            break
    return theta[0]
