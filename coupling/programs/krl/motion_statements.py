"""Statements of KRL that move, and those that set what motions depend on."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from coupling.errors import ProgramError
from coupling.programs.circles import Turning
from coupling.programs.krl.controller import KrlController
from coupling.programs.krl.expressions import Call, Constant, Expression, Reference
from coupling.programs.krl.harmless import HARMLESS_SPEEDS, HARMLESS_VARIABLES
from coupling.programs.krl.motions import Motions, MotionSettings
from coupling.programs.krl.parser import leading, parse_expression
from coupling.programs.krl.syntax import KrlLine
from coupling.programs.krl.values import (
    Aggregate,
    UnknownValueError,
    Value,
    describe_value,
    null_frame,
    number,
)
from coupling.programs.program import Motion
from coupling.programs.text import shorten
from coupling.programs.unknown import Unknown

_MOTIONS: dict[str, Motion] = {
    "PTP": "joint",
    "SPTP": "joint",
    "LIN": "linear",
    "SLIN": "linear",
    "SPL": "spline",
}
_RELATIVE = {f"{word}_REL": motion for word, motion in _MOTIONS.items()}
_ROUNDED = frozenset(("C_DIS", "C_VEL", "C_ORI", "C_PTP", "C_SPL"))
_ANGLE = re.compile(r"\s*,\s*CA\s+(.*)", re.IGNORECASE)
_CLAUSES = re.compile(r"\bWITH\b", re.IGNORECASE)
_WAIT = re.compile(r"WAIT\s+SEC\b(.*)", re.IGNORECASE)
_BLOCK = re.compile(r"TIME_BLOCK\s+(START|PART\s*=|END\s*=)\s*(.*)", re.IGNORECASE)


@dataclass
class MotionStatements:
    """Executes motions, spline blocks, and the pendant's routine BAS.

    Attributes:
        controller: State of the program.
        motions: Motions so far.
    """

    controller: KrlController
    motions: Motions = field(default_factory=Motions)
    _before_spline: list[Value] = field(default_factory=list)

    @property
    def executed(self) -> dict[str, Callable[[KrlLine], None]]:
        """Functions that execute statements, by their words."""
        return {
            **dict.fromkeys((*_MOTIONS, *_RELATIVE), self._move),
            **dict.fromkeys(("CIRC", "SCIRC"), self._move_on_arc),
            **dict.fromkeys(("SPLINE", "PTP_SPLINE"), self._open_spline),
            "ENDSPLINE": self._close_spline,
            "TIME_BLOCK": self._time,
            "BAS": self._bas,
        }

    def finish(self, where: str) -> None:
        """Refuse what is still open at the end."""
        name = where.partition(": line")[0]
        self.motions.require_no_block(name, "the end of the file")
        if self.motions.spline:
            raise ProgramError(f"{name}: expected ENDSPLINE, got the end of the file")

    def wait(self, line: KrlLine, is_stop: bool) -> bool:
        """Let the robot stand, or come to rest alone; return whether the program tells for how long."""
        wait = _WAIT.fullmatch(line.text)
        value = self.controller.valued(parse_expression(wait[1], line.where)) if wait else None
        is_known = value is not None and not isinstance(value, Unknown)
        if is_known or is_stop:
            self.motions.come_to_rest(
                number(value, line.where) if is_known and value is not None else 0.0
            )
        return is_known

    # Motions

    def _move(self, line: KrlLine) -> None:
        text, *clauses = _CLAUSES.split(line.remaining, maxsplit=1)
        if not text.strip():
            raise ProgramError(f"{line.where}: expected a motion to a point, got {line.word}")
        target, behind = leading(text, line.where)
        options = self._options(behind, line)
        try:
            fields = self._fields(target, line)
        except UnknownValueError as cause:
            self._leave(line, _strip_behind(text, behind), cause)
            return
        name = _strip_behind(text, behind)
        if clauses:
            with self.controller.with_state_restored():
                self._set(clauses[0], line)
                self._add(line, fields, options, name)
        else:
            self._add(line, fields, options, name)

    def _move_on_arc(self, line: KrlLine) -> None:
        """Go through a place to a target, or on by an angle."""
        text, *clauses = _CLAUSES.split(line.remaining, maxsplit=1)
        via, behind = leading(text, line.where)
        target, behind = leading(behind.removeprefix(","), line.where)
        with_angle = _ANGLE.fullmatch(behind)
        angle, behind = leading(with_angle[1], line.where) if with_angle else (None, behind)
        options = self._options(behind, line)
        try:
            fields = self._fields(via, line), self._fields(target, line)
            turn = None if angle is None else number(angle.evaluate(self.controller), line.where)
            with self.controller.with_state_restored():
                if clauses:
                    self._set(clauses[0], line)
                settings = self._settings("linear", line)
                # On others the controller turns the tool by rules of its own.
                turning: Turning = "base" if line.word == "CIRC" and turn is None else "none"
                self.motions.add_arc(*fields, turning, turn, settings, line.where)
        except UnknownValueError as cause:
            self._leave(line, text.strip(), cause)
        self._end(options)

    def _end(self, options: list[str]) -> None:
        is_rounded = self.controller.rounds_corners and _ROUNDED.intersection(options)
        if not (self.motions.spline or is_rounded):
            self.motions.come_to_rest()

    def _add(self, line: KrlLine, fields: Aggregate, options: list[str], name: str) -> None:
        motion = {**_MOTIONS, **_RELATIVE}[line.word]
        if self.motions.spline and line.word in ("SPTP", "SPTP_REL"):
            motion = "spline"
        settings = self._settings(motion, line)
        try:
            if line.word in _RELATIVE:
                in_tool = "#TOOL" in options
                self.motions.add_relative(motion, fields, in_tool, settings, line.where)
            else:
                self.motions.add(motion, fields, settings, line.where)
            self._end(options)
        except UnknownValueError as cause:
            self._leave(line, name, cause)

    def _settings(self, motion: Motion, line: KrlLine) -> MotionSettings:
        try:
            return self.controller.settings(motion)
        except UnknownValueError as cause:
            raise ProgramError(
                f"{line.where}: expected a speed that the program tells, got {cause.value.name}: write"
                " its number [m/s]"
            ) from cause

    def _fields(self, target: Expression, line: KrlLine) -> Aggregate:
        value = target.evaluate(self.controller)
        if not isinstance(value, dict):
            raise ProgramError(
                f"{line.where}: expected a motion to a point, got {shorten(describe_value(value))!r}"
            )
        return value

    def _options(self, behind: str, line: KrlLine) -> list[str]:
        """Return the words behind a motion's target, all of which are known."""
        options = behind.upper().replace(",", " ").split()
        allowed = {*_ROUNDED, "#BASE", "#TOOL"} if line.word in _RELATIVE else _ROUNDED
        others = [word for word in options if word not in allowed]
        if others:
            raise ProgramError(
                f"{line.where}: expected a motion to a point, got {shorten(others[0])!r} behind it"
            )
        if line.word not in ("PTP", "SPTP", "PTP_REL", "SPTP_REL"):
            self._note_rounding(options)
        return options

    def _note_rounding(self, options: list[str]) -> None:
        if _ROUNDED.intersection(options):
            self.controller.notes.assume(
                "the tool reaches its targets: corners that C_DIS and its like round are not rounded"
            )

    def _leave(self, line: KrlLine, target: str, cause: UnknownValueError) -> None:
        """Leave out a motion that leads to or from the path, to where only the controller knows."""
        text = f"{line.word} {shorten(target)}"
        if line.word in ("PTP", "SPTP", "PTP_REL", "SPTP_REL") and self.motions.leave(text):
            self.controller.notes.leave_out(text)
            return
        which = (
            "" if cause.value.name == target.upper() else f", and {cause.value.name} is not known"
        )
        remedy = "write its numbers" if cause.value.name.startswith("$") else "give the .dat"
        raise ProgramError(
            f"{line.where}: expected a point that has a value, got {shorten(target)!r}{which}: {remedy}"
        ) from cause

    # Clauses and spline blocks

    def _set(self, clauses: str, line: KrlLine) -> None:
        """Set what stands behind WITH, before the word of a rounded corner."""
        remaining = clauses.strip()
        while True:
            target, behind = leading(remaining, line.where)
            is_setting = isinstance(target, Reference) and target.name.startswith("$")
            if not isinstance(target, Reference) or not is_setting or not behind.startswith("="):
                raise ProgramError(
                    f"{line.where}: expected system variables and values behind WITH, got"
                    f" {shorten(remaining)!r}"
                )
            value, remaining = leading(behind[1:], line.where)
            if target.name in HARMLESS_VARIABLES or HARMLESS_SPEEDS.intersection(
                step for step in target.steps if isinstance(step, str)
            ):
                self.controller.notes.leave_out(target.name)
            else:
                self.controller.store(target, self.controller.valued(value))
            if not remaining.startswith(","):
                self._require_rounding(remaining, line)
                return
            remaining = remaining[1:].strip()

    def _open_spline(self, line: KrlLine) -> None:
        self.motions.open_spline(True, line.where)
        self._before_spline = self.controller.saved()
        text, *clauses = _CLAUSES.split(line.remaining, maxsplit=1)
        self._require_rounding(text, line)
        if clauses:
            self._set(clauses[0], line)

    def _close_spline(self, line: KrlLine) -> None:
        self.motions.open_spline(False, line.where)
        self._require_rounding(line.remaining, line)
        if not (line.remaining and self.controller.rounds_corners):
            self.motions.come_to_rest()
        if self._before_spline:
            self.controller.restore(self._before_spline)
            self._before_spline = []

    def _require_rounding(self, text: str, line: KrlLine) -> None:
        options = text.upper().split()
        if not _ROUNDED.issuperset(options):
            raise ProgramError(
                f"{line.where}: expected WITH or C_SPL behind {line.word}, got"
                f" {shorten(text.strip())!r}"
            )
        self._note_rounding(options)

    def _time(self, line: KrlLine) -> None:
        match = _BLOCK.fullmatch(line.text)
        if match is None:
            raise ProgramError(
                f"{line.where}: expected START, PART or END, got {shorten(line.text)!r}"
            )
        kind = match[1].split("=")[0].strip().upper()
        if kind == "START":
            self.motions.begin_times(line.where)
            return
        try:
            value = number(
                parse_expression(match[2], line.where).evaluate(self.controller), line.where
            )
        except UnknownValueError as cause:
            raise ProgramError(
                f"{line.where}: expected a time that the program tells, got {cause.value.name}"
            ) from cause
        if kind == "PART":
            self.motions.share_time(value, line.where)
        else:
            self.motions.end_times(value, line.where)

    # The pendant's routine

    def _bas(self, line: KrlLine) -> None:
        call, remaining = leading(line.text, line.where)
        first = call.arguments[0] if isinstance(call, Call) and call.arguments else None
        command = first.constant if isinstance(first, Constant) else None
        assert isinstance(call, Call) or command is None
        argument = call.arguments[1] if isinstance(call, Call) and len(call.arguments) > 1 else None
        value = None if argument is None else self.controller.valued(argument)
        if not isinstance(command, str) or remaining:
            raise ProgramError(f"{line.where}: expected BAS(#..), got {shorten(line.text)!r}")
        if command in ("#ACC_CP", "#ACC_GLUE", "#ACC_PTP", "#VEL_PTP", "#OUT_SYNC", "#OUT_ASYNC"):
            self.controller.notes.leave_out(f"BAS({command})")
        elif command == "#INITMOV":
            self._initialize()
        elif command in ("#FRAMES", "#PTP_PARAMS"):
            self._choose_frames()
        elif command in ("#VEL_CP", "#TOOL", "#BASE", "#CP_PARAMS"):
            if value is None:
                raise ProgramError(f"{line.where}: expected a number behind {command}, got none")
            self._set_by_number(command, value)
        elif command == "#CP_DAT":
            data = self._active("LDAT_ACT")
            self._choose_rotation(data)
            self.controller.set_speed(
                data.get("VEL", Unknown("LDAT_ACT.VEL")) if isinstance(data, dict) else data
            )
        elif command == "#PTP_DAT":
            self.controller.notes.leave_out("BAS(#PTP_DAT)")
        else:
            raise ProgramError(
                f"{line.where}: expected a command of BAS that is known, got {shorten(command)}"
            )

    def _set_by_number(self, command: str, value: Value) -> None:
        word = command[1:]
        if word in ("TOOL", "BASE"):
            self.controller.set_system(f"${word}", self.controller.numbered_frame(word, value))
            return
        if word == "CP_PARAMS":
            self._choose_rotation(self._active("LDAT_ACT"))
            self._choose_frames()
        self.controller.set_speed(value)

    def _initialize(self) -> None:
        """Set what the controller begins with: the world as base, tool 1."""
        controller = self.controller
        controller.set_system("$BASE", null_frame())
        controller.set_system("$TOOL", controller.numbered_frame("TOOL", 1))
        controller.set_system("$ORI_TYPE", "#VAR")
        controller.set_system("$ADVANCE", 3)
        for name in ("$CIRC_TYPE", "$IPO_MODE"):
            controller.set_system(name, "#BASE")
        speed = controller.valued(Reference("DEF_VEL_CP"))
        if isinstance(speed, Unknown):
            controller.set_system("$VEL", {})
        else:
            controller.set_speed(speed)

    def _active(self, name: str) -> Value:
        return self.controller.valued(Reference(name))

    def _choose_frames(self) -> None:
        data = self._active("FDAT_ACT")
        for word in ("TOOL", "BASE"):
            value = data
            if isinstance(data, dict):
                value = data.get(f"{word}_NO", Unknown(f"FDAT_ACT.{word}_NO"))
            self.controller.set_system(f"${word}", self.controller.numbered_frame(word, value))
        if isinstance(data, dict):
            self.controller.set_system("$IPO_MODE", data.get("IPO_FRAME", "#BASE"))

    def _choose_rotation(self, data: Value) -> None:
        if isinstance(data, Unknown):
            self.controller.notes.assume(
                f"{data.name}, which is not given, turns the tool evenly (#VAR)"
            )
        rotation = data.get("ORI_TYP", "#VAR") if isinstance(data, dict) else "#VAR"
        self.controller.set_system("$ORI_TYPE", rotation)
        circle = data.get("CIRC_TYP", "#BASE") if isinstance(data, dict) else "#BASE"
        self.controller.set_system("$CIRC_TYPE", circle)


def _strip_behind(text: str, behind: str) -> str:
    """Return a target as it is written, without what stands behind it."""
    return text.strip().removesuffix(behind).strip()
