"""The cut of a command, where its process is milling: its figures, and whether it chatters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.errors import PlanningError, StabilityError
from coupling.process.milling_force import MeanForce
from coupling.results.cut_result import CutResult, CutStability, MeanForceAcross
from coupling.run.check import Check, CheckedCommand
from coupling.run.cut_figures import cut_result, milling_and_table
from coupling.stability.path_stability import stability_in_brief

# Part of the largest mean force at which a cut is near its largest.
_NEAR = 0.9


@dataclass(frozen=True)
class CutFinding:
    """Finding on a cut.

    Attributes:
        stability: Stability of the cut; None where nothing is milled, or it is not known.
        remarks: Reason why its stability is not known, as sentences.
    """

    stability: CutStability | None = None
    cut: CutResult | None = None
    force: MeanForceAcross | None = None
    remarks: tuple[str, ...] = ()


def _compute(command: CheckedCommand) -> CutFinding:
    """Return whether it chatters, or why that is not known, which spoils no result."""
    cut, force = cut_result(command.case), _mean_force_across(command)
    try:
        stability = stability_in_brief(command.case, command.correction.achieved)
        return CutFinding(stability, cut, force)
    except (PlanningError, StabilityError) as error:
        return CutFinding(None, cut, force, (f"whether the cut chatters is not known: {error}",))


def _mean_force_across(command: CheckedCommand) -> MeanForceAcross | None:
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


CUT_STABILITY = Check("stability", _compute, CutFinding())
