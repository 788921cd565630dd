"""The FMU's variables as FMI 3.0 has them: reals that belong together are one array."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from elastic_robot.fmi.interface import Array, Block, Variable


@dataclass(frozen=True)
class ArrayVariable:
    """A variable of FMI 3.0.

    Attributes:
        name: Structured name.
        text: Description.
        reference: Value reference: that of the first element in FMI 2.0.
        elements: Variables that FMI 2.0 has instead, (n,); one element of a scalar.
        is_scalar: Whether it has no dimension.
    """

    name: str
    text: str
    reference: int
    elements: tuple[Variable, ...]
    is_scalar: bool


def array_variables(blocks: Mapping[str, Block]) -> dict[str, tuple[ArrayVariable, ...]]:
    """Return the variables of FMI 3.0 by block; a block without elements has none.

    Example:
        >>> axes = tuple(Variable(f"gravity.{c}", "m/s2", "Gravity", 0.0) for c in "xyz")
        >>> mode = Variable("mode", "", "Mode", "dynamic")
        >>> table = {
        ...     "gravity": Block(
        ...         "parameter", "tunable", axes, arrays=(Array("gravity", "Gravity", 3),)
        ...     ),
        ...     "strings": Block("parameter", "fixed", (mode,)),
        ... }
        >>> found = array_variables(table)
        >>> [(v.name, len(v.elements), v.reference) for block in found.values() for v in block]
        [('gravity', 3, 0), ('mode', 1, 3)]
    """
    found: dict[str, tuple[ArrayVariable, ...]] = {}
    reference = 0
    for name, block in blocks.items():
        scalars = tuple(Array(v.name, v.text, 1) for v in block.variables)
        first, joined = 0, []
        for array in block.arrays or scalars:
            part = block.variables[first : first + array.size]
            if part:
                place = reference + first
                joined.append(ArrayVariable(array.name, array.text, place, part, not block.arrays))
            first += array.size
        reference += first
        found[name] = tuple(joined)
    return found
