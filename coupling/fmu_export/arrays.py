"""The FMU's variables as FMI 3.0 has them: reals that belong together are one array."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from elastic_robot.fmi.interface import Block, Variable

_POSITION = "Position of {}: x, y, z in base axes"
_ORIENTATION = "Unit quaternion of {}: x, y, z, w; tool axes to base axes"
_ELASTIC, _RIGID = "the elastic robot's TCP", "the TCP with undeflected joints"
# Name and text of a block's arrays; of two, the first has three elements (er_array_size of interface.c).
_ARRAYS: dict[str, tuple[tuple[str, str], ...]] = {
    "wrench": (
        ("force", "Force on the tool at the TCP: x, y, z in base axes"),
        ("moment", "Moment on the tool at the TCP: x, y, z in base axes"),
    ),
    "q_cmd": (("q_cmd", "Angles of the drives at the step's start"),),
    "qd_cmd": (("qd_cmd", "Rates of the drives at the step's start"),),
    "qdd_cmd": (("qdd_cmd", "Accelerations of the drives, held over the step"),),
    "tcp": (
        ("tcp.position", _POSITION.format(_ELASTIC)),
        ("tcp.orientation", _ORIENTATION.format(_ELASTIC)),
    ),
    "velocity": (("tcp.velocity", "Velocity of the TCP: x, y, z in base axes"),),
    "rigid": (
        ("rigid.position", _POSITION.format(_RIGID)),
        ("rigid.orientation", _ORIENTATION.format(_RIGID)),
    ),
    "deviation": (
        ("deviation.position", "TCP minus rigid TCP: x, y, z in base axes"),
        (
            "deviation.rotation",
            "Rotation vector from the rigid to the elastic tool: x, y, z in base axes",
        ),
    ),
    "compliance": (
        (
            "compliance",
            "Static compliance of the TCP in base axes, displacement by force: xx, xy, xz, yy, yz, zz",
        ),
    ),
    "deflection": (("deflection", "Elastic angles, in the order of the stiffness parameters"),),
    "gravity": (("gravity", "Gravity: x, y, z in base axes"),),
}


@dataclass(frozen=True)
class ArrayVariable:
    """A variable of FMI 3.0.

    Attributes:
        name: Structured name.
        text: Description.
        reference: Value reference: that of the first element in FMI 2.0.
        elements: What FMI 2.0 has instead, (n,); one element of a scalar.
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
        ...     "gravity": Block("parameter", "tunable", axes),
        ...     "strings": Block("parameter", "fixed", (mode,)),
        ... }
        >>> found = array_variables(table)
        >>> [(v.name, len(v.elements), v.reference) for block in found.values() for v in block]
        [('gravity', 3, 0), ('mode', 1, 3)]
    """
    found: dict[str, tuple[ArrayVariable, ...]] = {}
    reference = 0
    for name, block in blocks.items():
        arrays = _ARRAYS.get(name, ())
        split = 3 if len(arrays) == 2 else len(block.variables)
        parts = (block.variables[:split], block.variables[split:])
        if arrays:
            starts = (reference, reference + split)
            found[name] = tuple(
                ArrayVariable(array, text, start, part, is_scalar=False)
                for (array, text), start, part in zip(arrays, starts, parts, strict=False)
                if part
            )
        else:
            found[name] = tuple(
                ArrayVariable(v.name, v.text, k, (v,), is_scalar=True)
                for k, v in enumerate(block.variables, start=reference)
            )
        reference += len(block.variables)
    return found
