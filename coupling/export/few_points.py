"""A program of few points, closer where the moving robot asks for it."""

from __future__ import annotations

import numpy as np

from coupling.events import Progress
from coupling.export.exported import ExportedProgram
from coupling.export.job import ExportJob
from coupling.export.spline_points import spline_points
from coupling.export.straight_points import straight_points

# Programs that are tried, with closer points where the last one loses too much.
_TRIES = 14
# How long before a loss its cause is looked for at first [s], a few periods of a robot's slowest
# oscillation, and how that grows: a gear may hang in its backlash for seconds before it shows.
_BEFORE, _GROWTH = 0.3, 1.5


def few_points(job: ExportJob) -> ExportedProgram:
    """Return the first program that loses no more than is allowed, or the one that loses least.

    The points keep to the command within the tolerance.  Where the files, read back and simulated, then
    lose more at the moving robot's tool, which a gear in its backlash or an oscillation does, it is
    halved there, until they do not.
    """
    options, found = job.options, list[ExportedProgram]()
    sampled = job.sampled(job.command.joints)
    if options.targets == "cartesian":
        job.require_poses_that_tell(sampled)
    curve = sampled.curve(options.targets)
    choose = spline_points if options.language.between == "spline" else straight_points
    tolerance = np.full(len(sampled.time), options.tolerance)
    for number in range(_TRIES):
        job.watch(Progress("choosing points, reading them back", number, _TRIES))
        rows = choose(curve, sampled.time, sampled.points, tolerance)
        judged = job.judged(sampled, rows, float(tolerance.min()))
        found.append(judged.exported)
        if found[-1].loss <= options.tolerance or len(rows) == len(sampled.points):
            break
        tolerance = _halved(tolerance, sampled.time, judged.lost, _BEFORE * _GROWTH**number)
    return min(found, key=lambda one: one.loss)


def _halved(tolerance: np.ndarray, time: np.ndarray, lost: np.ndarray, before: float) -> np.ndarray:
    """Return tolerances at times, half of what they are up to so long before something was lost.

    Example:
        >>> _halved(np.ones(4), np.array([0.0, 0.8, 1.0, 2.0]), np.array([1.0]), before=0.3)
        array([1. , 0.5, 0.5, 1. ])
    """
    first, last = np.searchsorted(lost, time), np.searchsorted(lost, time + before, side="right")
    return np.where(last > first, 0.5, 1.0) * tolerance
