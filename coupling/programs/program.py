"""A robot program, in no maker's words."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import degrees
from typing import Literal

# "joint": all joints run from target to target in proportion; "linear": the TCP goes straight and its
# rotation turns about one axis; "spline": a smooth curve, of poses or of joint angles, goes through this
# target and its neighbours.
Motion = Literal["joint", "linear", "spline"]

# x, y, z [m], qx, qy, qz, qw.
Pose = tuple[float, ...]
HERE: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
# Decimals that programs write: 0.1 um and 0.2 urad, about what a controller's number holds; FANUC's
# itself writes 3 of each and keeps more.
MM_DECIMALS, DEGREE_DECIMALS = 4, 5


@dataclass(frozen=True)
class Configuration:
    """Choice among the postures that put the tool in one place.

    Attributes:
        behind: The wrist's centre is behind axis 1.
        below: The wrist's centre is below the line from axis 2 to axis 3: the elbow points down.
        wrist: Sign of joint 5's angle, 1 or -1.
        angles: Angles of the controller's joints, from which its turns follow [rad], to the digits
            that programs write: a joint that is off zero by rounding alone is not in the turn below.

    Example:
        >>> Configuration(False, False, -1, (1.7, 0.0, 0.0, -0.1, -1.0, 7.0)).quadrants
        (1, -1, 4)
        >>> Configuration(False, False, -1, (0.0, 0.0, 0.0, -4.0, -1.0, 7.0)).turns
        (0, -1, 1)
        >>> Configuration(False, False, -1, (-0.1, -1.6, 1.8, 0.0, -0.2, 0.0)).status
        6
        >>> Configuration(False, False, -1, (-0.1, -1.6, 1.8, 0.0, -0.2, -1e-9)).turn
        19
    """

    behind: bool
    below: bool
    wrist: int
    angles: tuple[float, ...]

    @property
    def quadrants(self) -> tuple[int, int, int]:
        """Quarter turn in which joints 1, 4 and 6 are, 0 from zero to 90 deg."""
        axis_1, axis_4, axis_6 = (int(self._angle_in_degrees(i) // 90.0) for i in (0, 3, 5))
        return axis_1, axis_4, axis_6

    @property
    def status(self) -> int:
        """KUKA's S: 1 behind axis 1, 2 elbow above the line to the wrist, 4 joint 5 negative."""
        return self.behind + 2 * (not self.below) + 4 * (self.wrist < 0)

    @property
    def turn(self) -> int:
        """KUKA's T: a bit for each joint, the first the lowest, one where its angle is negative."""
        return sum(1 << i for i in range(len(self.angles)) if self._angle_in_degrees(i) < 0.0)

    @property
    def turns(self) -> tuple[int, int, int]:
        """Whole turn in which joints 1, 4 and 6 are, 0 from -180 to 180 deg."""
        axis_1, axis_4, axis_6 = (
            int((self._angle_in_degrees(i) + 180.0) // 360.0) for i in (0, 3, 5)
        )
        return axis_1, axis_4, axis_6

    def _angle_in_degrees(self, joint: int) -> float:
        """Return a joint's angle as a program writes it [deg]."""
        return round(degrees(self.angles[joint]), DEGREE_DECIMALS)


@dataclass(frozen=True)
class ProgramMove:
    """One motion of a program, to a target.

    Attributes:
        motion: Motion by which the robot comes there.
        pose: Target of the TCP in the program's base frame; None where the target is joint angles.
        joints: Target as angles of the controller's joints [rad]; None where it is a pose.
        duration: Time from the last target [s]; None where a speed is programmed instead.
        speed: Programmed speed of the TCP [m/s]; None where there is none.
        configuration: Posture at a pose, where it is written.
        is_stop: Whether the robot comes to rest there, as the program says.
        wait: Time that it then stands [s].
        where: File and line, for messages; empty where it is not read from one.

    Raises:
        ValueError: If there is not one target.
    """

    motion: Motion
    pose: Pose | None = None
    joints: tuple[float, ...] | None = None
    duration: float | None = None
    speed: float | None = None
    configuration: Configuration | None = None
    is_stop: bool = False
    wait: float = 0.0
    where: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        if (self.pose is None) == (self.joints is None):
            raise ValueError("move: expected either a pose or joint angles")


def rest_behind(moves: list[ProgramMove], seconds: float = 0.0) -> None:
    """Let the robot come to rest behind the last of some moves, and stand there [s]."""
    if moves:
        wait = moves[-1].wait + max(seconds, 0.0)
        moves[-1] = replace(moves[-1], is_stop=True, wait=wait)


@dataclass(frozen=True)
class RobotProgram:
    """A robot program: frames and motions.

    Attributes:
        name: Name by which a controller calls it.
        moves: Motions in their order.  The first ones lead to the path and have no duration.
        base: Base frame of the poses in that of the robot, as the program sets it; None where it
            does not, or names one that the controller holds.
        tool: TCP in the frame of the robot's flange, likewise.
        left_out: Words of statements that a reader left out because they do not change the path, each
            with how often it stands there.
        assumptions: Sentences on what a reader assumed where the program decides at run time.

    Example:
        >>> start = ProgramMove("joint", joints=(0.0, 0.1))
        >>> program = RobotProgram("way", (start, ProgramMove("joint", joints=(0.0, 0.2), duration=0.5)))
        >>> len(program.timed), program.timed[0] is start
        (2, True)
    """

    name: str
    moves: tuple[ProgramMove, ...]
    base: Pose | None = None
    tool: Pose | None = None
    left_out: tuple[tuple[str, int], ...] = ()
    assumptions: tuple[str, ...] = ()

    @property
    def timed(self) -> tuple[ProgramMove, ...]:
        """The motions whose time is set, and before them the one that leads to their start."""
        untimed = [k for k, move in enumerate(self.moves) if move.duration is None]
        return self.moves[untimed[-1] :] if untimed else self.moves


@dataclass(frozen=True)
class ProgramFile:
    """A file of a program.

    Attributes:
        name: File name with its ending.
        text: Content.
    """

    name: str
    text: str
