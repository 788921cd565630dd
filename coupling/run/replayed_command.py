"""A command as written, on robots that are not quite the model: what it leaves there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.results.outlook import Replay
from coupling.robot.cell import Cell
from coupling.robot.robot import SimulatedRobot
from coupling.solve.correction import Correction

# Rows of a replay are this far apart at most where the wrench is straight [s]: what then lies between
# two of them changes no figure by a per cent (docs/compensation.md).
_APART = 8e-3
# A wrench is straight within this part of its largest force or moment.
_STRAIGHT = 1e-9


@dataclass(frozen=True)
class ReplayedCommand:
    """A command, and the wrench under which it is replayed.

    Attributes:
        cell: The robots of the case.
        joints: The command.
        loads: Wrenches on the tools.
        desired: Desired paths at their times.
    """

    cell: Cell
    joints: JointPath
    loads: WrenchHistory
    desired: ToolPath

    @classmethod
    def of(cls, cell: Cell, correction: Correction) -> ReplayedCommand:
        """Return a command under the wrench of its validation, on as few rows as show what it leaves."""
        rows = replay_rows(correction.response.wrench)
        desired = correction.desired.at_rows(rows)
        loads = correction.response.wrench.refined(desired.time)
        return cls(cell, correction.joints, loads, desired)

    def on(self, name: str, robots: Sequence[SimulatedRobot], force: float = 1.0) -> Replay:
        """Return what it leaves on robots that move, under a factor of the wrench.

        Raises:
            SimulationError: If a robot cannot be simulated.
        """
        cell, loads = self.cell.with_robots(robots), self.loads.scaled(force)
        return Replay.of(name, cell.simulate(self.joints, loads, "dynamic"), self.desired)


def replay_rows(loads: WrenchHistory) -> np.ndarray:
    """Return rising numbers of the instants at which a replay is looked at, (k,).

    These are the first and the last, all at which the wrench bends or jumps, and as many between as
    are needed: under a wrench that bends from row to row, as with the teeth of a mill, all.

    Example:
        >>> time = np.linspace(0.0, 0.04, 11)
        >>> wrench = np.zeros((11, 6)); wrench[:, 2] = np.abs(time - 0.02)
        >>> replay_rows(WrenchHistory(time, wrench)).tolist()
        [0, 2, 3, 5, 7, 8, 10]
    """
    time = loads.instants
    if loads.spring is not None or len(time) < 3:
        return np.arange(len(time))
    before, behind = loads.before, loads.behind
    share = ((time[1:-1] - time[:-2]) / (time[2:] - time[:-2]))[:, None]
    straight = (1.0 - share) * behind[:, :-2] + share * before[:, 2:]
    off = np.maximum(np.abs(before[:, 1:-1] - straight), np.abs(behind[:, 1:-1] - straight))
    size = np.abs(loads.wrench).max(axis=(0, 1))
    bends = np.flatnonzero((off > _STRAIGHT * size).any(axis=(0, 2))) + 1
    # Where it may jump it has a row, even if it does not.
    ends = np.unique(
        np.concatenate([[0], bends, np.searchsorted(time, loads.jumps), [len(time) - 1]])
    )
    parts = np.ceil(np.diff(time[ends]) / _APART - _STRAIGHT).astype(int)
    within = np.concatenate([np.arange(count) / count for count in parts.tolist()])
    between = np.repeat(ends[:-1], parts) + within * np.repeat(np.diff(ends), parts)
    return np.unique(np.append(np.round(between), ends[-1]).astype(int))
