"""Expressions of RAPID and their values, and data that get values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from coupling.errors import ProgramError
from coupling.programs.rapid.functions import ASSUMED, RETURNING, WRITING, call_function, is_known
from coupling.programs.rapid.memory import RapidMemory, RoutineScope
from coupling.programs.rapid.operators import apply_operator
from coupling.programs.rapid.syntax import (
    Argument,
    Brackets,
    Component,
    Element,
    Expression,
    FunctionCall,
    Literal,
    Name,
    OperatorExpression,
)
from coupling.programs.rapid.values import Data, Value, format_value, numbers_of
from coupling.programs.text import shorten
from coupling.programs.unknown import Unknown


@dataclass
class RapidEvaluation:
    """Gives expressions their values.

    Attributes:
        memory: Data and routines by their names.
        run: Function that executes a function of the program and returns its value.
    """

    memory: RapidMemory
    run: Callable[[FunctionCall, RoutineScope, str], Data]

    def value(self, expression: Expression, scope: RoutineScope, where: str) -> Data:
        """Return the value of an expression, which may be one that only the controller knows.

        Raises:
            ProgramError: If it has none.
        """
        if isinstance(expression, Literal):
            return Data(expression.kind, expression.value)
        if isinstance(expression, Name):
            variable = self.memory.variable(expression.name, scope)
            return Data("", Unknown(repr(expression.name))) if variable is None else variable.data
        if isinstance(expression, Component):
            record = self.value(expression.record, scope, where)
            return self.memory.kinds.component(record, expression.name, where)
        if isinstance(expression, Element):
            return self._element(expression, scope, where)
        if isinstance(expression, OperatorExpression):
            operands = [self.value(operand, scope, where) for operand in expression.operands]
            return apply_operator(expression.operator, operands, where)
        if isinstance(expression, Brackets):
            items = (self.value(item, scope, where).value for item in expression.items)
            return Data("", tuple(items))
        return self._call(expression, scope, where)

    def require_known(
        self, expression: Expression, kind: str, scope: RoutineScope, where: str
    ) -> Value:
        """Return a value of a kind that is known as a whole, though parts of it may not be.

        Raises:
            ProgramError: If it is none.
        """
        data = self.value(expression, scope, where)
        if isinstance(data.value, Unknown) or data.rank or data.kind not in ("", kind):
            got = data.value if isinstance(data.value, Unknown) else None
            text = got.name if got else f"{data.kind} {format_value(data.value)}"
            raise ProgramError(
                f"{where}: expected a {kind} with a value, got {text}{self.memory.missing()}"
            )
        # Data of a kind are of its shape already.
        return data.value if data.kind else self.memory.kinds.shaped(kind, data.value, where)

    def number(self, expression: Expression, what: str, scope: RoutineScope, where: str) -> float:
        """Return a number that is known.  Raises as `known`."""
        value = self.value(expression, scope, where).value
        numbers = numbers_of(value, what, where)
        if len(numbers) != 1 or isinstance(value, bool):
            raise ProgramError(f"{where}: expected a number as {what}, got {format_value(value)}")
        return numbers[0]

    def assign(self, target: Expression, value: Data, scope: RoutineScope, where: str) -> None:
        """Give data, or a component or an element of them, a value.

        Raises:
            ProgramError: If there are no such data, or the value is of another kind.
        """
        path: list[Component | Element] = []
        while isinstance(target, Component | Element):
            path.append(target)
            target = target.record if isinstance(target, Component) else target.array
        if not isinstance(target, Name):
            raise ProgramError(f"{where}: expected data that get a value, got an expression")
        variable = self.memory.variable(target.name, scope)
        if variable is None:
            variable = self.memory.undeclared(target.name)
            if path:
                variable.set(Unknown(f"{target.name!r}, of which a part is set in {_line(where)}"))
                return
        if variable.storage == "CONST":
            raise ProgramError(
                f"{where}: expected data that are no constant, got {shorten(target.name)!r}"
            )
        variable.set(self._placed(variable.data, path[::-1], value, scope, where))

    def forget(self, argument: Argument, word: str, scope: RoutineScope, where: str) -> None:
        """Forget data that a function or an instruction, `word`, is given to return something in."""
        if (variable := self.memory.changeable(argument.value, scope)) is not None:
            variable.set(Unknown(f"what {word} returns in {_line(where)}"))

    def _placed(
        self,
        whole: Data,
        path: list[Component | Element],
        value: Data,
        scope: RoutineScope,
        where: str,
    ) -> Value:
        """Return data with another value at the end of a path through them."""
        if not path:
            if (
                value.kind
                and whole.kind
                and value.kind != whole.kind
                and not _are_numbers(value, whole)
            ):
                raise ProgramError(
                    f"{where}: expected a value of {whole.kind}, got one of {value.kind}"
                )
            return self.memory.kinds.shaped(whole.kind, value.value, where, whole.rank)
        if isinstance(whole.value, Unknown):
            return whole.value
        step, *further_steps = path
        if isinstance(step, Component):
            part = self.memory.kinds.component(whole, step.name, where)
            new = self._placed(part, further_steps, value, scope, where)
            return self.memory.kinds.with_component(whole, step.name, new, where).value
        indices = self._indices(step, whole, scope, where)
        if isinstance(indices, Unknown):
            return indices
        part = _part(whole, indices)
        new = self._placed(part, further_steps, value, scope, where)
        return _with_part(whole.value, indices, new)

    def _element(self, expression: Element, scope: RoutineScope, where: str) -> Data:
        whole = self.value(expression.array, scope, where)
        if isinstance(whole.value, Unknown):
            return Data("", whole.value)
        indices = self._indices(expression, whole, scope, where)
        return Data("", indices) if isinstance(indices, Unknown) else _part(whole, indices)

    def _indices(
        self, expression: Element, whole: Data, scope: RoutineScope, where: str
    ) -> list[int] | Unknown:
        """Return the places of an element, from 0."""
        indices, inner = [], whole.value
        if len(expression.indices) > whole.rank:
            raise ProgramError(
                f"{where}: expected {whole.rank} indices of an array, got {len(expression.indices)}"
            )
        for index in expression.indices:
            data = self.value(index, scope, where)
            if isinstance(data.value, Unknown):
                return data.value
            place = self.number(index, "an index", scope, where)
            assert isinstance(inner, tuple)
            if place != int(place) or not 1 <= place <= len(inner):
                raise ProgramError(
                    f"{where}: expected an index from 1 to {len(inner)}, got {place:g}"
                )
            indices.append(int(place) - 1)
            inner = inner[indices[-1]]
            if isinstance(inner, Unknown):
                return inner
        return indices

    def _call(self, call: FunctionCall, scope: RoutineScope, where: str) -> Data:
        name = call.name.upper()
        if self.memory.routine(name, scope) is not None:
            return self.run(call, scope, where)
        if name == "PRESENT":
            return self._present(call, scope, where)
        if name == "DIM":
            return self._dimension(call, scope, where)
        if not is_known(name):
            raise ProgramError(
                f"{where}: expected a function of RAPID or of the program, got"
                f" {shorten(call.name)}{self.memory.missing()}: put its module beside the program"
            )
        arguments, options = [], {}
        for argument in call.arguments:
            value: Value = True
            if argument.value is not None:
                value = self.value(argument.value, scope, where).value
            if argument.option:
                options[argument.option] = value
            else:
                arguments.append(value)
        for argument in call.arguments:
            if name in WRITING or argument.option in RETURNING:
                self.forget(argument, call.name, scope, where)
        if name in ASSUMED:
            self.memory.notes.assume(ASSUMED[name])
        return call_function(call.name, arguments, options, where)

    def _present(self, call: FunctionCall, scope: RoutineScope, where: str) -> Data:
        names = [a.value.name.upper() for a in call.arguments if isinstance(a.value, Name)]
        if len(names) != 1:
            raise ProgramError(f"{where}: expected the name of a parameter of Present, got none")
        return Data("bool", names[0] in scope.data)

    def _dimension(self, call: FunctionCall, scope: RoutineScope, where: str) -> Data:
        if len(call.arguments) != 2 or any(a.value is None for a in call.arguments):
            raise ProgramError(f"{where}: expected an array and the number of an index of Dim")
        array, which = (a.value for a in call.arguments if a.value is not None)
        whole = self.value(array, scope, where)
        if isinstance(whole.value, Unknown):
            return whole
        index = self.number(which, "the number of an index", scope, where)
        value: Value = whole.value
        if not 1 <= index <= whole.rank:
            raise ProgramError(f"{where}: expected one of {whole.rank} indices, got {index:g}")
        for _ in range(int(index) - 1):
            assert isinstance(value, tuple)
            value = value[0]
        assert isinstance(value, tuple)
        return Data("num", float(len(value)))


def _line(where: str) -> str:
    return where.rsplit(": ", 1)[-1]


def _are_numbers(a: Data, b: Data) -> bool:
    return {a.kind, b.kind} <= {"num", "dnum"}


def _part(whole: Data, indices: list[int]) -> Data:
    value = whole.value
    for index in indices:
        assert isinstance(value, tuple)
        value = value[index]
    return Data(whole.kind, value, whole.rank - len(indices))


def _with_part(value: Value, indices: list[int], new: Value) -> Value:
    if not indices:
        return new
    assert isinstance(value, tuple)
    at, *further_indices = indices
    return (*value[:at], _with_part(value[at], further_indices, new), *value[at + 1 :])
