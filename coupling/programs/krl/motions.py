"""Motions of a KRL program: targets in base and tool, postures of lines and splines, times of blocks."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import radians

from coupling.errors import ProgramError
from coupling.programs.angles import pose_of_abc
from coupling.programs.auxiliary_axes import AuxiliaryAxes
from coupling.programs.circles import Turning, add_arc
from coupling.programs.frames import ControllerFrame, PoseFrames
from coupling.programs.krl.values import (
    AXIS_KEYS,
    EXTERNAL_KEYS,
    FRAME_KEYS,
    Aggregate,
    UnknownValueError,
    Value,
    compose_frames,
    describe_value,
    number,
)
from coupling.programs.program import Motion, ProgramMove, rest_behind
from coupling.programs.unknown import Unknown


@dataclass(frozen=True)
class MotionSettings:
    """What holds for motions when one is reached.

    Attributes:
        base, tool: Values of $BASE and $TOOL.
        speed: Speed of the path [m/s]; None where the program sets none.
        keeps_rotation: Whether lines keep the rotation of their begin ($ORI_TYPE=#CONSTANT).
        circle: Value of $CIRC_TYPE.
    """

    base: Value
    tool: Value
    speed: float | None
    keeps_rotation: bool
    circle: Value

    def frames(self, where: str) -> tuple[ControllerFrame, ControllerFrame]:
        """Return base and tool; those that are not known by what they are called."""
        return frame_of("$BASE", self.base, where), frame_of("$TOOL", self.tool, where)


@dataclass
class Motions:
    """Motions of a program so far.

    Attributes:
        moves: They.
        spline: Whether a spline block is open.
    """

    moves: list[ProgramMove] = field(default_factory=list)
    spline: bool = False
    frames: PoseFrames = field(default_factory=PoseFrames)
    _last: Aggregate = field(default_factory=dict)
    _last_frames: tuple[ControllerFrame, ControllerFrame] | None = None
    _axes: Aggregate = field(default_factory=dict)
    _others: AuxiliaryAxes = field(default_factory=AuxiliaryAxes)
    _behind: str = ""
    _has_begun: bool = False
    _block: list[tuple[int, float]] | None = None

    def add(self, motion: Motion, target: Aggregate, settings: MotionSettings, where: str) -> None:
        """Add a motion to a target, a pose or axis angles.

        Raises:
            ProgramError: If it is not known whole, or an external axis moves on the way.
            UnknownValueError: If a component is not known.
        """
        for key in EXTERNAL_KEYS:
            if key in target:
                value = number(target[key], where)
                self._others.take(
                    key, value, where, has_begun=self._has_begun, may_move=motion == "joint"
                )
        if any(key in target for key in AXIS_KEYS):
            self._add_axes(motion, target, where)
            return
        if self._behind:
            raise ProgramError(
                f"{where}: expected no motion behind {self._behind}, which has no value, got one"
            )
        base, tool = settings.frames(where)
        whole = self._whole(target, (base, tool), where)
        if settings.keeps_rotation and motion != "joint":
            whole |= {key: self._require_last_pose(key, (base, tool), where) for key in "ABC"}
        pose = pose_of_abc([number(whole[key], where) for key in FRAME_KEYS])
        if motion != "joint":
            self.frames.begin_line(self.moves, base, tool, where)
        pose = self.frames.express(pose, base, tool, motion != "joint", where)
        self.moves.append(ProgramMove(motion, pose, speed=settings.speed, where=where))
        self._last, self._last_frames, self._has_begun, self._axes = whole, (base, tool), True, {}

    def add_arc(
        self,
        via: Aggregate,
        target: Aggregate,
        turning: Turning,
        angle: float | None,
        settings: MotionSettings,
        where: str,
    ) -> None:
        """Add an arc through a place, to a target or on by an angle [deg].  Raises as `add`."""
        if settings.circle != "#BASE":
            raise ProgramError(
                f"{where}: expected $CIRC_TYPE=#BASE, got {describe_value(settings.circle)}: write lines"
            )
        frames = settings.frames(where)
        place = self._whole({key: via[key] for key in "XYZ" if key in via}, frames, where)
        self.add("linear", target, settings, where)
        end, place = self.moves.pop(), place | {key: self._last[key] for key in "ABC"}
        pose = pose_of_abc([number(place[key], where) for key in FRAME_KEYS])
        pose = self.frames.express(pose, *frames, True, where)
        add_arc(self.moves, pose, end, turning, None if angle is None else radians(angle))
        if angle is not None:
            self._last = {}

    def add_relative(
        self,
        motion: Motion,
        step: Aggregate,
        in_tool: bool,
        settings: MotionSettings,
        where: str,
    ) -> None:
        """Add a motion by a step from the last target, along the axes of the base or of the tool.

        Raises:
            ProgramError: If the step turns the tool, or the last target is not known.
        """
        if motion == "joint" and any(key in step for key in AXIS_KEYS):
            raise UnknownValueError(Unknown("where the axes are"))
        rotated = [
            key
            for key in ("A", "B", "C", *AXIS_KEYS, *EXTERNAL_KEYS)
            if key in step and number(step[key], where) != 0.0
        ]
        if rotated:
            raise ProgramError(
                f"{where}: expected a relative motion along X, Y, Z, got {rotated[0]}: write its target"
            )
        base, tool = settings.frames(where)
        if len(self._last) < len(FRAME_KEYS) or self._last_frames != (base, tool):
            raise ProgramError(
                f"{where}: expected a pose in this base and tool before a relative motion, got none:"
                " write its target"
            )
        shift: Aggregate = {key: number(step.get(key, 0.0), where) for key in "XYZ"}
        if in_tool:
            target = compose_frames(self._last, shift, where)
            target |= {key: self._last[key] for key in "ABC"}
        else:
            target = {
                key: number(self._last[key], where) + number(shift[key], where) for key in "XYZ"
            }
        self.add(motion, target, settings, where)

    def come_to_rest(self, seconds: float = 0.0) -> None:
        """Come to rest behind the last motion, and wait [s]."""
        if not self._behind:
            rest_behind(self.moves, seconds)

    def begin_again(self) -> None:
        """Take a motion to an unknown place as one that leads to the path again."""
        self._has_begun, self._behind = False, ""

    def leave(self, text: str) -> bool:
        """Return whether a motion by axes to an unknown place only leads to or from the path."""
        if self.spline or self._block is not None:
            return False
        if self._has_begun:
            self._behind = text
        else:
            self._axes = {}
        return True

    def _add_axes(self, motion: Motion, target: Aggregate, where: str) -> None:
        if motion == "linear":
            raise ProgramError(f"{where}: expected a pose for a line, got axis angles")
        self._axes = self._axes | {key: target[key] for key in AXIS_KEYS if key in target}
        missing = [key for key in AXIS_KEYS if key not in self._axes]
        if missing:
            raise UnknownValueError(Unknown(missing[0]))
        angles = tuple(radians(number(self._axes[key], where)) for key in AXIS_KEYS)
        self.moves.append(ProgramMove(motion, joints=angles, where=where))
        self._last = {}

    def _whole(
        self, target: Aggregate, frames: tuple[ControllerFrame, ControllerFrame], where: str
    ) -> Aggregate:
        """Return all components of a pose; those that are left out stay what they were."""
        missing = [key for key in FRAME_KEYS if key not in target]
        if missing and self._last and self._last_frames != frames:
            raise ProgramError(
                f"{where}: expected X, Y, Z, A, B, C behind a change of $BASE or $TOOL, got none of"
                f" {', '.join(missing)}"
            )
        whole = self._last | {key: target[key] for key in FRAME_KEYS if key in target}
        missing = [key for key in FRAME_KEYS if key not in whole]
        if missing:
            raise ProgramError(
                f"{where}: expected X, Y, Z, A, B, C, got none of {', '.join(missing)}"
            )
        return whole

    def _require_last_pose(
        self, key: str, frames: tuple[ControllerFrame, ControllerFrame], where: str
    ) -> Value:
        if key not in self._last or self._last_frames != frames:
            raise ProgramError(
                f"{where}: expected a pose in this base and tool before a line that keeps its rotation"
                " ($ORI_TYPE=#CONSTANT), got none"
            )
        return self._last[key]

    def begin_times(self, where: str) -> None:
        """Begin a block whose times are set."""
        if self._block is not None:
            raise ProgramError(f"{where}: expected START, then PART and END, got START")
        self._block = [(len(self.moves), 0.0)]

    def share_time(self, share: float, where: str) -> None:
        """Give the last segment its share of the block's time."""
        block = self._positive(share, "PART", where)
        if len(self.moves) != block[-1][0] + 1:
            raise ProgramError(
                f"{where}: expected a TIME_BLOCK PART behind every segment, got"
                f" {len(self.moves) - block[-1][0]} segments since the last one"
            )
        block.append((len(self.moves), share))

    def end_times(self, total: float, where: str) -> None:
        """End the block: its segments take their shares of this time [s]."""
        shares = self._positive(total, "END", where)[1:]
        if not shares or shares[-1][0] != len(self.moves):
            raise ProgramError(f"{where}: expected segments, each with its PART, got others")
        whole = sum(share for _, share in shares)
        for count, share in shares:
            move = self.moves[count - 1]
            self.moves[count - 1] = replace(move, duration=total * share / whole, speed=None)
        self._block = None

    def _positive(self, value: float, kind: str, where: str) -> list[tuple[int, float]]:
        if self._block is None:
            raise ProgramError(f"{where}: expected START, then PART and END, got {kind}")
        if value <= 0.0:
            raise ProgramError(f"{where}: expected a time > 0, got {value:g}")
        return self._block

    def open_spline(self, is_open: bool, where: str) -> None:
        """Open or close a spline block."""
        word = "SPLINE" if is_open else "ENDSPLINE"
        self.require_no_block(where, word)
        if is_open == self.spline:
            raise ProgramError(
                f"{where}: expected {'ENDSPLINE' if is_open else 'SPLINE'} before it, got {word}"
            )
        self.spline = is_open

    def require_no_block(self, where: str, got: str) -> None:
        """Refuse what must not stand within a block of times."""
        if self._block is not None:
            raise ProgramError(f"{where}: expected TIME_BLOCK END, got {got}")


def frame_of(name: str, value: Value, where: str) -> ControllerFrame:
    """Return base or tool; one that is not known by what it is called."""
    if isinstance(value, Unknown):
        return ControllerFrame(_name_unknown(value), None)
    if not isinstance(value, dict):
        raise ProgramError(f"{where}: expected a frame as {name}, got {describe_value(value)}")
    missing = [key for key in FRAME_KEYS if key not in value]
    if missing:
        raise ProgramError(f"{where}: expected X, Y, Z, A, B, C of {name}, got no {missing[0]}")
    try:
        return ControllerFrame(name, pose_of_abc([number(value[key], where) for key in FRAME_KEYS]))
    except UnknownValueError:
        parts = ((key, value[key]) for key in FRAME_KEYS)
        words = (
            f"{key} {_name_unknown(part) if isinstance(part, Unknown) else describe_value(part)}"
            for key, part in parts
        )
        return ControllerFrame(f"{name}={{{', '.join(words)}}}", None)


def _name_unknown(value: Unknown) -> str:
    """Return a name that tells a value from others."""
    return f"{value.name} (statement {value.step})" if value.step else value.name
