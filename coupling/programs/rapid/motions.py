"""Motions of a RAPID program: targets in base and tool of the first one, speeds and times."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from coupling.errors import ProgramError
from coupling.programs.auxiliary_axes import AuxiliaryAxes
from coupling.programs.circles import add_arc
from coupling.programs.frames import ControllerFrame, PoseFrames
from coupling.programs.poses import product, turn_between
from coupling.programs.program import HERE, Motion, Pose, ProgramMove, rest_behind
from coupling.programs.rapid.predefined import HIGHEST
from coupling.programs.rapid.values import (
    NO_AXIS,
    Value,
    format_value,
    numbers_of,
    pose_of,
)
from coupling.programs.reading import ReadingNotes
from coupling.programs.unknown import Unknown

# Radius of the smallest zone [mm], which is passed as if it were the target.
_SMALLEST_ZONE = 0.3


@dataclass(frozen=True)
class MoveFrames:
    """Tool and work object of a motion.

    Attributes:
        tool_name, object_name: Their names in the program.
        tool, work_object: Their values; None where the controller holds them.
    """

    tool_name: str
    tool: Value | None
    object_name: str = "wobj0"
    work_object: Value | None = None


@dataclass(frozen=True)
class Pace:
    r"""What a motion says of its speed.

    Attributes:
        speed: Speed data; not known where only the controller knows them.
        tcp: Speed of the TCP that is written in their place, `\V` [mm/s].
        time: Time of the motion, `\T` [s].
    """

    speed: Value
    tcp: float | None = None
    time: float | None = None


@dataclass
class RapidMotions:
    """Motions up to here, and what the next ones are subject to.

    Attributes:
        notes: Assumptions.
        displacement: Program displacement in the work object.
        override: Share of the programmed speeds, 1 for all.
        highest: Highest speed of the TCP [mm/s].
        circle: Option of CirPathMode, how the tool turns on arcs.
    """

    notes: ReadingNotes
    moves: list[ProgramMove] = field(default_factory=list)
    displacement: Pose = HERE
    override: float = 1.0
    highest: float = math.inf
    circle: str = "PATHFRAME"
    frames: PoseFrames = field(default_factory=PoseFrames)
    widest_zone: float = 0.0
    _first: tuple[ControllerFrame, ControllerFrame] | None = None
    _others: AuxiliaryAxes = field(default_factory=AuxiliaryAxes)
    _last: Pose | None = None
    _poses: dict[Value, Pose] = field(default_factory=dict)

    def to_joints(self, target: Value, frames: MoveFrames, pace: Pace, where: str) -> None:
        """Add a motion to a jointtarget.

        Raises:
            ProgramError: If it is none that is known.
        """
        assert isinstance(target, tuple)
        self._note_external(target[1], where)
        angles = numbers_of(target[0], "axes", where)
        self._begin(frames, where)
        duration = self._duration(pace, where)
        joints = tuple(math.radians(1.0) * angle for angle in angles)
        self.moves.append(ProgramMove("joint", joints=joints, duration=duration, where=where))
        self._last = None

    def to_pose(
        self,
        motion: Motion,
        target: Value,
        frames: MoveFrames,
        pace: Pace,
        where: str,
        via: Value | None = None,
    ) -> None:
        """Add a motion to a robtarget, on an arc where there is another one.  Raises as `to_joints`."""
        assert isinstance(target, tuple)
        self._note_external(target[3], where)
        base, tool = self._begin(frames, where)
        is_line = motion == "linear"
        if is_line:
            self.frames.begin_line(self.moves, base, tool, where)
            self._last = self.moves[-1].pose if self._last and self.moves else None

        def placed(target: Value) -> Pose:
            pose = pose_of(target, where)
            pose = pose if self.displacement == HERE else product(self.displacement, pose)
            return self.frames.express(pose, base, tool, is_line, where)

        pose, first = placed(target[:2]), len(self.moves)
        move = ProgramMove(motion, pose, duration=self._duration(pace, where), where=where)
        if via is None:
            self.moves.append(move)
        else:
            assert isinstance(via, tuple)
            # How the tool is held there is not looked at.
            self._add_arc(placed((via[0], target[1])), move)
        if move.duration is None:
            speed = self._speed(motion, pace, self.moves[first].pose or pose, where)
            self.moves[first:] = [replace(chord, speed=speed) for chord in self.moves[first:]]
        self._last = pose

    def _add_arc(self, via: Pose, end: ProgramMove) -> None:
        if self.circle != "PATHFRAME":
            raise ProgramError(
                f"{end.where}: expected CirPathMode\\PathFrame, got \\{self.circle.capitalize()}: write"
                " lines"
            )
        add_arc(self.moves, via, end, "path")

    def displace(self, displacement: Pose) -> None:
        """Set the program displacement of the next motions."""
        self.displacement = displacement

    def note_zone(self, zone: Value, radius: float | None) -> None:
        """Note how far from its target the last motion may stay, or that it stops there."""
        if isinstance(zone, tuple) and zone[0] is True:
            rest_behind(self.moves)
        if radius is None and isinstance(zone, tuple) and zone[0] is False:
            radius = zone[1] if isinstance(zone[1], float) else None
        self.widest_zone = max(self.widest_zone, radius or 0.0)

    @property
    def base(self) -> Pose | None:
        """Base of all poses, in the world; None where the controller holds it."""
        base = self.frames.base or (self._first[0] if self._first else None)
        return base.pose if base else None

    @property
    def tool(self) -> Pose | None:
        """Tool of all poses, likewise."""
        tool = self.frames.tool or (self._first[1] if self._first else None)
        return tool.pose if tool else None

    def assume_zones(self) -> None:
        """Say that zones are not rounded, where there are wide ones."""
        if self.widest_zone > _SMALLEST_ZONE:
            self.notes.assume(
                f"zones, up to {self.widest_zone:g} mm, are not rounded: the path goes through every"
                " target"
            )

    def _begin(self, frames: MoveFrames, where: str) -> tuple[ControllerFrame, ControllerFrame]:
        base, tool = self._base(frames, where), self._tool(frames, where)
        # Frames of other names with the same numbers are the same.
        if self.frames.base is not None and base.pose is not None:
            base = self.frames.base if base.pose == self.frames.base.pose else base
        if self.frames.tool is not None and tool.pose is not None:
            tool = self.frames.tool if tool.pose == self.frames.tool.pose else tool
        self._first = self._first or (base, tool)
        return base, tool

    def _base(self, frames: MoveFrames, where: str) -> ControllerFrame:
        name, value = frames.object_name, frames.work_object
        if value is None:
            self.notes.assume(
                f"work object {name}, which the controller holds, stands still in the world"
            )
            return ControllerFrame(name, None)
        assert isinstance(value, tuple)
        is_held, is_fixed, unit, user, placed = value
        place = f"{where}: work object {name}"
        if is_held is not False:
            raise ProgramError(
                f"{place}: expected one in the world, robhold FALSE, got {format_value(is_held)}: parts"
                " that the robot holds are not read"
            )
        if is_fixed is not True:
            raise ProgramError(
                f"{place}: expected one that stands still, ufprog TRUE, got {format_value(is_fixed)},"
                f" moved by {format_value(unit)}: write targets in a work object that stands still"
            )
        return ControllerFrame(name, product(self._pose(user, place), self._pose(placed, place)))

    def _tool(self, frames: MoveFrames, where: str) -> ControllerFrame:
        name, value = frames.tool_name, frames.tool
        if value is None:
            return ControllerFrame(name, None)
        assert isinstance(value, tuple)
        place = f"{where}: tool {name}"
        if value[0] is not True:
            raise ProgramError(
                f"{place}: expected one that the robot holds, robhold TRUE, got"
                f" {format_value(value[0])}: stationary tools are not read"
            )
        return ControllerFrame(name, self._pose(value[1], place))

    def _pose(self, value: Value, place: str) -> Pose:
        if value not in self._poses:
            self._poses[value] = pose_of(value, place)
        return self._poses[value]

    def _note_external(self, values: Value, where: str) -> None:
        """Refuse external axes that move."""
        assert isinstance(values, tuple)
        for letter, value in zip("abcdef", values, strict=False):
            if value == NO_AXIS:
                continue
            axis = f"external axis eax_{letter}"
            (place,) = numbers_of(value, axis, where)
            self._others.take(axis, place, where, has_begun=bool(self.moves))
            if self._others.values[axis] != 0.0:
                self.notes.assume(f"{axis} stays at {self._others.values[axis]:g}")

    def _duration(self, pace: Pace, where: str) -> float | None:
        if pace.time is None:
            return None
        if pace.time <= 0.0:
            raise ProgramError(f"{where}: expected a time \\T > 0, got {pace.time:g}")
        return pace.time if self.override == 1.0 else pace.time / self.override

    def _speed(self, motion: Motion, pace: Pace, pose: Pose, where: str) -> float | None:
        """Return the speed of the TCP [m/s], which its turning may slow down; None for vmax."""
        if isinstance(pace.speed, Unknown):
            return None
        assert isinstance(pace.speed, tuple)
        share = self.override
        tcp = pace.speed[0] if pace.tcp is None else pace.tcp
        if tcp is HIGHEST:
            return None if self.highest == math.inf else 1e-3 * self.highest
        (millimetres,) = numbers_of(tcp, "a speed", where)
        if millimetres <= 0.0:
            if motion == "joint":
                return None
            raise ProgramError(f"{where}: expected a speed > 0, got {millimetres:g}")
        speed = 1e-3 * min(share * millimetres, self.highest)
        if motion == "linear" and self._last is not None:
            (turning,) = numbers_of(pace.speed[1], "a speed of turning", where)
            speed = min(speed, _slowest(self._last, pose, share * math.radians(turning), speed))
        return speed


def _slowest(last: Pose, pose: Pose, turning: float, speed: float) -> float:
    """Return the speed at which a tool that turns at `turning` [rad/s] is there in time."""
    angle, length = turn_between(last, pose), math.dist(last[:3], pose[:3])
    if turning <= 0.0 or angle * speed <= length * turning or length == 0.0:
        return speed
    return length * turning / angle
