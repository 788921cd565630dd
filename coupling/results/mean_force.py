"""Mean force of a cut across its feed."""

from __future__ import annotations

from coupling.results.base import ResultPart


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
