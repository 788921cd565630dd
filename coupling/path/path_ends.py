"""Paths that begin or end in motion, which no robot can do: it stands before and afterwards."""

from __future__ import annotations

import numpy as np

from coupling.path.histories import ToolPath
from coupling.path.interpolation import InterpolatedPath

# For so long after a start in motion, and before such an end, it is what a tool deviates by [s].
_SETTLING_TIME = 1.0
# What to do about a deviation there.
MOVING_END = "the path is in motion there and the robot at rest: let it accelerate from rest"


def ends_in_motion(desired: ToolPath, names: tuple[str, ...]) -> tuple[str, ...]:
    """Return a sentence for every end of a path at which a tool is not at rest.

    Args:
        desired: Desired paths of all tools.
        names: Names of their robots.

    Example:
        >>> time = np.linspace(0.0, 1.0, 21)
        >>> pose = np.zeros((21, 7)); pose[:, 0] = 0.05 * time; pose[:, 6] = 1.0
        >>> ends_in_motion(ToolPath(time, pose), ("forming",))[0][:66]
        'the path begins at 0.05 m/s (0 to 0.05 s), and a robot begins at r'
    """
    remarks = []
    for name, path in zip(names, desired.tools, strict=True):
        speeds = np.linalg.norm(np.diff(path.position[0], axis=0), axis=1) / np.diff(path.time)
        who = f"the path of the {name} robot" if len(names) > 1 else "the path"
        at_rest = InterpolatedPath(path).at_rest
        for k, verb, change in ((0, "begin", "accelerate from"), (-1, "end", "slow down to")):
            if not at_rest[k]:
                first, last = path.time[[k, k + 1]] if k == 0 else path.time[[k - 1, k]]
                remarks.append(
                    f"{who} {verb}s at {speeds[k]:.3g} m/s ({first:.6g} to {last:.6g} s), and a robot"
                    f" {verb}s at rest: the tool deviates there under any command: let it {verb} with"
                    f" rows that {change} rest"
                )
    return tuple(remarks)


def is_near_moving_end(desired: ToolPath, time: float) -> bool:
    """Return whether a path begins or ends in motion about a time [s]."""
    near = (time - desired.time[0] < _SETTLING_TIME, desired.time[-1] - time < _SETTLING_TIME)
    return any(
        is_near and not rests
        for path in desired.tools
        for is_near, rests in zip(near, InterpolatedPath(path).at_rest, strict=True)
    )
