"""Arguments of the routines of a program: what their parameters are given."""

from __future__ import annotations

from collections.abc import Iterator

from coupling.errors import ProgramError
from coupling.programs.rapid.evaluation import RapidEvaluation
from coupling.programs.rapid.memory import RapidVariable, RoutineScope
from coupling.programs.rapid.syntax import (
    Argument,
    Component,
    Element,
    Expression,
    Name,
    Parameter,
    RapidRoutine,
)
from coupling.programs.rapid.values import Data


def bind_arguments(
    routine: RapidRoutine,
    arguments: tuple[Argument, ...],
    evaluation: RapidEvaluation,
    scope: RoutineScope,
    where: str,
) -> dict[str, RapidVariable]:
    """Return the parameters of a routine with what a call gives them.

    Raises:
        ProgramError: If the arguments are not those of the routine.
    """
    parameters: dict[str, RapidVariable] = {}
    for parameter, value in _pairs(routine, arguments, scope, where):
        key = parameter.name.upper()
        if value is None:
            parameters[key] = RapidVariable(Data("switch", True))
            continue
        if parameter.is_reference and isinstance(value, Component | Element):
            raise ProgramError(
                f"{where}: expected whole data for {parameter.name} of {routine.name}, which may change"
                " them, got a part: give a copy"
            )
        if parameter.is_reference and isinstance(value, Name):
            variable = evaluation.memory.variable(value.name, scope)
            parameters[key] = variable or evaluation.memory.undeclared(value.name)
            continue
        data = evaluation.value(value, scope, where)
        rank = parameter.rank
        shaped = evaluation.memory.kinds.shaped(parameter.kind, data.value, where, rank)
        parameters[key] = RapidVariable(Data(parameter.kind, shaped, rank))
    for parameter in routine.parameters:
        if not parameter.is_optional and parameter.name.upper() not in parameters:
            raise ProgramError(
                f"{where}: expected an argument {parameter.name} of {routine.name}, got none"
            )
    return parameters


def _pairs(
    routine: RapidRoutine, arguments: tuple[Argument, ...], scope: RoutineScope, where: str
) -> Iterator[tuple[Parameter, Expression | None]]:
    """Yield the parameters that a call gives, with its expressions."""
    placed = iter([parameter for parameter in routine.parameters if not parameter.is_optional])
    options = {
        parameter.name.upper(): parameter
        for parameter in routine.parameters
        if parameter.is_optional
    }
    for argument in arguments:
        if argument.is_conditional:
            assert isinstance(argument.value, Name)
            if argument.value.name.upper() not in scope.data:
                continue
        parameter = options.get(argument.option) if argument.option else next(placed, None)
        if parameter is None:
            got = f"\\{argument.option}" if argument.option else "more"
            raise ProgramError(f"{where}: expected the arguments of {routine.name}, got {got}")
        yield parameter, argument.value
