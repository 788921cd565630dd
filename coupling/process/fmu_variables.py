"""Variables of a process FMU as its modelDescription declares them: type, causality, unit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from coupling.errors import CaseError, one_of

if TYPE_CHECKING:
    from fmpy.model_description import BaseUnit, ModelDescription, ModelVariable

_REALS = ("Real", "Float64")
# Exponents of kg, m and s of what a column is, with the unit that arrays have it in.
_DIMENSIONS = {
    **dict.fromkeys(("x", "y", "z"), ("m", (0, 1, 0))),
    **dict.fromkeys(("qx", "qy", "qz", "qw"), ("1", (0, 0, 0))),
    **dict.fromkeys(("fx", "fy", "fz"), ("N", (1, 1, -2))),
    **dict.fromkeys(("mx", "my", "mz"), ("N m", (1, 2, -2))),
    **dict.fromkeys(("kxx", "kxy", "kxz", "kyy", "kyz", "kzz"), ("N/m", (1, 0, -2))),
}
# Relative difference of steps that are one but for rounding of times.
_SAME_STEP = 1e-6


@dataclass(frozen=True)
class FmuVariable:
    """A variable of a process FMU that stands for a column of poses or wrenches.

    Attributes:
        name: Its name.
        factor, offset: SI value = factor * value + offset, by the unit that the FMU declares.

    Example:
        >>> FmuVariable("height", 1e-3, 0.0).from_si(np.array([0.25]))
        array([250.])
    """

    name: str
    factor: float = 1.0
    offset: float = 0.0

    def to_si(self, values: np.ndarray) -> np.ndarray:
        """Return values of the FMU [its unit], (n,), in SI units."""
        return self.factor * values + self.offset

    def from_si(self, values: np.ndarray) -> np.ndarray:
        """Return SI values, (n,), in the FMU's unit [its unit]."""
        return (values - self.offset) / self.factor


@dataclass(frozen=True)
class ProcessVariables:
    """Variables that a case names, checked against what the FMU declares.

    Attributes:
        inputs, outputs: Variables by their columns.
        has_variable_step: Whether the FMU can take steps of different lengths.
        needs_tool: Whether it says that it runs only where its tool is installed.
    """

    inputs: Mapping[str, FmuVariable]
    outputs: Mapping[str, FmuVariable]
    has_variable_step: bool
    needs_tool: bool

    def require_steps(self, time: np.ndarray, where: str) -> None:
        """Refuse times [s], (n,), at uneven steps where the FMU declares that it cannot take them.

        Raises:
            CaseError: If they are.
        """
        steps = np.diff(time)
        if self.has_variable_step or np.ptp(steps) <= _SAME_STEP * steps.max():
            return
        raise CaseError(
            f"{where}: expected an FMU that takes steps of any length, as the path has {steps.min():.6g}"
            f" to {steps.max():.6g} s, got canHandleVariableCommunicationStepSize = false: export it"
            " with variable steps, or give the path as a CSV with even times"
        )


def read_variables(
    file: Path,
    inputs: Mapping[str, str],
    outputs: Mapping[str, str],
    parameters: Mapping[str, float | int | bool | str],
) -> ProcessVariables:
    """Return the variables that a case names.

    Args:
        file: The FMU.
        inputs, outputs: Names of variables by columns.
        parameters: Start values by name.

    Raises:
        CaseError: If the FMU cannot be read, has no such variable, or one of another type, causality or
            dimension.
    """
    import fmpy

    where = f"process: {file}"
    try:
        description = fmpy.read_model_description(str(file), validate=False)
    except Exception as cause:  # whatever FMPy finds wrong with the file
        raise CaseError(f"{where}: is not a readable FMU: {cause}") from cause
    variables = {variable.name: variable for variable in description.modelVariables}
    if len(variables) < len(description.modelVariables):
        raise CaseError(f"{where}: expected variables of different names, got some names twice")
    units = {unit.name: unit.baseUnit for unit in description.unitDefinitions}

    def checked(
        table: str, names: Mapping[str, str], allowed: tuple[str, ...]
    ) -> dict[str, FmuVariable]:
        checked_variables = {
            column: _variable(
                f"{where}: {table}: {column}", column, name, variables, units, allowed
            )
            for column, name in names.items()
        }
        _require_different(f"{where}: {table}", names, variables)
        return checked_variables

    for name, value in parameters.items():
        if name in inputs.values():
            raise CaseError(
                f"{where}: parameters: expected no variable that the poses set, got {name!r}"
            )
        _require_parameter(f"{where}: parameters", variables, name, value)
    return ProcessVariables(
        checked("inputs", inputs, ("input",)),
        checked("outputs", outputs, ("output", "local", "calculatedParameter")),
        _has_variable_step(description),
        bool(description.coSimulation and description.coSimulation.needsExecutionTool),
    )


def _has_variable_step(description: ModelDescription) -> bool:
    simulation = description.coSimulation
    return simulation is None or bool(simulation.canHandleVariableCommunicationStepSize)


def _require_different(
    where: str, names: Mapping[str, str], variables: Mapping[str, ModelVariable]
) -> None:
    by_reference: dict[int, str] = {}  # several names may stand for one value
    for column, name in names.items():
        other = by_reference.setdefault(variables[name].valueReference, column)
        if other != column:
            raise CaseError(
                f"{where}: expected a variable for each column, got {name!r} for {other} and {column}"
            )


def _variable(
    where: str,
    column: str,
    name: str,
    variables: Mapping[str, ModelVariable],
    units: Mapping[str, BaseUnit | None],
    allowed: Iterable[str],
) -> FmuVariable:
    variable = variables.get(name)
    if variable is None:
        raise CaseError(f"{where}: {one_of(variables, name)}")
    if variable.type not in _REALS or variable.dimensions:
        kind = f"an array of {variable.type}" if variable.dimensions else str(variable.type)
        raise CaseError(f"{where}: expected a scalar Real or Float64, got {name!r}, {kind}")
    if str(variable.causality) not in allowed:
        raise CaseError(
            f"{where}: expected a variable of causality {' or '.join(allowed)}, got {name!r},"
            f" {variable.causality}"
        )
    declared = variable.declaredType
    unit = variable.unit or (declared.unit if declared is not None else None)
    si, dimension = _DIMENSIONS[column]
    if unit is None or (unit in _SI_NAMES.get(si, ()) and units.get(unit) is None):
        return FmuVariable(name)
    base = units.get(unit)
    if base is None:
        raise CaseError(
            f"{where}: expected {si} or a unit that the FMU defines by its base units, got {name!r} in"
            f" {unit!r}"
        )
    if not _is_of(base, dimension) or not base.factor > 0.0:
        raise CaseError(f"{where}: expected a unit of {si}, got {name!r} in {unit!r}")
    return FmuVariable(name, float(base.factor), float(base.offset))


# Ways to write the units of arrays where the FMU names a unit without defining it.
_SI_NAMES = {
    "m": ("m", "meter", "metre"),
    "1": ("1", "-", ""),
    "N": ("N",),
    "N m": ("N.m", "Nm", "N m", "N*m"),
    "N/m": ("N/m", "N.m-1"),
}


def _is_of(base: BaseUnit, dimension: tuple[int, int, int]) -> bool:
    """Return whether a unit has these exponents of kg, m, s and none of others but rad."""
    other_exponents = (base.A, base.K, base.mol, base.cd)
    return (base.kg, base.m, base.s) == dimension and not any(other_exponents)


# What a start value can be given to.
_SETTABLE = ("parameter", "structuralParameter", "input")
_TYPES: tuple[tuple[tuple[str, ...], str, Callable[[object], bool]], ...] = (
    (
        ("Real", "Float32", "Float64"),
        "a number",
        lambda v: isinstance(v, int | float) and not isinstance(v, bool),
    ),
    (("Boolean",), "true or false", lambda v: isinstance(v, bool)),
    (("String",), "a text", lambda v: isinstance(v, str)),
)


def _require_parameter(
    where: str, variables: Mapping[str, ModelVariable], name: str, value: object
) -> None:
    variable = variables.get(name)
    if variable is None:
        raise CaseError(f"{where}: {one_of(variables, name)}")
    if str(variable.causality) not in _SETTABLE or str(variable.variability) == "constant":
        raise CaseError(
            f"{where}: expected a variable of causality {' or '.join(_SETTABLE)}, got {name!r},"
            f" {variable.causality} and {variable.variability}"
        )
    for types, what, is_right in _TYPES:
        if variable.type in types and not is_right(value):
            raise CaseError(f"{where}: {name}: expected {what}, got {value!r}")
    if ("Int" in variable.type or variable.type == "Enumeration") and (
        isinstance(value, bool) or not isinstance(value, int)
    ):
        raise CaseError(f"{where}: {name}: expected a whole number, got {value!r}")
    _require_within(where, variable, value)


def _require_within(where: str, variable: ModelVariable, value: object) -> None:
    """Refuse a start value beyond the limits that the FMU, or the type of the variable, declares."""
    if isinstance(value, str | bool):
        return
    low, high = (
        _limit(getattr(variable, end) or getattr(variable.declaredType, end, None), at)
        for end, at in (("min", -np.inf), ("max", np.inf))
    )
    if not low <= float(value) <= high:  # type: ignore[arg-type]
        raise CaseError(
            f"{where}: {variable.name}: expected {low:g} to {high:g}, as the FMU declares, got {value!r}"
        )


def _limit(declared: str | None, otherwise: float) -> float:
    return otherwise if declared is None else float(declared)
