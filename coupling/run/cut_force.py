"""Mean force across the feed of a run's cut: of the robot, and of a tool that keeps its path."""

from __future__ import annotations

import numpy as np

from coupling.process.milling_force import MeanForce
from coupling.results.mean_force import MeanForceAcross
from coupling.run.check import CheckedCommand
from coupling.run.cut_figures import milling_and_table

# Part of the largest mean force at which a cut is near its largest.
_NEAR = 0.9


def mean_force_across(command: CheckedCommand) -> MeanForceAcross | None:
    """Return the mean force across the feed of a command's cut; None where nothing is milled."""
    both = milling_and_table(command.case)
    if both is None:
        return None
    milling = both[0]
    desired, wrench = command.case.desired, command.correction.response.wrench
    leftward = np.column_stack([-milling.feed_directions()[:, 1], milling.feed_directions()[:, 0]])
    across = milling.part.rotate(np.column_stack([leftward, np.zeros(len(leftward))]))
    rigid = MeanForce(milling).evaluate(desired).wrench.before[0, :, :3]
    size = np.linalg.norm(rigid, axis=1)
    rows = np.flatnonzero(size > _NEAR * size.max())
    if len(rows) < 2:
        return None
    # Impulses of the steps up to each instant: teeth come and go between the case's samples.
    step = np.diff(wrench.instants)[:, None]
    means = 0.5 * (wrench.behind[0, :-1, :3] + wrench.before[0, 1:, :3])
    impulse = np.vstack([np.zeros(3), np.cumsum(step * means, axis=0)])
    at = np.column_stack([np.interp(desired.time, wrench.instants, column) for column in impulse.T])
    gained = np.diff(at, axis=0)[rows[rows > 0] - 1]
    span = np.diff(desired.time)[rows[rows > 0] - 1]
    robot = np.sum(gained * across[rows[rows > 0]]) / span.sum()
    return MeanForceAcross(
        robot_N=float(robot),
        rigid_N=float(np.mean(np.sum(rigid[rows] * across[rows], axis=1))),
    )
