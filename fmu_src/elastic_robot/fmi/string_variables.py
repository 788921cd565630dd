"""Values of the FMU's string variables by value reference."""

from __future__ import annotations

from collections.abc import Sequence

from elastic_robot.errors import ParameterError, RangeError
from elastic_robot.fmi.interface import LONGEST_TEXT
from elastic_robot.fmi.variables import Variable


class StringVariables:
    """The values by name.

    Args:
        variables: Variables in the order of their value references.
        first: Value reference of the first.

    Attributes:
        values: Values by name, in the order of the value references.
    """

    def __init__(self, variables: Sequence[Variable], first: int) -> None:
        self._variables, self._first = tuple(variables), first
        self.values = {variable.name: str(variable.start) for variable in variables}

    def __getitem__(self, name: str) -> str:
        """Return the value of a variable."""
        return self.values[name]

    def get(self, references: Sequence[int]) -> list[str]:
        """Return values.

        Raises:
            ParameterError: If there is no such variable.
        """
        return [self.values[variable.name] for variable in self._asked(references)]

    def set(self, references: Sequence[int], values: Sequence[str | None]) -> None:
        """Set values.

        Raises:
            ParameterError: If there is no such variable or it cannot have its value; nothing is set
                then.
        """
        pairs = list(zip(self._asked(references), values, strict=True))
        new = {variable.name: _checked(variable, value) for variable, value in pairs}
        self.values = {**self.values, **new}

    def of(self, values: Sequence[str]) -> dict[str, str]:
        """Return values of all variables by name."""
        return dict(zip(self.values, values, strict=True))

    def _asked(self, references: Sequence[int]) -> list[Variable]:
        last = self._first + len(self._variables) - 1
        for reference in references:
            if not self._first <= reference <= last:
                raise ParameterError(
                    f"value reference of a string variable: expected {self._first} to {last}, got"
                    f" {reference}"
                )
        return [self._variables[reference - self._first] for reference in references]


def _checked(variable: Variable, value: str | None) -> str:
    if value is None:
        raise ParameterError(f"{variable.name}: expected a text, got NULL")
    if variable.choices and value not in variable.choices:
        raise RangeError(
            f"{variable.name}: expected one of {', '.join(variable.choices)}, got {value[:200]!r}"
        )
    if len(value.encode()) >= LONGEST_TEXT:
        raise RangeError(
            f"{variable.name}: expected less than {LONGEST_TEXT} characters, got {len(value.encode())}"
        )
    return value
