"""Hysteresis of the gears: elements of all of them as arrays.

Element j of a gear with wind-up e = x[k] has an elongation s_j, which takes every change of e until it
reaches the slip angle a_j, and a torque in proportion to it (Prandtl's stop operator, [Brokate1996] in
docs/references.md):

    s_j = clip(s_j + de, +-a_j)        along a monotone change de of e
    H_k = F_k sum_j p_j s_j / a_j

with the torque F_k at which all elements of the gear slip and the shares p_j of it, sum p_j = 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic_robot.description import Robot

# Time [s] by which the rate of a slipping element is a way to its reversal, as that of a sticking one to its
# slip angle.
REVERSAL_TIME = 1e-3


@dataclass(frozen=True)
class Elements:
    """Elements of the hysteresis of all gears, e of them, in the order of the gears.

    Attributes:
        coordinate: Index of the gear's wind-up among the elastic coordinates, rising, (e,).
        number: Number of the element within its gear, from 1, (e,).
        slip_angle: Elongation a at which it slips [rad], > 0, (e,).
        share: Its part p of the gear's slip torque, (e,).
    """

    coordinate: np.ndarray
    number: np.ndarray
    slip_angle: np.ndarray
    share: np.ndarray

    @classmethod
    def of(cls, robot: Robot) -> Elements:
        """Return the elements of a robot's description."""
        rows: list[tuple[int, int, float, float]] = []
        coordinate = 0
        for joint in robot.joints:
            torque = sum(stop.slip_torque for stop in joint.hysteresis)
            for number, stop in enumerate(joint.hysteresis, start=1):
                rows.append((coordinate, number, stop.slip_angle, stop.slip_torque / torque))
            coordinate += (joint.stiffness is not None) + len(joint.tilt)
        index, slips = np.array([row[:2] for row in rows], dtype=int), [row[2:] for row in rows]
        return cls(*index.reshape(-1, 2).T, *np.array(slips, dtype=float).reshape(-1, 2).T)

    @property
    def places(self) -> list[tuple[int, int]]:
        """Coordinate and number of each element."""
        return list(zip(self.coordinate.tolist(), self.number.tolist(), strict=True))

    @property
    def gears(self) -> np.ndarray:
        """Elastic coordinates that have elements, rising."""
        return np.unique(self.coordinate)

    @property
    def count(self) -> int:
        """Number of elements e."""
        return len(self.coordinate)
