"""The numbers of the model that may change while it runs."""

from __future__ import annotations

from dataclasses import dataclass, field

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
        hysteresis: Torque at which all elements of the hysteresis slip [N m], (m,); 0 without any.  The
            elements keep their slip angles and their shares of it.
        tables: Points of the characteristic curve (angle [rad], torque [N m]) of each coordinate
            that has its own, else None, (m,); used by the curve "spline" alone.
        friction: Friction at rest of the motors of the joints that have a drive [N m], (d,).
    """

    gravity: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    backlash: np.ndarray
    hysteresis: np.ndarray
    tables: tuple[Table | None, ...]
    friction: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, robot: Robot) -> Parameters:
        """Return the values of the robot's description."""
        rows: list[tuple[float, float, float, float]] = []
        tables: list[Table | None] = []
        for joint in robot.joints:
            if joint.stiffness is not None:
                torque = sum(stop.slip_torque for stop in joint.hysteresis)
                rows.append((joint.stiffness, joint.damping, joint.backlash, torque))
                tables.append(joint.torque_table)
            tables += [None] * len(joint.tilt)
            rows += [(tilt.stiffness, tilt.damping, 0.0, 0.0) for tilt in joint.tilt]
        friction = np.array(
            [joint.drive.friction for joint in robot.joints if joint.drive], dtype=float
        )
        gravity = np.array(robot.gravity, dtype=float)
        stiffness, damping, backlash, slip = np.array(rows, dtype=float).reshape(-1, 4).T
        return cls(gravity, stiffness, damping, backlash, slip, tuple(tables), friction)
