"""Everything that an ElasticRobot needs to go on as it would have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic_robot.motion import State
from elastic_robot.parameters import Parameters
from elastic_robot.tool_load import ToolLoad
from elastic_robot.trajectory import Drives


@dataclass(frozen=True)
class HeldInputs:
    """Drives and loads of the robot at the present time.

    Attributes:
        q, qd, qdd: Commanded motion of the drives, before their gears [rad, rad/s, rad/s^2], (n,).
        acting: Loads on the tool.
        torque: Torques of motors without servo [N m], (d,) or of all (1,).
    """

    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    acting: ToolLoad
    torque: np.ndarray

    @classmethod
    def at(
        cls, time: float, drives: Drives, acting: ToolLoad, torque: np.ndarray | None = None
    ) -> HeldInputs:
        """Return the drives' motion at a time, with what acts on tool and motors then."""
        q, qd, qdd = drives.at(np.array([time]))[:, 0]
        return cls(q, qd, qdd, acting, np.zeros(1) if torque is None else torque)

    @property
    def commands(self) -> np.ndarray:
        """q, q', q'' [rad, rad/s, rad/s^2], (3, n)."""
        return np.stack([self.q, self.qd, self.qdd])


@dataclass(frozen=True)
class Snapshot:
    """State of an ElasticRobot; frozen, so that a copy costs nothing.

    Attributes:
        state: Elastic coordinates, elongations and time.
        held: Drives and load at that time.
        parameters: Parameters that the state was computed with.
        opposite: Whether qw of the elastic and of the rigid tool was below 0 at the start.
    """

    state: State
    held: HeldInputs
    parameters: Parameters
    opposite: tuple[bool, bool]
