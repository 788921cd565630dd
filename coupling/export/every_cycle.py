"""A program of rows on the controller's cycle, solved for where samples of the command lose too much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coupling.errors import PlanningError, SimulationError
from coupling.events import Progress
from coupling.export.exported import ExportedProgram
from coupling.export.job import ExportJob
from coupling.inverse.inversion import DesiredMotion
from coupling.path.histories import JointPath

# What the inverse aims at, as parts of the tolerance, one after the other.
_AIMS = (0.5, 0.1)
# Fewest cycles of a command for which rows are solved for: with less nothing is left to be chosen.
_FEWEST = 8


def every_cycle(job: ExportJob) -> ExportedProgram:
    """Return the first rows that lose no more than is allowed, or those that lose least.

    At first they are samples of the command.  What a drive does between two of them to turn a gear
    through its backlash is lost, and the link, free there, drifts on with the momentum that is
    missing.  Then the rows are those of the inverse of the moving robot, for the controller's own
    interpolation, of the path that its tool takes under the command.
    """
    tolerance = job.options.tolerance
    job.watch(Progress("sampling the command, reading it back", 0, 1))
    best = _judged(job, job.command.joints)
    for aim in _AIMS:
        if best.loss <= tolerance:
            break
        try:
            rows = _inverse(job, aim * tolerance)
        except (PlanningError, SimulationError) as cause:
            why = f"other rows than samples of the command were sought in vain: {cause}"
            return replace(best, remark="; ".join(filter(None, (best.remark, why))))
        best = min(best, _judged(job, rows), key=lambda one: one.loss)
    return best


def _judged(job: ExportJob, command: JointPath) -> ExportedProgram:
    sampled = job.sampled(command)
    return job.judged(sampled, sampled.points, job.options.tolerance).exported


def _inverse(job: ExportJob, goal: float) -> JointPath:
    """Return rows of angles under which the moving robot's tool takes the path of the command."""
    member, path = job.member, job.reference
    cycles = float(np.ptp(path.time)) / job.cycle
    if cycles < _FEWEST:
        raise PlanningError(f"expected a command of {_FEWEST} cycles at least, got {cycles:.3g}")
    assert member.inverter is not None
    wanted = DesiredMotion(path, member.planner.plan(path), job.loads.on(path))
    controller = replace(job.command.controller, cycle=job.cycle, interpolation="cubic")
    return member.inverter.invert(wanted, controller, goal, job.watch).joints
