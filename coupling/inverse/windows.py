"""The links along paths of any length: windows that overlap, with the result of the whole path."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from coupling.inverse.link_model import LinkModel
from coupling.inverse.link_task import LinkMotion, LinkTask
from coupling.inverse.links import LinkProblem
from coupling.inverse.spline import UniformSpline

# Intervals of a window: its matrix takes 0.1 GB for 12 angles.
_WINDOW = 15_000
# First overlap of neighbours: 2 s at 4 ms.  What a cut does dies out within 1 s on the example robot.
_OVERLAP = 500
# Largest difference of neighbours where one takes over from the other [rad].
_AGREED = 1e-10


def solve_links(
    model: LinkModel,
    task: LinkTask,
    progress: Callable[[int, int], None] = lambda done, total: None,
    window: int = _WINDOW,
) -> LinkMotion:
    """Return the motion of the links along a whole path.

    A cut leaves the motion free there, and the difference to that of the whole path dies out with the
    distance; where neighbours do not agree, they are solved anew with twice the overlap.

    Args:
        model: The robot.
        task: Desired motion of the links.
        progress: Function called with the numbers of intervals done and of all.
        window: Intervals that are solved at once.
    """
    count = max(1, round(task.intervals / window))
    cuts = np.linspace(0, task.intervals, count + 1).astype(int).tolist()
    overlap = _OVERLAP
    while True:
        parts = []
        for first, last in pairwise(cuts):
            begin, end = max(0, first - overlap), min(task.intervals, last + overlap)
            found = LinkProblem(model, task.part(begin, end)).solve()
            parts.append((begin, found))
            progress(last, task.intervals)
        neighbours = zip(pairwise(parts), cuts[1:-1], strict=True)
        gap = max((_gap(*pair, cut) for pair, cut in neighbours), default=0.0)
        if gap <= _AGREED or overlap >= task.intervals:
            return _joined(parts, cuts)
        overlap *= 2


def _gap(left: tuple[int, LinkMotion], right: tuple[int, LinkMotion], cut: int) -> float:
    """Return the largest difference of two neighbours at the node of their cut [rad]."""
    rows = [
        motion.theta.coefficients[cut - begin : cut - begin + motion.theta.degree]
        for begin, motion in (left, right)
    ]
    return float(np.abs(rows[0] - rows[1]).max())


def _joined(parts: list[tuple[int, LinkMotion]], cuts: list[int]) -> LinkMotion:
    """Return one motion of windows that begin at node numbers."""
    coefficients, errors = [], []
    for (begin, motion), (first, last) in zip(parts, pairwise(cuts), strict=True):
        end = last == cuts[-1]
        more = motion.theta.degree if end else 0
        coefficients.append(motion.theta.coefficients[first - begin : last - begin + more])
        errors.append(motion.error[first - begin : last - begin + end])
    start = parts[0][1].theta
    theta = UniformSpline(start.start, start.spacing, np.vstack(coefficients), start.degree)
    worst = max((motion for _, motion in parts), key=lambda motion: len(motion.iterations))
    return LinkMotion(theta, worst.iterations, np.concatenate(errors))
