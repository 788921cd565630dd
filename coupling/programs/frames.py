"""Base and tool of a program's poses: all are expressed in those of its first line."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from coupling.errors import ProgramError
from coupling.programs.poses import inverse, product
from coupling.programs.program import Pose, ProgramMove

# Components of two unit quaternions x, y, z, w that are one but for single precision.
_QUATERNION_TOLERANCE = 1e-6


@dataclass(frozen=True)
class ControllerFrame:
    """A base or a tool as a program chooses it.

    Attributes:
        name: Word that tells it from others, such as `$BASE` or `UFRAME 3`.
        pose: Its pose, of a base in the robot's, of a tool in the flange's; None where the
            controller holds it and the program does not tell.
    """

    name: str
    pose: Pose | None


@dataclass
class PoseFrames:
    """Expresses the poses of a program in base and tool of its first line.

    Attributes:
        base, tool: Frames of the first line, before it those of the first pose; None before that.
    """

    base: ControllerFrame | None = None
    tool: ControllerFrame | None = None
    _last: tuple[Pose, ControllerFrame] | None = field(default=None, repr=False)
    _has_line: bool = field(default=False, repr=False)

    def begin_line(
        self, moves: list[ProgramMove], base: ControllerFrame, tool: ControllerFrame, where: str
    ) -> None:
        """Take base and tool of the first line, and express the moves in them that led there.

        Raises:
            ProgramError: If these are in others, and the program does not tell them all.
        """
        is_first, self._has_line = not self._has_line, True
        if not is_first or self.base is None or self.tool is None:
            return
        before, self.base, self.tool = (self.base, self.tool), base, tool
        for number, move in enumerate(moves):
            if move.pose is not None and before != (base, tool):
                pose = self.express(move.pose, *before, False, where)
                moves[number] = replace(move, pose=pose)

    def express(
        self, pose: Pose, base: ControllerFrame, tool: ControllerFrame, linear: bool, where: str
    ) -> Pose:
        """Return a pose in base and tool of the path.

        Args:
            pose: Pose of the tool in the base.
            base: Base that it stands in.
            linear: Whether the tool goes there on a line.  Where the tool is not the first one, that is
                a line of the first one only if the tool keeps its rotation.
            where: Place in the program, for the message.

        Raises:
            ProgramError: If base or tool are others than at first and the program does not tell both.
        """
        self.base, self.tool = self.base or base, self.tool or tool
        base_pose = pose
        if base != self.base:
            first, other = _both("base", self.base, base, where)
            base_pose = product(product(inverse(first), other), pose)
        first_pose = base_pose
        if tool != self.tool:
            first, other = _both("tool", self.tool, tool, where)
            first_pose = product(base_pose, product(inverse(other), first))
            if linear and self._last is not None and _turns(self._last[0], first_pose):
                raise ProgramError(
                    f"{where}: expected one tool for moves in which it turns, got {tool.name} behind"
                    f" {self.tool.name}"
                )
        self._last = first_pose, tool
        return first_pose


def _both(
    what: str, first: ControllerFrame, other: ControllerFrame, where: str
) -> tuple[Pose, Pose]:
    """Return the poses of two frames that differ."""
    if first.pose is None or other.pose is None:
        unknown = first if first.pose is None else other
        raise ProgramError(
            f"{where}: expected one {what} for all poses, got {other.name} behind {first.name}, and"
            f" the program does not say where {unknown.name} is: write its numbers into the program"
        )
    return first.pose, other.pose


def _turns(a: Pose, b: Pose) -> bool:
    """Return whether two poses have different rotations."""
    return max(abs(x - y) for x, y in zip(a[3:], b[3:], strict=True)) > _QUATERNION_TOLERANCE
