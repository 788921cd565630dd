"""Instructions of motion, and those that set what motions are subject to."""

from __future__ import annotations

import re
from dataclasses import dataclass

from coupling.errors import ProgramError
from coupling.programs.program import HERE, rest_behind
from coupling.programs.rapid.evaluation import RapidEvaluation
from coupling.programs.rapid.instruction_classes import LEFT_OUT_OPTIONS, MoveForm
from coupling.programs.rapid.memory import RoutineScope
from coupling.programs.rapid.motions import (
    MoveFrames,
    Pace,
    RapidMotions,
)
from coupling.programs.rapid.predefined import speed_of
from coupling.programs.rapid.syntax import Argument, Expression, Literal, Name
from coupling.programs.rapid.values import (
    Value,
    pose_of,
)
from coupling.programs.reading import ReadingNotes
from coupling.programs.unknown import Unknown

# Options that a path cannot do without, and why they are refused.
_REFUSED_OPTIONS = {
    "CORR": "corrections of the path while the robot moves",
    "TRACK": "tracking of a seam while the robot moves",
    "WEAVE": "a weaving motion",
    "SUP": "a supervision that ends a motion",
}
_NAMED_SPEED = re.compile(r"v(\d{1,4})", re.IGNORECASE)
SETTINGS = frozenset(
    ["PDISPSET", "PDISPOFF", "VELSET", "SINGAREA", "WAITTIME", "WAITROB", "CIRPATHMODE"]
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
    ) -> None:
        """Execute a motion.

        Raises:
            ProgramError: If the motion, or an option of it, cannot be executed or left out.
        """
        placed = [argument.value for argument in arguments if not argument.option]
        options = {
            argument.option: argument.value
            for argument in arguments
            if argument.option and _is_given(argument, scope)
        }
        if len(placed) != form.count:
            raise ProgramError(
                f"{where}: expected {form.count} arguments of {name}, a target, a speed, a zone and a"
                f" tool among them, got {len(placed)}"
            )
        values = [value for value in placed if value is not None]
        self._require_options(name, options, where)
        to_joints = name.upper().endswith("ABSJ")
        kind = "jointtarget" if to_joints else "robtarget"
        *via, target = (
            self.evaluation.require_known(value, kind, scope, where)
            for value in values[: form.targets]
        )
        frames = self._frames(values[-form.tool], options.get("WOBJ"), scope, where)
        pace = self._pace(values[form.targets], options, scope, where)
        if to_joints:
            self.motions.to_joints(target, frames, pace, where)
        else:
            self.motions.to_pose(form.motion, target, frames, pace, where, *via)
        self._note_zone(form, values, options, scope, where)

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
            return expression.name, self.evaluation.require_known(expression, kind, scope, where)
        return f"{kind} of {where}", self.evaluation.require_known(expression, kind, scope, where)

    def _pace(
        self,
        speed: Expression,
        options: dict[str, Expression | None],
        scope: RoutineScope,
        where: str,
    ) -> Pace:
        time, tcp = (self._option(options, key, scope, where) for key in ("T", "V"))
        if time is not None:
            return Pace(Unknown("a time"), time=time)
        return Pace(self._speed(speed, tcp, scope, where), tcp)

    def _speed(
        self, expression: Expression, tcp: float | None, scope: RoutineScope, where: str
    ) -> Value:
        """Return speed data, or those that a name such as v35 tells by itself."""
        memory = self.evaluation.memory
        if isinstance(expression, Name) and memory.variable(expression.name, scope) is None:
            if tcp is not None:
                return speed_of(tcp)
            if (speed_name := _NAMED_SPEED.fullmatch(expression.name)) is not None:
                self.notes.assume(
                    f"{expression.name}, which is not in the program, is {speed_name[1]} mm/s"
                )
                return speed_of(float(speed_name[1]))
        return self.evaluation.require_known(expression, "speeddata", scope, where)

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
            value = self.evaluation.require_known(placed[0], "pose", scope, where)
            self.motions.displace(pose_of(value, where))
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
        elif word == "WAITTIME" and len(placed) == 1:
            seconds = self.evaluation.value(placed[0], scope, where).value
            if isinstance(seconds, Unknown):
                self.notes.leave_out(name)
            rest_behind(self.motions.moves, seconds if isinstance(seconds, float) else 0.0)
        elif word == "WAITROB":
            self.notes.leave_out(name)
            rest_behind(self.motions.moves)
        elif word == "CIRPATHMODE" and options:
            self.motions.circle = ", ".join(options)
        elif word == "SINGAREA" and options:
            self._take_singular(options)
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


def _is_given(argument: Argument, scope: RoutineScope) -> bool:
    """Return whether an option is there, which may hang on one of the routine's parameters."""
    if not argument.is_conditional:
        return True
    assert isinstance(argument.value, Name)
    return argument.value.name.upper() in scope.data
