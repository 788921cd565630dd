"""The FMU's variables as masters see them: each real by itself, or some together as one array.

FMI 2.0 has scalars only.  FMI 3.0 has arrays too, but most masters do not read them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from elastic_robot.fmi.variables import Array, Block, Variable


@dataclass(frozen=True)
class VariableGroup:
    """A variable of an FMU: consecutive elements behind one value reference.

    Attributes:
        name: Structured name.
        text: Description.
        reference: Value reference: that of the first element.
        elements: Its elements, (n,); one of a scalar.
        is_scalar: Whether it has no dimension.
    """

    name: str
    text: str
    reference: int
    elements: tuple[Variable, ...]
    is_scalar: bool


Groups = Mapping[str, tuple[VariableGroup, ...]]


def scalars(blocks: Mapping[str, Block]) -> Groups:
    """Return the variables by block, each by itself.

    Example:
        >>> axes = tuple(Variable(f"gravity.{c}", "m/s2", "Gravity", 0.0) for c in "xyz")
        >>> found = scalars({"gravity": Block("parameter", "tunable", axes)})
        >>> [(v.name, v.reference, v.is_scalar) for v in found["gravity"]]
        [('gravity.x', 0, True), ('gravity.y', 1, True), ('gravity.z', 2, True)]
    """
    variables, reference = {}, 0
    for name, block in blocks.items():
        variables[name] = tuple(
            VariableGroup(v.name, v.text, reference + k, (v,), True)
            for k, v in enumerate(block.variables)
        )
        reference += len(block.variables)
    return variables


def arrays(blocks: Mapping[str, Block]) -> Groups:
    """Return the variables by block, with the arrays that it states; one without elements is left out.

    Example:
        >>> axes = tuple(Variable(f"gravity.{c}", "m/s2", "Gravity", 0.0) for c in "xyz")
        >>> mode = Variable("mode", "", "Mode", "dynamic")
        >>> table = {
        ...     "gravity": Block(
        ...         "parameter", "tunable", axes, arrays=(Array("gravity", "Gravity", 3),)
        ...     ),
        ...     "strings": Block("parameter", "fixed", (mode,)),
        ... }
        >>> found = arrays(table)
        >>> [(v.name, len(v.elements), v.reference) for block in found.values() for v in block]
        [('gravity', 3, 0), ('mode', 1, 3)]
    """
    return {
        name: _join_arrays(block.arrays, alone) if block.arrays else alone
        for (name, block), alone in zip(blocks.items(), scalars(blocks).values(), strict=True)
    }


def _join_arrays(
    stated: tuple[Array, ...], alone: tuple[VariableGroup, ...]
) -> tuple[VariableGroup, ...]:
    groups, first = [], 0
    for array in stated:
        part = alone[first : first + array.size]
        if part:
            elements = tuple(v for scalar in part for v in scalar.elements)
            groups.append(VariableGroup(array.name, array.text, part[0].reference, elements, False))
        first += array.size
    return tuple(groups)
