"""The FMU's variables -> the text that the C core reads (`native/fmi/interface.c`) behind the robot."""

from __future__ import annotations

from collections.abc import Mapping

from coupling.fmu_export.arrays import ArrayVariable, array_variables
from elastic_robot.fmi.interface import TOLERANCE, Block


def interface_text(blocks: Mapping[str, Block]) -> str:
    """Return a line for each variable of FMI 3.0, in the order of the value references.

    Reals: block, unit and the names of the elements, which are the variables of FMI 2.0.  Strings:
    name, start value and the values that they may have, if not any.

    Args:
        blocks: The variables.

    Example:
        >>> from elastic_robot.fmi.interface import Array, Variable
        >>> axes = tuple(Variable(f"gravity.{c}", "m/s2", "Gravity", 0.0) for c in "xyz")
        >>> mode = Variable("mode", "", "Mode", "fast", choices=("slow", "fast"))
        >>> gravity = Block("parameter", "tunable", axes, arrays=(Array("gravity", "Gravity", 3),))
        >>> strings = Block("parameter", "fixed", (mode,))
        >>> print(interface_text({"gravity": gravity, "strings": strings}))
        tolerance 1e-06
        reals gravity m/s2 gravity.x gravity.y gravity.z
        string mode fast slow fast
        end
    """
    lines = [f"tolerance {TOLERANCE!r}"]
    for key, variables in array_variables(blocks).items():
        lines += [_line(key, variable) for variable in variables]
    return "\n".join([*lines, "end"])


def _line(block: str, variable: ArrayVariable) -> str:
    first = variable.elements[0]
    if first.unit:
        return " ".join(["reals", block, first.unit, *(v.name for v in variable.elements)])
    start = [str(first.start)] if first.choices else []
    return " ".join(["string", first.name, *start, *first.choices])
