"""What the mill of a run does along its path: its figures, whether it chatters, its mean force."""

from __future__ import annotations

from collections.abc import Mapping

from coupling.results.base import ResultPart, Unbounded

# Key, title, unit that is shown and its factor, of what is told over the path.
COURSES: Mapping[str, tuple[str, str, float]] = {
    "depth_m": ("axial depth", "mm", 1e3),
    "width_m": ("radial width", "mm", 1e3),
    "feed_per_tooth_m": ("feed per tooth", "mm", 1e3),
    "mean_chip_m": ("mean chip", "mm", 1e3),
    "peak_chip_m": ("peak chip", "mm", 1e3),
    "removal_rate_m3_s": ("removal rate", "cm3/min", 6e7),
    "torque_Nm": ("torque of the spindle", "N m", 1.0),
    "power_W": ("power of the spindle", "W", 1.0),
}


class CutExtremes(ResultPart):
    """A figure of a cut: its mean while it cuts, its largest value and when that is."""

    mean: float
    largest: float
    time_s: float


class CutResult(ResultPart):
    """Figures of a cut; `course` has them over the path, `time_s` their times, a few hundred.

    `by_end_m3` is the share of the end of the cutter in `volume_m3`, where it goes down; `end_thrust_N`
    what edges that reach the middle of its end would press it upwards with there, and `force_N` the
    force of its side: largest means over a turn.
    """

    rpm: float
    cutting_speed_m_s: float
    cutting_time_s: float
    volume_m3: float
    by_end_m3: float = 0.0
    end_thrust_N: float = 0.0
    force_N: float = 0.0
    figures: dict[str, CutExtremes]
    limits: dict[str, float] = {}
    time_s: tuple[float, ...]
    course: dict[str, tuple[float, ...]]


# First sentence of whatever is asked about a cut that chatters.
WILL_CHATTER = "This cut will chatter: do not run it."


class CutStability(ResultPart):
    """Stability of the cut along a path, at its worst place.

    Attributes:
        alternative: Depth and speed that would be stable, in words; empty where the cut is.
    """

    sentence: str
    alternative: str = ""
    stable: bool
    time_s: float | None
    rpm: float
    depth_m: float
    limit_m: Unbounded
    frequency_Hz: float
    growth_1_s: float


class MeanForceAcross(ResultPart):
    """Mean force across the feed, to its left, where the cut is near its largest.

    Attributes:
        robot_N: Force on the robot's tool as it really moves [N].
        rigid_N: Force on a tool that keeps its path [N].
    """

    robot_N: float
    rigid_N: float

    @property
    def sentence(self) -> str:
        """The forces in words."""
        return (
            f"Mean force across the feed, to its left, where the cut is near its largest:"
            f" {self.robot_N:.1f} N on the robot, {self.rigid_N:.1f} N on a tool that keeps its path."
        )
