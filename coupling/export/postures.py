"""What a posture of a six-joint robot is called, and how near it is to a singular one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.errors import ProgramError
from coupling.files.controller_axes import ControllerAxes
from coupling.programs.program import Configuration
from coupling.results.export_result import NearestSingularity
from coupling.robot.batch.rigid_robot import RigidRobot
from elastic_robot.description import Robot

# How far the axes of a wrist may pass each other and still meet in its centre [m].
_WRIST_CENTRE_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Posture:
    """A robot's axes in a posture.

    Attributes:
        axes: Unit vectors of the joints' axes, base axes, (joints, 3).
        origins: Points on them [m], (joints, 3).
    """

    axes: np.ndarray
    origins: np.ndarray


class Postures:
    """Postures of one robot."""

    def __init__(self, robot: Robot, axes: ControllerAxes) -> None:
        self._rigid, self._axes = RigidRobot(robot), axes

    @property
    def reach(self) -> float:
        """Sum of the robot's lengths [m]."""
        return self._rigid.reach

    def arm(self, q: np.ndarray) -> Posture:
        """Return the axes at drive angles [rad], (joints,)."""
        posture = self._rigid.posture(q[:, None])
        return Posture(posture.axis[..., 0], posture.origin[..., 0])

    def jacobians(self, q: np.ndarray) -> np.ndarray:
        """Return Jacobians of TCP and rotation by the drive angles, (n, 6, joints)."""
        return self._rigid.posture(q.T).jacobian

    def configuration(self, q: np.ndarray) -> Configuration:
        """Return what tells a posture from the others with the same pose.

        Positive turns of joint 2 lean the arm forward, as the makers count them.

        Args:
            q: Drive angles [rad], (6,).

        Raises:
            ProgramError: If the robot has not six joints, or no spherical wrist, or its controller does
                not count joint 2.
        """
        arm = self.arm(q)
        centre = wrist_centre(arm)
        angles = self._axes.controller_angles(q[None])[0]
        sign = np.sign(self._axes.matrix[1, 1])
        if not sign:
            raise ProgramError(
                "configuration: expected a joint_matrix that counts joint 2, got a zero on its diagonal:"
                " write joint angles with --targets joints"
            )
        second = sign * arm.axes[1]
        # Some makers count joint 1 about an axis that points down.
        upward = arm.axes[0] if arm.axes[0][2] >= 0.0 else -arm.axes[0]
        forward = np.cross(second, upward)
        shoulder, elbow = (_towards(arm, k, centre) for k in (1, 2))
        up = np.dot(second, np.cross(elbow - shoulder, centre - shoulder))
        return Configuration(
            behind=bool(np.dot(forward, centre - arm.origins[0]) < 0.0),
            below=bool(up < 0.0),
            wrist=-1 if angles[4] < 0.0 else 1,
            angles=tuple(angles.tolist()),
        )

    def are_named(self, q: np.ndarray) -> bool:
        """Return whether postures have a configuration, as the one at q [rad], (joints,), has."""
        try:
            self.configuration(q)
        except ProgramError:
            return False
        return True


def wrist_centre(arm: Posture) -> np.ndarray:
    """Return the point where the last three of six axes meet [m], (3,).

    Raises:
        ProgramError: If there are not six, or they do not meet.
    """
    if len(arm.axes) != 6:
        raise ProgramError(
            "configuration: expected a robot of six joints, got one of"
            f" {len(arm.axes)}: write joint angles with --targets joints"
        )
    # Least squares of the distances to the three axes.
    across = [np.eye(3) - np.outer(axis, axis) for axis in arm.axes[3:]]
    right = [plane @ foot for plane, foot in zip(across, arm.origins[3:], strict=True)]
    centre = np.linalg.lstsq(np.vstack(across), np.concatenate(right), rcond=None)[0]
    apart = max(
        float(np.linalg.norm(plane @ (centre - foot)))
        for plane, foot in zip(across, arm.origins[3:], strict=True)
    )
    if apart > _WRIST_CENTRE_TOLERANCE:
        raise ProgramError(
            "configuration: expected a wrist whose three axes meet, got axes that pass each other by"
            f" {1e3 * apart:.3g} mm: write joint angles with --targets joints"
        )
    return centre


def _towards(arm: Posture, joint: int, point: np.ndarray) -> np.ndarray:
    """Return the foot of a point on an axis [m], (3,)."""
    axis, foot = arm.axes[joint], arm.origins[joint]
    nearest: np.ndarray = foot + axis * np.dot(axis, point - foot)
    return nearest


def nearest_singular(
    postures: Postures, time: np.ndarray, q: np.ndarray, jacobians: np.ndarray
) -> NearestSingularity:
    """Return where a motion comes nearest to a singular posture, and of which kind that is.

    Args:
        time: [s], (n,).
        q: Drive angles [rad], (n, joints).
        jacobians: Jacobians of TCP [m/rad] and rotation [rad/rad] by them, (n, 6, joints).
    """
    scaled = jacobians.copy()
    scaled[:, :3] /= postures.reach
    values = np.linalg.svd(scaled, compute_uv=False)[:, -1]
    k = int(values.argmin())
    kind = _kind(postures.arm(q[k]), scaled[k], postures.reach)
    return NearestSingularity(time=float(time[k]), value=float(values[k]), kind=kind)


def _kind(arm: Posture, jacobian: np.ndarray, reach: float) -> str:
    """Return the name of the singular posture that is nearest, by the smallest of three sines."""
    try:
        centre = wrist_centre(arm)
    except ProgramError:
        joint = int(np.abs(np.linalg.svd(jacobian)[2][min(jacobian.shape) - 1]).argmax())
        return f"joint {joint + 1} moves most"
    shoulder, elbow = (_towards(arm, joint, centre) for joint in (1, 2))
    upper, fore = elbow - shoulder, centre - elbow
    lengths = float(np.linalg.norm(upper) * np.linalg.norm(fore))
    to_axis = np.cross(arm.axes[0], centre - arm.origins[0])
    sines = {
        "wrist": float(np.linalg.norm(np.cross(arm.axes[3], arm.axes[5]))),
        "elbow": float(np.linalg.norm(np.cross(upper, fore))) / lengths if lengths else 0.0,
        "shoulder": float(np.linalg.norm(to_axis)) / reach,
    }
    return min(sines, key=lambda name: sines[name])
