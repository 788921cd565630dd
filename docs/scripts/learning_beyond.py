"""What a measured robot's tool does beyond its model: gear errors, hysteresis and drift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.path.joint_path import JointPath
from coupling.path.linear import interpolate_rows
from coupling.robot.inverse_kinematics import InverseKinematics
from elastic_robot.description import Robot

# Change of a joint angle for a difference [rad].
_CHANGE = 1e-5


@dataclass(frozen=True)
class Beyond:
    """What no parameter of the model does.

    Attributes:
        gear_errors: Amplitude at the tool of each of the two joints that move it most [m].
        waves: Their periods a turn of the joint.
        hysteresis: Width at the tool of that of the joint that moves it most [m].
        drift: Displacement of the tool at the end of a run [m].
        seed: Of phases and directions.
    """

    gear_errors: float = 0.0
    waves: tuple[float, float] = (97.0, 131.0)
    hysteresis: float = 0.0
    drift: float = 0.0
    seed: int = 1

    def at(
        self, robot: Robot, home: np.ndarray, command: JointPath, time: np.ndarray
    ) -> np.ndarray:
        """Return the tool's displacement under a command [m], (n, 3), base axes.

        Args:
            robot: The robot, for its kinematics.
            home: Joint angles near which paths start [rad].
            command: Motion of its drives.
            time: Rising [s], (n,).
        """
        planner, rng = InverseKinematics(robot, home), np.random.default_rng(self.seed)
        q = interpolate_rows(time, command.time, command.q[0])
        place = planner.poses(q)[:, :3]
        levers = np.empty((*place.shape, q.shape[1]))
        for joint in range(q.shape[1]):
            turned = q + _CHANGE * (np.arange(q.shape[1]) == joint)
            levers[:, :, joint] = (planner.poses(turned)[:, :3] - place) / _CHANGE
        arms = np.linalg.norm(levers, axis=1).mean(axis=0)
        most = np.argsort(-arms * np.ptp(q, axis=0))[:2]
        turns = np.zeros_like(q)
        for joint, waves in zip(most, self.waves, strict=True):
            phase = rng.uniform(0.0, 2.0 * np.pi)
            turns[:, joint] = self.gear_errors / arms[joint] * np.sin(waves * q[:, joint] + phase)
        first = int(most[0])
        turns[:, first] += _dragged(q[:, first], 0.5 * self.hysteresis / arms[first]) - q[:, first]
        way = rng.standard_normal(3)
        share = (time - time[0]) / np.ptp(time)
        moved: np.ndarray = np.einsum("naj,nj->na", levers, turns)
        return moved + self.drift * share[:, None] * way / np.linalg.norm(way)


def _dragged(q: np.ndarray, half: float) -> np.ndarray:
    """Return what follows an angle as far behind as half a width."""
    behind = np.empty_like(q)
    behind[0] = q[0]
    for row in range(1, len(q)):
        behind[row] = np.clip(behind[row - 1], q[row] - half, q[row] + half)
    return behind
