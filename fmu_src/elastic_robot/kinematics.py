"""Pose, velocity and Jacobian of the TCP; with x left out these are the rigid robot's."""

from __future__ import annotations

import functools

import numpy as np
import pinocchio as pin

from elastic_robot.chain import Chain


def base_from_tool(chain: Chain, data: pin.Data, theta: np.ndarray) -> pin.SE3:
    """Return the TCP's placement [m] at theta [rad], (angles,); the next call overwrites it."""
    pin.forwardKinematics(chain.model, data, theta)
    return pin.updateFramePlacement(chain.model, data, chain.tcp)


def tcp_jacobian(chain: Chain, data: pin.Data, theta: np.ndarray) -> np.ndarray:
    """Return d(TCP velocity, angular velocity)/d(theta'), base axes [m/rad, 1], (6, angles)."""
    jacobian = pin.computeFrameJacobian(
        chain.model, data, theta, chain.tcp, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    )
    return jacobian.reshape(6, -1)  # the binding drops the axis of a robot with one angle


def tcp_force_gradient(jacobian: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """Return d(J^T w)/d(theta) for a wrench that keeps its direction in base axes.

    For revolute axes z and lever arms J_v = z x (p - p_i), with j at or below i in the chain:
    dJ_v,i/dtheta_j = z_j x J_v,i and dz_i/dtheta_j = z_j x z_i; with j above i only the TCP moves:
    dJ_v,i/dtheta_j = z_i x J_v,j (Bruyninckx and De Schutter 1996, docs/references.md).

    Args:
        jacobian: Jacobian of one state or of k, as `tcp_jacobian` [m/rad, 1], (..., 6, angles).
        wrench: Wrench [N, N m] of all states, (6,), or of each, (..., 6).

    Returns:
        Entry i, j is d(J^T w)_i / d(theta_j) [N m/rad], (..., angles, angles).
    """
    lever, axis = jacobian[..., :3, :], jacobian[..., 3:, :]
    # (z_min(i,j) x J_v,max(i,j)) . f = z_min . (J_v,max x f), symmetric in i and j.
    turning = axis.swapaxes(-1, -2) @ (_skew(-wrench[..., :3]) @ lever)
    # (z_j x z_i) . m = z_j . (z_i x m) for j < i only.
    tilting = (_skew(-wrench[..., 3:]) @ axis).swapaxes(-1, -2) @ axis
    upper, below = _triangles(axis.shape[-1])
    return np.where(upper, turning, turning.swapaxes(-1, -2)) + below * tilting


def _skew(vector: np.ndarray) -> np.ndarray:
    """Return the matrices of v x, (..., 3, 3)."""
    matrix = np.zeros((*vector.shape, 3))
    for k, (row, column) in enumerate(((2, 1), (0, 2), (1, 0))):
        matrix[..., row, column] = vector[..., k]
        matrix[..., column, row] = -vector[..., k]
    return matrix


def tcp_velocity_gradient(jacobian: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Return d(J theta')/d(theta): how the TCP's velocity at fixed rates follows the angles.

    The formulas of `tcp_force_gradient`, summed over the rates instead of the wrench.  (Pinocchio's
    getFrameVelocityDerivatives turns the axes of its answer with the tool.)

    Args:
        jacobian: Jacobian, as `tcp_jacobian` [m/rad, 1], (6, angles).
        rate: theta' [rad/s], (angles,).

    Returns:
        Rows velocity [m/s/rad], angular velocity [1/s]; base axes, (6, angles).
    """
    lever, axis = jacobian[:3], jacobian[3:]
    velocity, spin = lever * rate, axis * rate
    from_here_on = np.cumsum(velocity[:, ::-1], axis=1)[:, ::-1]  # of the joints i >= j
    above = np.cumsum(spin, axis=1) - spin  # of the joints i < j
    below = spin.sum(axis=1, keepdims=True) - above - spin
    linear = np.cross(axis, from_here_on, axis=0) + np.cross(above, lever, axis=0)
    return np.vstack([linear, np.cross(axis, below, axis=0)])


@functools.cache
def _triangles(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Masks of the upper triangle with the diagonal, and of the strictly lower one."""
    upper = np.triu(np.ones((size, size), dtype=bool))
    return upper, ~upper


def pose_of(placement: pin.SE3) -> np.ndarray:
    """Return x, y, z, qx, qy, qz, qw of a placement, qw >= 0, (7,): `turns` has the other quaternion."""
    pose = pin.SE3ToXYZQUAT(placement)
    if pose[6] < 0.0:
        pose[3:] *= -1.0
    return pose


def rotation_between(placement: pin.SE3, reference: pin.SE3) -> np.ndarray:
    """Return the rotation vector r [rad] with R = exp(r) R_reference, base axes, (3,)."""
    return pin.log3(placement.rotation @ reference.rotation.T)
