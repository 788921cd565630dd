"""Instructions of motion, and those that set what motions are subject to."""

from __future__ import annotations

import re
from dataclasses import dataclass

from coupling.errors import ProgramError
from coupling.programs.program import HERE
from coupling.programs.rapid.evaluation import RapidEvaluation
from coupling.programs.rapid.harmless import LEFT_OUT_OPTIONS, MoveForm
from coupling.programs.rapid.memory import RoutineScope
from coupling.programs.rapid.motions import (
    MoveFrames,
    Pace,
    RapidMotions,
    displacement_of,
)
from coupling.programs.rapid.predefined import speed_of
from coupling.programs.rapid.syntax import Argument, Expression, Literal, Name
from coupling.programs.rapid.values import (
    NO_AXIS,
    UnknownData,
    Value,
    numbers_of,
    pose_of,
    shown,
)
from coupling.programs.reading import ReadingNotes

# Options that a path cannot do without, and why they are refused.
_REFUSED_OPTIONS = {
    "CORR": "corrections of the path while the robot moves",
    "TRACK": "tracking of a seam while the robot moves",
    "WEAVE": "a weaving motion",
    "SUP": "a supervision that ends a motion",
}
_NAMED_SPEED = re.compile(r"v(\d{1,4})", re.IGNORECASE)
SETTINGS = frozenset(
    ["PDISPSET", "PDISPON", "PDISPOFF", "VELSET", "SPEEDREFRESH", "SINGAREA", "EOFFSSET"]
)


@dataclass
class Moving:
    """Executes instructions of motion.

    Attributes:
        motions: Motions up to here, to which they add.
        evaluation: Values of their arguments.
        notes: Options left out, and assumptions.
    """

    motions: RapidMotions
    evaluation: RapidEvaluation
    notes: ReadingNotes

    def move(
        self,
        form: MoveForm,
        name: str,
        arguments: tuple[Argument, ...],
        scope: RoutineScope,
        where: str,
    ) -> str:
        """Execute a motion, and return the procedure that it calls at its end, if any.

        Raises:
            ProgramError: If the motion, or an option of it, cannot be executed or left out.
        """
        placed = [argument.value for argument in arguments if not argument.option]
        options = {
            argument.option: argument.value
            for argument in arguments
            if argument.option and _is_given(argument, scope)
        }
        if len(placed) not in form.counts:
            counts = " or ".join(map(str, form.counts))
            raise ProgramError(
                f"{where}: expected {counts} arguments of {name}, a target, a speed, a zone and a tool"
                f" among them, got {len(placed)}"
            )
        values = [value for value in placed if value is not None]
        self._require_options(name, options, where)
        self._require_no_weaving(form, values, name, scope, where)
        to_joints = name.upper().endswith("ABSJ")
        kind = "jointtarget" if to_joints else "robtarget"
        target = self.evaluation.known(values[0], kind, scope, where)
        frames = self._frames(values[-form.tool], options.get("WOBJ"), scope, where)
        pace = self._pace(form, values, options, name, scope, where)
        self._note_zone(form, values, options, scope, where)
        if to_joints:
            self.motions.to_joints(target, frames, pace, where)
        else:
            self.motions.to_pose(form.motion, target, frames, pace, where)
        if not form.procedure:
            return ""
        procedure = self.evaluation.value(values[-form.procedure], scope, where).value
        if not isinstance(procedure, str):
            raise ProgramError(f"{where}: expected the name of a procedure, got {shown(procedure)}")
        return procedure

    def _require_options(
        self, name: str, options: dict[str, Expression | None], where: str
    ) -> None:
        for option in options:
            if option in LEFT_OUT_OPTIONS:
                self.notes.leave_out(LEFT_OUT_OPTIONS[option])
            elif option == "ID":
                self.notes.assume("motions with \\ID do not wait for another robot")
            elif option not in ("V", "T", "Z", "WOBJ", "NOEOFFS"):
                reason = _REFUSED_OPTIONS.get(option, "an option that is not known here")
                raise ProgramError(
                    f"{where}: expected {name} without \\{option.capitalize()}, got it, {reason}: leave"
                    " it out"
                )
        if "V" in options and "T" in options:
            raise ProgramError(f"{where}: expected a speed \\V or a time \\T, got both")

    def _require_no_weaving(
        self,
        form: MoveForm,
        values: list[Expression],
        name: str,
        scope: RoutineScope,
        where: str,
    ) -> None:
        """Refuse weave data of another shape than 0."""
        if form.weave and len(values) == max(form.counts):
            data = self.evaluation.value(values[form.weave], scope, where).value
            shape = data[0] if isinstance(data, tuple) and data else data
            if shape != 0.0:
                raise ProgramError(
                    f"{where}: expected {name} without weaving, got weave data {shown(data)}, whose"
                    " shape is not 0: leave them out"
                )

    def _frames(
        self,
        tool: Expression,
        work_object: Expression | None,
        scope: RoutineScope,
        where: str,
    ) -> MoveFrames:
        tool_name, tool_value = self._frame(tool, "tooldata", scope, where)
        object_name, object_value = self._frame(
            work_object or Name("wobj0"), "wobjdata", scope, where
        )
        return MoveFrames(tool_name, tool_value, object_name, object_value)

    def _frame(
        self, expression: Expression, kind: str, scope: RoutineScope, where: str
    ) -> tuple[str, Value | None]:
        """Return the name of a frame and its value, None where the controller holds it."""
        if isinstance(expression, Name):
            if self.evaluation.memory.variable(expression.name, scope) is None:
                return expression.name, None
            return expression.name, self.evaluation.known(expression, kind, scope, where)
        return f"{kind} of {where}", self.evaluation.known(expression, kind, scope, where)

    def _pace(
        self,
        form: MoveForm,
        values: list[Expression],
        options: dict[str, Expression | None],
        name: str,
        scope: RoutineScope,
        where: str,
    ) -> Pace:
        time, tcp = (self._option(options, key, scope, where) for key in ("T", "V"))
        if time is not None:
            return Pace(UnknownData("a time"), time=time)
        if not form.weld:
            return Pace(self._speed(values[1], tcp, scope, where), tcp)
        welding = self.evaluation.value(values[form.weld], scope, where).value
        speed = welding[0] if isinstance(welding, tuple) and welding else welding
        if isinstance(speed, float) and speed > 0.0 and speed != NO_AXIS:
            self.notes.assume(f"{name} goes at the speed of its weld data, in mm/s")
            return Pace(speed_of(speed), is_process=True)
        self.notes.assume(
            f"{name} goes at the speed of its weld data, which are not in the program"
        )
        return Pace(UnknownData("weld data"))

    def _speed(
        self, expression: Expression, tcp: float | None, scope: RoutineScope, where: str
    ) -> Value:
        """Return speed data, or those that a name such as v35 tells by itself."""
        memory = self.evaluation.memory
        if isinstance(expression, Name) and memory.variable(expression.name, scope) is None:
            if tcp is not None:
                return speed_of(tcp)
            if (named := _NAMED_SPEED.fullmatch(expression.name)) is not None:
                self.notes.assume(
                    f"{expression.name}, which is not in the program, is {named[1]} mm/s"
                )
                return speed_of(float(named[1]))
        return self.evaluation.known(expression, "speeddata", scope, where)

    def _option(
        self, options: dict[str, Expression | None], key: str, scope: RoutineScope, where: str
    ) -> float | None:
        if key not in options:
            return None
        expression = options[key]
        if expression is None:
            raise ProgramError(f"{where}: expected a number behind \\{key}, got none")
        return self.evaluation.number(expression, f"\\{key}", scope, where)

    def _note_zone(
        self,
        form: MoveForm,
        values: list[Expression],
        options: dict[str, Expression | None],
        scope: RoutineScope,
        where: str,
    ) -> None:
        radius = self._option(options, "Z", scope, where)
        zone = values[-form.tool - 1]
        if isinstance(zone, Name | Literal):
            data = self.evaluation.value(zone, scope, where)
            if data.kind in ("", "zonedata"):
                self.motions.note_zone(data.value, radius)

    def set(
        self, name: str, arguments: tuple[Argument, ...], scope: RoutineScope, where: str
    ) -> None:
        """Execute an instruction that sets what motions are subject to.  Raises as `move`."""
        placed = [a.value for a in arguments if not a.option and a.value is not None]
        options = {a.option: a.value for a in arguments if a.option and _is_given(a, scope)}
        word = name.upper()
        if word == "PDISPOFF":
            self.motions.displace(HERE)
        elif word == "PDISPSET" and len(placed) == 1:
            value = self.evaluation.known(placed[0], "pose", scope, where)
            self.motions.displace(pose_of(value, where))
        elif word == "PDISPON":
            self._displace_by_targets(placed, options, scope, where)
        elif word == "VELSET" and len(placed) == 2:
            share, highest = (
                self.evaluation.number(item, "VelSet", scope, where) for item in placed
            )
            if not (0.0 < share <= 100.0 and highest > 0.0):
                raise ProgramError(
                    f"{where}: expected an override up to 100 % and a speed > 0, got {share:g} and"
                    f" {highest:g}"
                )
            self.motions.override, self.motions.highest = 0.01 * share, highest
        elif word == "SPEEDREFRESH" and len(placed) == 1:
            share = self.evaluation.number(placed[0], "SpeedRefresh", scope, where)
            if share != 100.0:
                raise ProgramError(
                    f"{where}: expected SpeedRefresh 100, got {share:g}, which changes the speed while"
                    " the robot moves: give the speeds to the motions"
                )
        elif word == "SINGAREA" and options:
            self._take_singular(options)
        elif word == "EOFFSSET" and len(placed) == 1:
            offsets = self.evaluation.known(placed[0], "extjoint", scope, where)
            if any(value not in (0.0, NO_AXIS) for value in _numbers(offsets, where)):
                raise ProgramError(
                    f"{where}: expected no offsets of external axes, got EOffsSet: leave it out"
                )
        else:
            raise ProgramError(f"{where}: expected the arguments of {name}, got {len(placed)}")

    def _take_singular(self, options: dict[str, Expression | None]) -> None:
        if set(options) == {"OFF"}:
            self.notes.leave_out("SingArea\\Off")
        else:
            option = next(iter(options)).capitalize()
            self.notes.assume(
                f"the tool keeps its programmed rotation, from which SingArea\\{option} may deviate"
            )

    def _displace_by_targets(
        self,
        placed: list[Expression],
        options: dict[str, Expression | None],
        scope: RoutineScope,
        where: str,
    ) -> None:
        executed = options.get("EXEP")
        if executed is None or not placed:
            raise ProgramError(
                f"{where}: expected PDispOn with \\ExeP, got none, and with it the place where the"
                " robot is: give the displacement to PDispSet"
            )
        poses = []
        for expression in (executed, placed[0]):
            target = self.evaluation.known(expression, "robtarget", scope, where)
            assert isinstance(target, tuple)
            poses.append(pose_of(target[:2], where))
        self.motions.displace(displacement_of(poses[0], poses[1], "ROT" in options))


def _is_given(argument: Argument, scope: RoutineScope) -> bool:
    """Return whether an option is there, which may hang on one of the routine's parameters."""
    if not argument.is_conditional:
        return True
    assert isinstance(argument.value, Name)
    return argument.value.name.upper() in scope.data


def _numbers(values: Value, where: str) -> list[float]:
    assert isinstance(values, tuple)
    known = tuple(value for value in values if value != NO_AXIS)
    return numbers_of(known, "offsets", where)
