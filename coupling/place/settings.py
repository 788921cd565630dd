"""Settings: where the part stands, how tool, base and a redundant arm are held; and their ranges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.robot.batch.following import self_motion
from coupling.robot.batch.redundancy import POSE
from coupling.robot.batch.rigid_robot import RigidRobot
from coupling.run.sobol import sobol
from elastic_robot.description import Robot

# What may be free: place of the part's origin [m], its yaw, tilt of the tool, roll of the base, way of
# the home posture of a redundant robot along its self-motion [rad].
NAMES = ("x", "y", "z", "yaw", "lead", "lean", "rotation", "base_roll", "elbow")
LENGTHS = NAMES[:3]
# Where settings are rounded to [m], [rad]: what can be set, and reads well.
_RESOLUTION = np.array([1e-4] * 3 + [np.deg2rad(0.01)] * 6)


@dataclass(frozen=True)
class Ranges:
    """Box of settings.

    Attributes:
        low, high: Ends by `NAMES` [m], [rad], (9,); equal where a setting is not free.

    Raises:
        ValueError: If one is upside down.
    """

    low: np.ndarray
    high: np.ndarray

    def __post_init__(self) -> None:
        if np.any(self.low > self.high):
            k = int(np.argmax(self.low > self.high))
            raise ValueError(f"{NAMES[k]}: expected low <= high, got {self.low[k]}, {self.high[k]}")

    @property
    def free(self) -> np.ndarray:
        """Numbers of the free entries of `NAMES`, (k,)."""
        return np.flatnonzero(self.high > self.low)

    @property
    def width(self) -> np.ndarray:
        """Width by `NAMES` [m], [rad], (9,); 1 where a setting is not free."""
        width = self.high - self.low
        return np.where(width > 0.0, width, 1.0)

    def sampled(self, count: int, seed: int) -> np.ndarray:
        """Return scrambled Sobol points of the box, by `NAMES` [m], [rad], (count, 9)."""
        samples = np.tile(self.low, (count, 1))
        free = self.free
        if len(free):
            samples[:, free] += sobol(count, len(free), seed) * self.width[free]
        return samples

    def around(
        self, center: np.ndarray, share: float, count: int, rng: np.random.Generator
    ) -> np.ndarray:
        """Return rounded settings, normally distributed about one (9,) [m], [rad], (count, 9)."""
        samples = np.tile(center, (count, 1))
        free = self.free
        step = rng.normal(size=(count, len(free)))
        # Half of them move along few settings only: ridges are narrow across.
        step[::2] *= rng.random((len(step[::2]), len(free))) < 2.0 / max(len(free), 2)
        samples[:, free] += share * step * self.width[free]
        return self.rounded(samples)

    def apart(self, setting: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Return the largest difference of settings (n, 9) from one (9,), over the width [1], (n,)."""
        free = self.free
        if len(free) == 0:
            return np.zeros(len(others))
        distance: np.ndarray = np.abs((others - setting) / self.width)[:, free].max(axis=1)
        return distance

    def rounded(self, settings: np.ndarray) -> np.ndarray:
        """Return settings rounded to what can be set [m], [rad], (..., 9); those not free are kept."""
        rounded = settings.copy()
        free = self.free
        rounded[..., free] = (np.round(settings / _RESOLUTION) * _RESOLUTION)[..., free]
        return np.clip(rounded, self.low, self.high)


@dataclass(frozen=True)
class ArmHome:
    """Home posture of a robot, which a setting may move along the self-motion of a redundant one.

    Attributes:
        angles: Joint angles of the case [rad], (joints,).
        elbow: Angles by which they change with the setting "elbow" [1], (joints,); zero with six joints.
    """

    angles: np.ndarray
    elbow: np.ndarray

    @classmethod
    def of(cls, robot: Robot, angles: np.ndarray) -> ArmHome:
        """Return that of a robot in a case."""
        redundant = len(angles) > POSE
        elbow = self_motion(RigidRobot(robot), angles) if redundant else np.zeros(len(angles))
        return cls(angles, elbow)

    @property
    def is_redundant(self) -> bool:
        """Whether its robot has more joints than a pose has coordinates."""
        return len(self.angles) > POSE

    def homes(self, settings: np.ndarray) -> np.ndarray:
        """Return the postures of settings by `NAMES` [rad], (joints, n)."""
        return self.angles[:, None] + self.elbow[:, None] * settings[:, NAMES.index("elbow")]


@dataclass(frozen=True)
class CellLayout:
    """What all settings of a case share.

    Attributes:
        part_rpy, base_rpy: Roll, pitch, yaw of part and base [rad], (3,); yaw of the part and roll of
            the base are those of a setting.
        sphere_radius: Radius of the tool's end [m]; 0 where the tool has none.
        untilted_lean: Lean of the untilted tool [rad].
        gravity: Gravity, world axes [m/s^2], (3,).
    """

    part_rpy: np.ndarray
    base_rpy: np.ndarray
    sphere_radius: float
    untilted_lean: float
    gravity: np.ndarray

    def placed(self, settings: np.ndarray) -> PlacedSettings:
        """Return part, tool and base of settings by `NAMES` [m], [rad], (n, 9)."""
        x, y, z, yaw, lead, lean, rotation, roll, _ = settings.T
        part = np.tile(self.part_rpy, (len(settings), 1))
        part[:, 2] = yaw
        base = np.tile(self.base_rpy, (len(settings), 1))
        base[:, 0] = roll
        base_from_world = Rotation.from_euler("xyz", base).inv()
        about_approach = np.zeros((len(settings), 3))
        about_approach[:, 0] = rotation
        return PlacedSettings(
            base_from_world.apply(np.column_stack([x, y, z])),
            base_from_world * Rotation.from_euler("xyz", part),
            Rotation.from_euler("yx", np.column_stack([lead, lean - self.untilted_lean])),
            Rotation.from_rotvec(about_approach),
            base_from_world.apply(self.gravity),
        )


@dataclass(frozen=True)
class PlacedSettings:
    """Settings in the frame of the robot's base.

    Attributes:
        position: Origin of the part, base frame [m], (n, 3).
        part: base_from_part.
        tilt: Rotation of the tool in the axes that its tilt is measured in.
        spin: Rotation of the tool about its own axis.
        gravity: Gravity, base axes [m/s^2], (n, 3).
    """

    position: np.ndarray
    part: Rotation
    tilt: Rotation
    spin: Rotation
    gravity: np.ndarray
