"""Parts of a deviation that a run's paths tell: by motion, and by the gears that change their flank."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from coupling.path.deviation import shares_of_time
from coupling.path.histories import ToolPath
from coupling.results.run_result import FlankChangeResult
from coupling.run.stored_run import StoredRobot

# A gear that has reached its other flank is felt for so long [s].
BEHIND = 0.1


@dataclass(frozen=True)
class Share:
    """Part of a deviation.

    Attributes:
        maximum, rms: Largest and rms distance, the mean over time [m].
        time: Instant of the largest [s].
    """

    maximum: float
    rms: float
    time: float

    @classmethod
    def of(
        cls, time: np.ndarray, distance: np.ndarray, chosen: np.ndarray | None = None
    ) -> Share | None:
        """Return the share of chosen samples, a mask (n,), or of all; None where there are none."""
        weights = shares_of_time(time)
        if chosen is not None:
            time, distance, weights = time[chosen], distance[chosen], weights[chosen]
        if len(time) == 0:
            return None
        rms = float(np.sqrt(weights @ distance**2 / weights.sum()))
        return cls(float(distance.max()), rms, float(time[distance.argmax()]))


@dataclass(frozen=True)
class Shares:
    """Parts of the deviation of one actual path.

    Attributes:
        other: Deviation of the robot in the mode that is not the run's; None where not simulated.
        motion: Distance between the moving and the quasi-static robot; None as `other`.
        flanks: Deviation while a gear is in its play and `BEHIND` it; None where none is.
        elsewhere: Deviation at all other times.
    """

    other: Share | None
    motion: Share | None
    flanks: Share | None
    elsewhere: Share | None


def shares_of(run: StoredRobot, stage: str) -> Shares:
    """Return the parts of the deviation of one of a run's actual paths, by its stage."""
    path, other = run.actual[stage], run.other.get(stage)
    distance = path.distance_to(run.desired)
    near = near_flank_changes(path.time, run.figures.changes)
    return Shares(
        other=_between(other, run.desired),
        motion=_between(other, path),
        flanks=Share.of(path.time, distance, near),
        elsewhere=Share.of(path.time, distance, ~near) if near.any() else None,
    )


def _between(path: ToolPath | None, other: ToolPath) -> Share | None:
    return None if path is None else Share.of(path.time, path.distance_to(other))


def near_flank_changes(time: np.ndarray, changes: Iterable[FlankChangeResult]) -> np.ndarray:
    """Return at which times a gear is in its play or has just left it, (n,).

    Args:
        time: Rising [s], (n,).
        changes: `flank_changes` of result.json.

    Example:
        >>> change = FlankChangeResult(robot="", joint=1, begins_s=0.5, ends_s=2.0, before=-1, after=1)
        >>> near_flank_changes(np.array([0.0, 1.0, 2.05, 2.2]), [change])
        array([False,  True,  True, False])
    """
    near = np.zeros(len(time), dtype=bool)
    for change in changes:
        first, last = np.searchsorted(time, [change.begins_s, change.ends_s + BEHIND])
        near[first:last] = True
    return near


def spike(time: np.ndarray, distance: np.ndarray, change: FlankChangeResult) -> tuple[float, float]:
    """Return time and height of the largest deviation where a gear changes its flank."""
    first, last = np.searchsorted(time, [change.begins_s, change.ends_s + BEHIND])
    first = min(int(first), len(time) - 1)
    row = first + int(distance[first : max(int(last), first + 1)].argmax())
    return float(time[row]), float(distance[row])
