"""Parts of a deviation that a run's paths tell: by motion, and by the gears that reverse."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from coupling.path.deviation import shares_of_time
from coupling.path.histories import ToolPath
from coupling.results.gear_result import BacklashReversal
from coupling.run.stored_run import StoredRobot

# A gear that has reached its other flank is felt for so long [s].
BEHIND = 0.1


@dataclass(frozen=True)
class DeviationShare:
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
    ) -> DeviationShare | None:
        """Return the share of chosen samples, a mask (n,), or of all; None where there are none."""
        weights = shares_of_time(time)
        if chosen is not None:
            time, distance, weights = time[chosen], distance[chosen], weights[chosen]
        if len(time) == 0:
            return None
        rms = float(np.sqrt(weights @ distance**2 / weights.sum()))
        return cls(float(distance.max()), rms, float(time[distance.argmax()]))

    @classmethod
    def worst(cls, shares: Iterable[DeviationShare | None]) -> DeviationShare | None:
        """Return the largest figures of several tools, as `path.deviation.measure` has them."""
        stated = [share for share in shares if share is not None]
        if not stated:
            return None
        largest = max(stated, key=lambda share: share.maximum)
        return replace(largest, rms=max(share.rms for share in stated))


@dataclass(frozen=True)
class DeviationShares:
    """Parts of the deviation of one actual path.

    Attributes:
        other: Deviation of the robot in the mode that is not the run's; None where not simulated.
        motion: Distance between the moving and the quasi-static robot; None as `other`.
        flanks: Deviation while a gear is in its backlash and `BEHIND` it; None where none is.
        elsewhere: Deviation at all other times.
    """

    other: DeviationShare | None
    motion: DeviationShare | None
    flanks: DeviationShare | None
    elsewhere: DeviationShare | None

    @classmethod
    def worst(cls, tools: Sequence[DeviationShares]) -> DeviationShares:
        """Return the largest of each part of several tools."""
        names = [field.name for field in fields(cls)]
        return cls(
            **{name: DeviationShare.worst(getattr(tool, name) for tool in tools) for name in names}
        )


def shares_of(run: StoredRobot, stage: str) -> DeviationShares:
    """Return the parts of the deviation of one of a run's actual paths, by its stage."""
    path, other = run.actual[stage], run.other.get(stage)
    distance = path.distance_to(run.desired)
    near = near_reversals(path.time, run.figures.reversals)
    return DeviationShares(
        other=_between(other, run.desired),
        motion=_between(other, path),
        flanks=DeviationShare.of(path.time, distance, near),
        elsewhere=DeviationShare.of(path.time, distance, ~near) if near.any() else None,
    )


def _between(path: ToolPath | None, other: ToolPath) -> DeviationShare | None:
    return None if path is None else DeviationShare.of(path.time, path.distance_to(other))


def near_reversals(time: np.ndarray, changes: Iterable[BacklashReversal]) -> np.ndarray:
    """Return at which times a gear is in its backlash or has just left it, (n,).

    Args:
        time: Rising [s], (n,).
        changes: `backlash_reversals` of result.json.

    Example:
        >>> change = BacklashReversal(robot="", joint=1, begins=0.5, ends=2.0, before=-1, after=1)
        >>> near_reversals(np.array([0.0, 1.0, 2.05, 2.2]), [change])
        array([False,  True,  True, False])
    """
    near = np.zeros(len(time), dtype=bool)
    for change in changes:
        first, last = np.searchsorted(time, [change.begins, change.ends + BEHIND])
        near[first:last] = True
    return near


def spike(time: np.ndarray, distance: np.ndarray, change: BacklashReversal) -> tuple[float, float]:
    """Return time [s] and height [m] of the largest deviation where a gear reverses, of (n,) values."""
    first, last = np.searchsorted(time, [change.begins, change.ends + BEHIND])
    first = min(int(first), len(time) - 1)
    row = first + int(distance[first : max(int(last), first + 1)].argmax())
    return float(time[row]), float(distance[row])
