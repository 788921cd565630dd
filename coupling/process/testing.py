"""Checks of the contract of a process, for the tests of those who write one."""

from __future__ import annotations

import numpy as np

from coupling.errors import ProcessError
from coupling.path.histories import ToolPath
from coupling.process.base import Process

# Displacement of the tool with which the stiffness is felt [m].
_NUDGE = 1e-7


def check_process(process: Process, path: ToolPath) -> float:
    """Check a process on a path and return the largest stiffness that a tool feels there [N/m].

    The coupling needs a wrench at every time of the path, and the same answer to the same path: no
    memory from one evaluation to the next.  A stiffness times the robot's compliance above 1 asks
    for the scheme robin, aitken or anderson.

    Raises:
        ProcessError: If it breaks one of these.

    Example:
        >>> from coupling.process import ElasticWall
        >>> wall = ElasticWall(np.zeros(3), np.array([0.0, 0.0, 1.0]), stiffness=1e5)
        >>> pose = np.array([[0.0, 0.0, -1e-3, 0.0, 0.0, 0.0, 1.0]] * 3)
        >>> round(check_process(wall, ToolPath(np.array([0.0, 1.0, 2.0]), pose)))
        100000
    """
    before = path.pose.copy()
    first = process.evaluate(path).wrench
    if not np.array_equal(path.pose, before):
        raise ProcessError("the process changed the path that it was given: change a copy")
    if not np.array_equal(first.time, path.time):
        raise ProcessError(
            f"expected an answer at the {len(path.time)} times of the path, got {len(first.time)}"
            " times of its own"
        )
    if not np.array_equal(process.evaluate(path).wrench.wrench, first.wrench):
        raise ProcessError(
            "the process gives another result on the same path the second time: start every evaluation"
            " anew"
        )
    stiffness = 0.0
    for axis in range(3):
        nudge = np.zeros(6)
        nudge[axis] = _NUDGE
        change = process.evaluate(path.displaced(nudge)).wrench.force - first.force
        stiffness = max(stiffness, float(np.linalg.norm(change, axis=2).max()) / _NUDGE)
    return stiffness
