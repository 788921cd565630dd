"""Where a case's robot works: postures along its path, mean wrench, stiffness of the contact."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from coupling.case.case import Case
from coupling.modes.locked_robot import LockedRobot
from coupling.modes.posture_modes import PostureModes
from coupling.path.histories import ToolPath
from coupling.process.base import own_blocks
from coupling.process.milling_force import MeanForce, ToothPassing
from coupling.robot.inverse_kinematics import InverseKinematics

# Rows of a path at most that postures are planned for.
MOST_ROWS = 4000


@dataclass(frozen=True)
class CasePlaces:
    """Places along the path of a tool.

    Attributes:
        time: Times [s], (n,).
        path: Desired path of the tool at these times, in the robot's base.
        q: Joint angles of the undeflected robot [rad], (n, joints).
        wrench: Wrench of the process on the tool, the mean over a turn of a mill, base axes [N, N m],
            (n, 6).
        contact: Stiffness of the process against the tool's displacement, base axes [N/m], (n, 3, 3).
        loads: Origin of the wrench, in words.
    """

    time: np.ndarray
    path: ToolPath
    q: np.ndarray
    wrench: np.ndarray
    contact: np.ndarray
    loads: str

    def spread(self, count: int) -> np.ndarray:
        """Return the numbers of places spread along the path, under load where there is any, (k,)."""
        under_load = np.flatnonzero(np.any(self.wrench, axis=1))
        rows = under_load if len(under_load) else np.arange(len(self.time))
        return rows[np.unique(np.linspace(0, len(rows) - 1, count).astype(int))]

    def modes(self, locked: LockedRobot, rows: np.ndarray) -> Iterator[PostureModes]:
        """Yield the modes at the places of these numbers, (k,)."""
        for row in rows.tolist():
            yield PostureModes.of(locked, self.q[row], self.wrench[row], self.contact[row])


def places_of(case: Case, number: int = 0) -> CasePlaces:
    """Return the places along a robot's path, a few thousand at most.

    The process is evaluated where it is a formula; else the robot carries its own weight.

    Raises:
        PlanningError: If the robot cannot follow the path.
    """
    placed, desired = case.robots[number], case.desired
    rows = np.unique(np.linspace(0, len(desired.time) - 1, MOST_ROWS).astype(int))
    path = desired.tools[number].at_rows(rows).transformed(placed.world_from_base.inverse())
    q = InverseKinematics(placed.description, placed.home).plan(path).q[0]
    wrench, contact = np.zeros((len(rows), 6)), np.zeros((len(rows), 3, 3))
    loads = "its own weight"
    if case.process_table.FORMULA:
        process = case.process
        if isinstance(process, ToothPassing):
            process = MeanForce(process.milling)
        response = process.evaluate(desired)
        in_base = placed.world_from_base.inverse()
        in_world = response.wrench.at(desired.time[rows])[number]
        turn = in_base.rotation.as_matrix()
        wrench = (in_world.reshape(-1, 2, 3) @ turn.T).reshape(-1, 6)
        loads = "its own weight and the process's mean force"
        if response.stiffness is not None:
            contact = turn @ own_blocks(response.stiffness)[number][rows] @ turn.T
    return CasePlaces(path.time, path, q, wrench, contact, loads)
