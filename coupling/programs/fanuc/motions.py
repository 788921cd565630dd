"""Motions of FANUC programs: targets with all offsets, times, and what is done on the way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import degrees

from coupling.errors import ProgramError
from coupling.programs.auxiliary_axes import STANDSTILL, AuxiliaryAxes
from coupling.programs.fanuc.arcs import ArcRun, add_circular
from coupling.programs.fanuc.harmless import CALL, first_effect, is_harmless, left_out_word
from coupling.programs.fanuc.memory import LastTarget, Registers
from coupling.programs.fanuc.motion_statements import MotionInstruction, MotionOption
from coupling.programs.fanuc.positions import TpPosition, cartesian_of
from coupling.programs.fanuc.running import RunningProgram
from coupling.programs.fanuc.syntax import TpText
from coupling.programs.frames import PoseFrames
from coupling.programs.poses import product, turn_between
from coupling.programs.program import Motion, ProgramMove, rest_behind
from coupling.programs.text import shorten

_RADIANS = 0.017453292519943295
# Speeds in m/s for one unit, and times in seconds.
_PACES = {"mm/sec": 1e-3, "cm/min": 1e-2 / 60.0, "inch/min": 0.0254 / 60.0}
_TIMES = {"sec": 1.0, "msec": 1e-3}


@dataclass
class TpDriver:
    """Makes moves of motions.

    Attributes:
        registers: State of the controller.
        files: Programs that are there, by their names in capitals.
        moves: Moves up to now.
        frames: Expresses poses in the first frames.
        others: Places of the axes beside the robot's.
        arcs: Motions A up to now, if the last one is one.
    """

    registers: Registers
    files: Mapping[str, TpText]
    moves: list[ProgramMove] = field(default_factory=list)
    frames: PoseFrames = field(default_factory=PoseFrames)
    others: AuxiliaryAxes = field(default_factory=AuxiliaryAxes)
    arcs: ArcRun = field(default_factory=ArcRun)

    def move(self, running: RunningProgram, motion: MotionInstruction, where: str) -> None:
        """Make a move of a motion.

        Args:
            running: The program that it stands in.
            where: Its place, for messages.

        Raises:
            ProgramError: If its target or its pace is not known, or other axes move.
        """
        if not running.text.moves_robot:
            raise ProgramError(
                f"{where}: expected motions of group 1, the robot, got a program of other groups"
            )
        if motion.letter != "A":
            self.arcs.finish()
        position = self._target(running, motion, where)
        for option in motion.options:
            if option.kind == "left out":
                self.registers.notes.leave_out(option.words)
            elif option.kind == "call":
                self._on_the_way(option.argument, where)
        for name, value in position.others:
            self.others.take(name, value, where, has_begun=bool(self.moves))
        duration, speed = self._pace(running, motion, position, where)
        registers = self.registers
        base, tool = registers.frame("UFRAME"), registers.frame("UTOOL")
        if position.is_joint:
            if motion.letter != "J":
                raise ProgramError(
                    f"{where}: expected X, Y, Z, W, P, R for a line, got joint angles: teach the"
                    " position as such, or write J"
                )
            joints = tuple(_RADIANS * angle for angle in position.values)
            self.moves.append(
                ProgramMove("joint", joints=joints, duration=duration, speed=speed, where=where)
            )
        else:
            kind: Motion = "joint" if motion.letter == "J" else "linear"
            if kind == "linear":
                self.frames.begin_line(self.moves, base, tool, where)
            pose = self.frames.express(position.pose, base, tool, kind == "linear", where)
            end = ProgramMove(kind, pose, duration=duration, speed=speed, where=where)
            if motion.via is not None:
                via = self._taught(running, *motion.via, where)
                if via.is_joint:
                    raise ProgramError(
                        f"{where}: expected X, Y, Z, W, P, R for an arc, got joint angles: teach the"
                        " position as such"
                    )
                add_circular(
                    self.moves, self.frames.express(via.pose, base, tool, False, where), end
                )
            elif motion.letter == "A":
                self.arcs.add(self.moves, end)
            else:
                self.moves.append(end)
        if motion.is_stop:
            rest_behind(self.moves)
        registers.last = LastTarget(position, base, tool)

    def _target(self, running: RunningProgram, motion: MotionInstruction, where: str) -> TpPosition:
        """Return the target of a motion with its offsets."""
        position = self._taught(running, motion.register, motion.index, where)
        if any(option.kind == "incremental" for option in motion.options):
            last = self.registers.last_position(where)
            self._require_one_kind(last, position, "INC", where)
            target = self.registers.last and self.registers.last.position
            if target and target.is_tilted_over and any(position.values[3:]):
                tilt = target.values[4]
                raise ProgramError(
                    f"{where}: expected a position of P within 90 deg before INC, got {tilt:g}: the"
                    " controller holds it by other angles, to which it adds; teach the position"
                )
            position = position.plus(last.values)
            # The last target has no other axes; those of an increment are zero where they stand.
            position = TpPosition(
                position.values, position.is_joint, others=self._moved_others(position, where)
            )
        for option in motion.options:
            if option.kind == "offset":
                position = self._offset(running, option, position, where)
        for option in motion.options:
            if option.kind == "tool_offset":
                position = self._tool_offset(running, option, position, where)
        return position

    def _taught(
        self, running: RunningProgram, register: str, number: str, where: str
    ) -> TpPosition:
        """Return a position as it is taught, or of a register."""
        index = running.index(number, where)
        if register == "PR":
            return self.registers.position(index, where)
        position = running.taught(index, where)
        self.registers.require_frames(position, where)
        return position

    def _moved_others(self, position: TpPosition, where: str) -> tuple[tuple[str, float], ...]:
        for name, value in position.others:
            if abs(value) > STANDSTILL:
                raise ProgramError(
                    f"{where}: expected {name} to stand, got an increment of {value:g}: the robot"
                    " alone is moved"
                )
        return ()

    def _shift(
        self, running: RunningProgram, option: MotionOption, word: str, where: str
    ) -> TpPosition:
        """Return the position register that an option shifts a target by."""
        if option.argument:
            return self.registers.position(running.index(option.argument, where), where)
        if word not in running.offsets:
            raise ProgramError(
                f"{where}: expected {word} CONDITION PR[] before {option.words}, got none"
            )
        return self.registers.position(running.offsets[word], where)

    def _offset(
        self, running: RunningProgram, option: MotionOption, position: TpPosition, where: str
    ) -> TpPosition:
        shift = self._shift(running, option, "OFFSET", where)
        self._require_one_kind(position, shift, "Offset", where)
        if not shift.is_joint and any(shift.values[3:]):
            self.registers.notes.assume(
                "W, P, R of an Offset are added to those of its target ($OFFSET_CART=FALSE)"
            )
        return position.plus(shift.values)

    def _tool_offset(
        self, running: RunningProgram, option: MotionOption, position: TpPosition, where: str
    ) -> TpPosition:
        shift = self._shift(running, option, "TOOL_OFFSET", where)
        if position.is_joint or shift.is_joint:
            raise ProgramError(
                f"{where}: expected X, Y, Z, W, P, R with Tool_Offset, got joint angles: teach the"
                " position as such"
            )
        pose = product(position.pose, shift.pose)
        return TpPosition(cartesian_of(pose), others=position.others)

    def _require_one_kind(self, a: TpPosition, b: TpPosition, word: str, where: str) -> None:
        if a.is_joint != b.is_joint or len(a.values) != len(b.values):
            raise ProgramError(
                f"{where}: expected {word} and its target both as X, Y, Z, W, P, R or both as joint"
                " angles, got one of each, which the robot alone can add"
            )

    def _on_the_way(self, action: str, where: str) -> None:
        """Take what is done during a motion: outputs, or a program of outputs."""
        if action.upper() == "P-SPS":
            return
        if (call := CALL.fullmatch(action)) is None:
            self.registers.notes.leave_out(left_out_word(action) or action)
            return
        name = call[1]
        if name.upper() not in self.files:
            raise ProgramError(
                f"{where}: expected a file {name}.ls beside the program, got none for {action}: put it"
                " there, or remove the option if it does not move the robot"
            )
        if not is_harmless(name, self.files):
            raise moving_program(name, self.files, where)
        self.registers.notes.leave_out("CALL of outputs")

    def _pace(
        self, running: RunningProgram, motion: MotionInstruction, position: TpPosition, where: str
    ) -> tuple[float | None, float | None]:
        """Return time [s] and speed [m/s] of a motion, whichever it has."""
        if motion.unit in ("%", ""):
            return None, None
        number = running.require_number(motion.speed, where)
        if number <= 0.0:
            raise ProgramError(f"{where}: expected a speed or a time > 0, got {number:g}")
        if motion.unit in _TIMES:
            return _TIMES[motion.unit] * number / self.registers.override, None
        if motion.unit in _PACES:
            return None, _PACES[motion.unit] * number * self.registers.override
        last = self.registers.last_position(where)
        is_joint = last.is_joint or position.is_joint
        angle = 0.0 if is_joint else degrees(turn_between(last.pose, position.pose))
        if angle == 0.0:
            raise ProgramError(
                f"{where}: expected a turn from the last pose for deg/sec, got none: write mm/sec"
            )
        return angle / (number * self.registers.override), None


def moving_program(name: str, files: Mapping[str, TpText], where: str) -> ProgramError:
    """Return the refusal of a program that does more than outputs while the robot moves."""
    words = first_effect(name, files)
    return ProgramError(
        f"{where}: expected outputs and waits alone in {name}, which runs during a motion, got"
        f" {shorten(words)!r}: call it before or after the motion"
    )
