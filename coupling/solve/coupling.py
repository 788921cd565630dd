"""The coupling of robot and process: along the whole path, or marching in time."""

from __future__ import annotations

import numpy as np

from coupling.path.histories import ToolPath
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from coupling.process.base import marched
from coupling.robot.contract import SimulatedRobot
from coupling.solve.fixed_point import Coupling, Loop, iterate, unloaded_path
from coupling.solve.windows import march

# Longest step at which the paths of moving robots are sampled [s]: springs and forces go straight in
# between, 0.1 um off on a circle of 60 mm at 50 mm/s.
_STEP = 0.004


def sampled_for(loop: Loop[SimulatedRobot], path: SampledPath) -> SampledPath:
    """Return paths at the times at which robots are coupled with a process.

    Args:
        loop: Robot and process.
        path: The paths: a quasi-static robot needs the samples of the process alone, a moving one does
            something in between.
    """
    if loop.mode == "quasistatic" and marched(loop.process) is None:
        return SampledPath.of(path.samples)
    return refined_for(loop, path, _STEP)


def refined_for(loop: Loop[SimulatedRobot], path: SampledPath, longest: float) -> SampledPath:
    """Return paths at shorter steps, at each of which a process with a memory is evaluated.

    Args:
        loop: Robot and process.
        longest: Longest step [s].
    """
    process = marched(loop.process)
    if process is None:
        return path.refined(longest)
    return SampledPath.of(path.refined(min(process.memory.step, longest)).path)


def couple(
    loop: Loop[SimulatedRobot],
    command: JointPath,
    start: ToolPath | None = None,
    rows: np.ndarray | None = None,
) -> Coupling:
    """Find the path x = G(process(x)) of an elastic robot G under its process's wrench.

    A process with a memory is coupled window by window, any other one along the whole path.

    Args:
        loop: Robot and process.
        command: Motion of the drives.
        start: First path, whose times are those of all paths and wrenches; the robot's path without
            load at the command's rows unless given.
        rows: Row numbers of the process's samples in them, (n,); all of them unless given, and all for a
            process with a memory.

    Returns:
        The result, converged or not.

    Raises:
        SimulationError: If the robot cannot be simulated at all.
        ProcessError: If the process has no answer to the first path; a later failure is a result.
    """
    first = start or unloaded_path(loop, command, command.time)
    process = marched(loop.process)
    if process is not None:
        return march(loop, process, command, first)
    return iterate(loop, command, first, rows)
