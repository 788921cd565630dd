"""State of a controller that runs a KRL program: variables, frames and speed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from coupling.errors import ProgramError
from coupling.programs.krl.expressions import Call, Expression, Reference
from coupling.programs.krl.functions import FUNCTIONS, call_function
from coupling.programs.krl.harmless import is_harmless_call
from coupling.programs.krl.memory import Components, Key, Variables, format_variable
from coupling.programs.krl.motions import MotionSettings
from coupling.programs.krl.operators import AUTOMATIC
from coupling.programs.krl.parser import parse_expression
from coupling.programs.krl.values import (
    UnknownValueError,
    Value,
    copy_value,
    describe_value,
    null_frame,
    number,
)
from coupling.programs.reading import ReadingNotes
from coupling.programs.text import shorten
from coupling.programs.unknown import Unknown

# System variables that are executed.
_FRAMES_AND_MODES = ("$BASE", "$TOOL", "$ORI_TYPE", "$CIRC_TYPE", "$IPO_MODE")
_SETTINGS = (*_FRAMES_AND_MODES, "$VEL", "$OV_PRO", "$ADVANCE")
# Values of some in whole numbers, from one to another.
_RANGES = {"$OV_PRO": (1, 100), "$ADVANCE": (0, 5)}
_FIXED = ("$NULLFRAME", "$WORLD")
_MANUAL = frozenset(("$T1", "$T2"))
# What INI folds ask before they switch a technology package on.
_PACKAGES: dict[str, Value] = {
    "ARC20": False,
    "A10_OPTION": "#DISABLED",
    "A20_OPTION": "#DISABLED",
    "H50_OPTION": False,
    "H70_OPTION": False,
}


@dataclass
class KrlController:
    """What expressions and settings mean while a program runs; a `Scope`.

    Attributes:
        notes: Notes on statements left out, and assumptions.
        variables: All variables.
        where: Place of the statement that is executed.
        step: Number of statements so far.
        volatile: Names of variables that an interrupt or a trigger sets, nobody knows when.
        call: Function that runs a routine of the program and returns its result; None where the
            program has none of that name.
    """

    notes: ReadingNotes
    variables: Variables = field(default_factory=Variables)
    where: str = ""
    step: int = 0
    volatile: set[str] = field(default_factory=set)
    call: Callable[[str, Sequence[Expression]], tuple[Value | None] | None] = lambda *_: None

    def __post_init__(self) -> None:
        store = self.variables.common.values
        for name in _FIXED:
            store[name, ()] = null_frame()
        store["$BASE", ()], store["$TOOL", ()] = Unknown("$BASE"), Unknown("$TOOL")
        store["$VEL", ()], store["$OV_PRO", ()] = {}, 100
        store["$ORI_TYPE", ()], store["$IPO_MODE", ()] = "#VAR", "#BASE"
        store["$CIRC_TYPE", ()], store["$ADVANCE", ()] = "#BASE", 3

    # Expressions

    def value(self, reference: Reference) -> Value:
        """Return the value of a variable.

        Raises:
            UnknownValueError: If the program does not tell it.
        """
        name = reference.name
        if name in _MANUAL or name == "$MODE_OP":
            self.notes.assume("the program runs in automatic mode, neither in T1 nor in T2")
            return AUTOMATIC if name == "$MODE_OP" else False
        key, components = self.place(reference)
        is_measured = name.startswith("$") and name not in _SETTINGS and name not in _FIXED
        if is_measured or name in self.volatile:
            raise UnknownValueError(Unknown(format_variable(key, components)))
        try:
            return copy_value(self.variables.read(key, components))
        except UnknownValueError:
            if name not in _PACKAGES:
                raise
            self.notes.assume(f"the technology package of {name} is not active")
            return _PACKAGES[name]

    def result(self, name: str, arguments: Sequence[Expression]) -> Value:
        """Return the result of a function.

        Raises:
            ProgramError: If the program does not have it, or it gives none.
            UnknownValueError: If the result depends on what is not known.
        """
        returned = self.call(name, arguments)
        if returned is not None:
            if returned[0] is None:
                raise ProgramError(
                    f"{self.where}: expected a function that returns a value, got {name}"
                )
            return returned[0]
        if name in FUNCTIONS:
            return call_function(name, [self.valued(part) for part in arguments], self.where)
        if name in _PENDANT_FUNCTIONS:
            return _PENDANT_FUNCTIONS[name](self, arguments)
        if is_harmless_call(name):
            self.forget(arguments)
            raise UnknownValueError(Unknown(f"{name}()"))
        raise ProgramError(
            f"{self.where}: expected a function of the program, got {shorten(name)}: put the .src that"
            " has it beside the program"
        )

    def place(self, reference: Reference) -> tuple[Key, Components]:
        """Return where a value stands: its variable or element, and components of it.

        Raises:
            UnknownValueError: If an index is not known.
        """
        if not reference.steps:
            return (reference.name, ()), ()
        indices: tuple[int, ...] = ()
        components: list[str] = []
        for step in reference.steps:
            if isinstance(step, str):
                components.append(step)
            elif components:
                numbers = self._indices(step)
                components[-1] += f"[{','.join(str(n) for n in numbers)}]"
            else:
                indices += self._indices(step)
        return (reference.name, indices), tuple(components)

    def _indices(self, step: tuple[Expression, ...]) -> tuple[int, ...]:
        values = [number(part.evaluate(self), self.where) for part in step]
        for value in values:
            if value != int(value):
                raise ProgramError(
                    f"{self.where}: expected whole numbers as indices, got {value:g}"
                )
        return tuple(int(value) for value in values)

    def valued(self, expression: Expression) -> Value:
        """Return a value, or what stands for it where it is not known."""
        try:
            return expression.evaluate(self)
        except UnknownValueError as cause:
            if isinstance(expression, Reference) and self._keeps(expression):
                return cause.value
            if isinstance(expression, Call) and expression.name in _PENDANT_FUNCTIONS:
                return cause.value
            # What is measured or computed from it is another value each time.
            return self._new(cause.value)

    def _keeps(self, reference: Reference) -> bool:
        """Return whether a variable changes by assignments alone."""
        if reference.name.startswith("$") and reference.name not in _SETTINGS:
            return False
        if reference.name in self.volatile:
            return False
        try:
            self.place(reference)
        except UnknownValueError:
            return False
        return True

    def forget(self, arguments: Sequence[Expression]) -> None:
        """Take the values of variables from them that a call may have changed."""
        for part in arguments:
            if isinstance(part, Reference) and not part.name.startswith("$"):
                self.store(part, self._new(Unknown(part.name)))

    def _new(self, origin: Unknown) -> Unknown:
        """Return what a statement measures or computes from what is not known."""
        line = self.where.rpartition(": ")[2]
        text = origin.name if origin.step else f"{origin.name} of {line}"
        return Unknown(text, self.step)

    # Assignments

    def store(self, target: Reference, value: Value) -> None:
        """Give a variable a value.

        Raises:
            ProgramError: If it is a system variable that is not executed, or not such a value.
        """
        try:
            key, components = self.place(target)
        except UnknownValueError as cause:
            raise ProgramError(
                f"{self.where}: expected an index of {target.name} that the program tells, got"
                f" {cause.value.name}: write its number"
            ) from cause
        if target.name.startswith("$"):
            self._require_setting(key, components, value)
        self.variables.write(key, components, value, self.where)

    def _require_setting(self, key: Key, components: Components, value: Value) -> None:
        """Refuse what a system variable must not become."""
        name, where = key[0], self.where
        if name not in _SETTINGS or key[1]:
            raise ProgramError(
                f"{where}: expected system variables that are known, got"
                f" {format_variable(key, components)}: take the line out if it does not change the path"
            )
        allowed = {"$ORI_TYPE": ("#VAR", "#CONSTANT"), "$IPO_MODE": ("#BASE",)}.get(name)
        if allowed is not None and (not isinstance(value, str) or value not in allowed):
            raise ProgramError(
                f"{where}: expected {name}={' or '.join(allowed)}, got {describe_value(value)}"
            )
        if name in _RANGES:
            least, most = _RANGES[name]
            if isinstance(value, Unknown) or not least <= number(value, where) <= most:
                raise ProgramError(
                    f"{where}: expected {name} from {least} to {most}, got {describe_value(value)}"
                )
            if name == "$OV_PRO" and value != 100:
                self.notes.assume(f"the override is {number(value, where):g} %, as $OV_PRO says")
        if name == "$VEL":
            speed = value.get("CP") if isinstance(value, dict) else value
            if components not in ((), ("CP",)) or (not components and not isinstance(value, dict)):
                raise ProgramError(
                    f"{where}: expected $VEL.CP, got {format_variable(key, components)}"
                )
            if speed is not None and not isinstance(speed, Unknown) and number(speed, where) <= 0.0:
                raise ProgramError(f"{where}: expected a speed > 0, got {describe_value(speed)}")

    def set_system(self, name: str, value: Value) -> None:
        """Set a system variable that is executed.  Raises as `store`."""
        self.store(Reference(name), value)

    def set_speed(self, value: Value) -> None:
        """Set the speed of the path [m/s].  Raises as `store`."""
        self.store(Reference("$VEL", ("CP",)), value)

    def numbered_frame(self, word: str, value: Value) -> Value:
        """Return base or tool of a number: BASE_DATA and TOOL_DATA, of 0 the frame of zeros."""
        if isinstance(value, Unknown):
            return Unknown(f"{word} of {value.name}")
        index = int(number(value, self.where))
        if index <= 0:
            return null_frame()
        return self.valued(parse_expression(f"{word}_DATA[{index}]", self.where))

    @property
    def rounds_corners(self) -> bool:
        """Whether motions pass into each other where they say so: not without an advance run."""
        return self.variables.common.values["$ADVANCE", ()] != 0

    def settings(self, motion: str) -> MotionSettings:
        """Return what holds for a motion.

        Raises:
            UnknownValueError: If its speed is set to what is not known.
        """
        store = self.variables.common.values
        velocity, override = store["$VEL", ()], store["$OV_PRO", ()]
        assert isinstance(velocity, dict)
        speed = velocity.get("CP")
        if isinstance(speed, Unknown) and motion == "joint":
            speed = None
        share = number(override, self.where) / 100.0
        return MotionSettings(
            store["$BASE", ()],
            store["$TOOL", ()],
            None if speed is None else number(speed, self.where) * share,
            store["$ORI_TYPE", ()] == "#CONSTANT",
            store["$CIRC_TYPE", ()],
        )

    @contextmanager
    def with_state_restored(self) -> Iterator[None]:
        """Restore settings behind what they are changed for alone."""
        saved = self.saved()
        yield
        self.restore(saved)

    def saved(self) -> list[Value]:
        """Return the settings as they are."""
        return [copy_value(self.variables.common.values[name, ()]) for name in _SETTINGS]

    def restore(self, saved: list[Value]) -> None:
        """Set the settings as they were."""
        for name, value in zip(_SETTINGS, saved, strict=True):
            self.variables.common.values[name, ()] = value


def _frame_function(word: str) -> Callable[[KrlController, Sequence[Expression]], Value]:
    def frame(controller: KrlController, arguments: Sequence[Expression]) -> Value:
        value = _first(controller, arguments)
        if isinstance(value, dict):
            value = value.get(f"{word}_NO", Unknown(f"{word}_NO"))
        return _require_known(controller.numbered_frame(word, value))

    return frame


def _first(controller: KrlController, arguments: Sequence[Expression]) -> Value:
    if not arguments:
        raise ProgramError(f"{controller.where}: expected an argument, got none")
    return controller.valued(arguments[0])


def _speed(controller: KrlController, arguments: Sequence[Expression]) -> Value:
    return {"CP": _first(controller, arguments)}


def _single_argument(controller: KrlController, arguments: Sequence[Expression]) -> Value:
    return _require_known(_first(controller, arguments))


def _rotation(controller: KrlController, arguments: Sequence[Expression]) -> Value:
    value = _first(controller, arguments)
    return value.get("ORI_TYP", "#VAR") if isinstance(value, dict) else _require_known(value)


def _require_known(value: Value) -> Value:
    if isinstance(value, Unknown):
        raise UnknownValueError(value)
    return value


# Functions in the clauses of the pendant's spline motions.
_PENDANT_FUNCTIONS: dict[str, Callable[[KrlController, Sequence[Expression]], Value]] = {
    "STOOL": _frame_function("TOOL"),
    "STOOL2": _frame_function("TOOL"),
    "SBASE": _frame_function("BASE"),
    "SVEL_CP": _speed,
    "SIPO_MODE": _single_argument,
    "SORI_TYP": _rotation,
}
