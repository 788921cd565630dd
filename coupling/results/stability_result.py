"""stability.json: which cuts chatter, from which depth on, and what gives way."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from coupling.results.base import ResultFile, ResultPart, Shown, Unbounded, finite
from coupling.results.modes_result import Grid, SwingingRobotResult

# File with the figures, in the folder of the result.
FIGURES = "stability.json"

Numbers = tuple[float, ...]
Limits = tuple[float | None, ...]


def stored_limits(values: np.ndarray) -> Limits:
    """Return limits [m], (n,), or their frequencies [Hz], None where there is none."""
    return tuple(map(finite, values.tolist()))


class StabilityPoint(ResultPart):
    """A cut in a posture; a limit of None is none up to the deepest cut that was looked at.

    `moved_m` is the displacement of the tool by the cut's mean force.
    """

    time: float | None
    posture_deg: Numbers
    feed_deg: float
    rpm: float
    depth_m: float
    stable: bool
    growth_1_s: float
    frequency_Hz: float
    border: Literal["Hopf", "flip", "none"]
    limit_m: Unbounded
    zero_order_m: Unbounded
    unloaded_joints: tuple[int, ...]
    moved_m: float


class ChartResult(ResultPart):
    """Limits over the speed of the spindle at the worst place, speeds that are too slow left out.

    Attributes:
        frequency_Hz: Frequency of the vibration at the limit.
        zero_order_m: The same limits by zero order.
        robot_alone_m: Those of the robot without the tool's modes by zero order.
    """

    rpm: Numbers
    limit_m: Limits
    frequency_Hz: Limits
    zero_order_m: Limits
    robot_alone_m: Limits

    def stable_speeds(self, depth: float) -> tuple[tuple[float, float], ...]:
        """Return the ranges of speeds at which a depth [m] and all smaller ones are stable [1/min].

        Example:
            >>> none = (None,) * 3
            >>> limits = {"limit_m": (1e-3, None, 3e-3), "frequency_Hz": none, "zero_order_m": none}
            >>> chart = ChartResult(rpm=(1e3, 2e3, 3e3), robot_alone_m=none, **limits)
            >>> chart.stable_speeds(2e-3)
            ((2000.0, 3000.0),)
        """
        is_stable = [limit is None or limit > depth for limit in self.limit_m]
        edges = np.flatnonzero(np.diff([False, *is_stable, False])).tolist()
        return tuple(
            (self.rpm[low], self.rpm[high - 1])
            for low, high in zip(edges[::2], edges[1::2], strict=True)
        )


class FeedChartResult(ResultPart):
    """Limits over the direction of the feed, from the part's x axis."""

    feed_deg: Numbers
    limit_m: Limits


class PartChartResult(ResultPart):
    """Limits over the part; None where there is none or the robot cannot be.

    Attributes:
        least_m: Limits that no speed of the range falls below, by zero order.
    """

    x_m: Numbers
    y_m: Numbers
    limit_m: Grid
    least_m: Grid


class SensitivityResult(ResultPart):
    """Limit with another robot; `least_m` is that which no speed falls below, by zero order."""

    name: str
    limit_m: Unbounded
    least_m: Unbounded


class MarchResult(ResultPart):
    """The cut marched in time with edges that leave it."""

    seconds: float
    stable: bool
    growth_1_s: float
    out_of_cut: float


class StabilityResult(Shown, ResultFile):
    """Stability of a case's cuts; docs/milling.md says what the figures are.

    `instead_of` has the words of the command that ended with it, as the cut chatters; None: `stability`
    itself.
    """

    what = "the stability of cuts"
    sparse: ClassVar = (
        "tolerance_m",
        "instead_of",
        "chart",
        "over_feed",
        "over_part",
        "sensitivities",
        "march",
        "swinging",
    )

    case: str
    case_file: str
    robot: str
    tolerance_m: float | None = None
    instead_of: tuple[str, ...] | None = None
    sentence: str
    motors: Literal["locked"] = "locked"
    tool_modes: int
    deepest_m: float
    points: Annotated[tuple[StabilityPoint, ...], Field(min_length=1)]
    worst: int
    joints: Numbers
    tool_share: float
    stable_rpm: tuple[tuple[float, float], ...] = ()
    islands_m: tuple[tuple[float, float], ...] = ()
    chart: ChartResult | None = None
    over_feed: FeedChartResult | None = None
    over_part: PartChartResult | None = None
    sensitivities: tuple[SensitivityResult, ...] | None = None
    march: MarchResult | None = None
    swinging: SwingingRobotResult | None = None
    remarks: tuple[str, ...] = ()
    version: str
