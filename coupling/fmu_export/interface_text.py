"""The FMU's variables -> the text that the C core reads (`native/fmi/interface.c`) behind the robot."""

from __future__ import annotations

from collections.abc import Mapping

from coupling.fmu_export.grouping import Groups, VariableGroup
from elastic_robot.fmi.inputs import limits_of
from elastic_robot.fmi.tolerance import LEAST, MOST, RELATIVE, TOLERANCE
from elastic_robot.fmi.variables import Block

# Stands for a blank in a name; ER_BLANK in C.
BLANK = "~"


def interface_text(blocks: Mapping[str, Block], groups: Groups) -> str:
    """Return a line for each variable, in the order of the value references.

    Before them the tolerance to begin with, the relative one that is the same, and their limits; the
    blocks of states of model exchange, that of their derivatives and how large they are, and those of
    event indicators, in the order of modelDescription.xml, which is made of the same blocks; and the
    lowest and highest angle of every drive.
    Reals: block, unit and the names of the elements in sentences, without blanks.  Strings: name,
    start value, where it is not empty, and the values that they may have, if not any.

    Args:
        blocks: The variables.
        groups: The same as masters see them.

    Example:
        >>> from coupling.fmu_export.grouping import arrays
        >>> from elastic_robot.fmi.variables import Array, Block, Variable
        >>> axes = tuple(Variable(f"gravity.{c}", "m/s2", "Gravity", 0.0) for c in "xyz")
        >>> mode = Variable("mode", "", "Mode", "fast", choices=("slow", "fast"))
        >>> gravity = Block("parameter", "tunable", axes, arrays=(Array("gravity", "Gravity", 3),))
        >>> strings = Block("parameter", "fixed", (mode,))
        >>> table = {"gravity": gravity, "strings": strings}
        >>> print(interface_text(table, arrays(table)))
        tolerance 1e-06 0.0001 1e-09 1e-05
        limits
        reals gravity m/s2 gravity.x gravity.y gravity.z
        string mode fast slow fast
        end
    """
    tolerances = " ".join(map(repr, (TOLERANCE, RELATIVE, LEAST, MOST)))
    limits = [
        repr(limit)
        for drives in groups.get("q_cmd", ())
        for variable in drives.elements
        for limit in limits_of(variable)
    ]
    lines = [f"tolerance {tolerances}"]
    for name, block in blocks.items():
        if block.derivative_of and block.variables:
            nominal = blocks[block.derivative_of].variables[0].nominal
            lines.append(f"state {block.derivative_of} {name} {nominal!r}")
    lines += [f"indicator {k}" for k, b in blocks.items() if b.is_event_indicator and b.variables]
    lines.append(" ".join(["limits", *limits]))
    for key, variables in groups.items():
        lines += [_line(key, variable) for variable in variables]
    return "\n".join([*lines, "end"])


def _line(block: str, variable: VariableGroup) -> str:
    first = variable.elements[0]
    if first.unit:
        names = [v.shown.replace(" ", BLANK) for v in variable.elements]
        return " ".join(["reals", block, first.unit, *names])
    start = [str(first.start)] if first.start else []
    return " ".join(["string", first.name, *start, *first.choices])
