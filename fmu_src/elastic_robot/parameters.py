"""The numbers of the model that may change while it runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic_robot.description import Robot


@dataclass(frozen=True)
class Parameters:
    """Tunable parameters of the robot model; one entry per elastic coordinate where (m,).

    Attributes:
        gravity: [m/s^2] in base axes, (3,).
        stiffness: [N m/rad], (m,).
        damping: [N m s/rad], (m,).
        backlash: Half width of the dead band [rad], (m,); 0 for tilts.
    """

    gravity: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    backlash: np.ndarray

    @classmethod
    def of(cls, robot: Robot) -> Parameters:
        """Return the values of the robot's description."""
        rows: list[tuple[float, float, float]] = []
        for joint in robot.joints:
            if joint.stiffness is not None:
                rows.append((joint.stiffness, joint.damping, joint.backlash))
            rows += [(tilt.stiffness, tilt.damping, 0.0) for tilt in joint.tilt]
        stiffness, damping, backlash = np.array(rows, dtype=float).reshape(-1, 3).T
        return cls(np.array(robot.gravity, dtype=float), stiffness, damping, backlash)
