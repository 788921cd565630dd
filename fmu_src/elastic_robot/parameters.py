"""The numbers of the model that may change while it runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic_robot.description import Robot, Table


@dataclass(frozen=True)
class Parameters:
    """Tunable parameters of the robot model; one entry per elastic coordinate where (m,).

    Attributes:
        gravity: Gravity [m/s^2] in base axes, (3,).
        stiffness: Stiffness [N m/rad], (m,).
        damping: Damping [N m s/rad], (m,).
        backlash: Half width of the backlash [rad], (m,); 0 for tilts.
        tables: Points of the characteristic curve (angle [rad], torque [N m]) of each coordinate
            that has its own, else None, (m,); used by the curve "spline" alone.
    """

    gravity: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    backlash: np.ndarray
    tables: tuple[Table | None, ...]

    @classmethod
    def of(cls, robot: Robot) -> Parameters:
        """Return the values of the robot's description."""
        rows: list[tuple[float, float, float]] = []
        tables: list[Table | None] = []
        for joint in robot.joints:
            if joint.stiffness is not None:
                rows.append((joint.stiffness, joint.damping, joint.backlash))
                tables.append(joint.torque_table)
            tables += [None] * len(joint.tilt)
            rows += [(tilt.stiffness, tilt.damping, 0.0) for tilt in joint.tilt]
        stiffness, damping, backlash = np.array(rows, dtype=float).reshape(-1, 3).T
        gravity = np.array(robot.gravity, dtype=float)
        return cls(gravity, stiffness, damping, backlash, tuple(tables))
