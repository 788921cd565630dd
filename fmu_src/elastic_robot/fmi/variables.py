"""Variables of the FMU: single ones, arrays, and blocks of one kind."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

AXES = ("x", "y", "z")
POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
# Entries of a symmetric 3x3 matrix, in their order.
SYMMETRIC = ("xx", "xy", "xz", "yy", "yz", "zz")
Names = tuple[str, ...]
# In `exchanged`: the independent variable.
TIME = "time"
LONGEST_NAME = 63  # bytes; ER_NAME in C has its end beside them


@dataclass(frozen=True)
class Variable:
    """One FMI variable.

    Attributes:
        name: Structured name.
        unit: Unit of a real; empty for strings.
        text: Description.
        start: Start value of an input or parameter; None for outputs.
        minimum, maximum: Range, where there is one.
        nominal: Usual size, where it is not about 1.
        choices: Values that a string may have; empty for any.
        joint: Name of its joint in the robot's description; empty where there is none.
    """

    name: str
    unit: str
    text: str
    start: float | str | None = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    choices: Names = ()
    joint: str = ""

    @property
    def shown(self) -> str:
        """Its name in sentences: `q_cmd[2] (shoulder_lift)`, in at most `LONGEST_NAME` bytes."""
        room = max(LONGEST_NAME - len(f"{self.name} ()".encode()), 0)
        joint = self.joint.encode()[:room].decode(errors="ignore")
        return f"{self.name} ({joint})" if joint else self.name


@dataclass(frozen=True)
class Array:
    """Variables of a block, one after another, that are one array in an FMU of FMI 3.0 with arrays.

    Attributes:
        name: Structured name.
        text: Description.
        size: Number of elements.
    """

    name: str
    text: str
    size: int


class Group(NamedTuple):
    """Variables of one quantity, and the array that they are, or None."""

    variables: tuple[Variable, ...]
    array: Array | None


def group(
    array: str,
    unit: str,
    text: str,
    parts: Mapping[str, str],
    start: float | Sequence[float] | None = None,
    nominal: float | None = None,
    minimum: float | None = None,
    maximum: float | None = None,
) -> Group:
    """Return the variables of a quantity.

    Args:
        array: Name of the array that they are; "" where each stands alone.
        unit, text, start, nominal, minimum, maximum: As of `Variable`; `start` by variable or for all.
        parts: Part of the quantity that each is, by name.

    Example:
        >>> force = group("force", "N", "Force on the tool", along("force."), 0.0)
        >>> force.variables[1].text, force.array.text
        ('Force on the tool: y', 'Force on the tool: x, y, z')
    """
    starts = start if isinstance(start, Sequence) else [start] * len(parts)
    variables = tuple(
        Variable(name, unit, f"{text}: {part}", initial, minimum, maximum, nominal)
        for (name, part), initial in zip(parts.items(), starts, strict=True)
    )
    whole = Array(array, f"{text}: {', '.join(parts.values())}", len(parts))
    return Group(variables, whole if array else None)


def along(prefix: str, entries: Names = AXES) -> dict[str, str]:
    """Return the entries of a vector or matrix by the names of their variables."""
    return {f"{prefix}{entry}": entry for entry in entries}


def numbered(name: str, parts: Iterable[str]) -> dict[str, str]:
    """Return parts by the names `name[1]`, `name[2]` and so on."""
    return {f"{name}[{k}]": part for k, part in enumerate(parts, start=1)}


@dataclass(frozen=True)
class Block:
    """Consecutive variables of one kind.

    Attributes:
        causality: "input", "output", "parameter" or "local".
        variability: "continuous", "tunable" or "fixed".
        variables: Variables in the order of their value references.
        follows: For outputs, the blocks of inputs that their value at a step's end depends on, in
            one of the modes at least.
        starts_from: For outputs and derivatives, the blocks that their initial value depends on.
        arrays: Their arrays in FMI 3.0 with arrays; empty where each stands alone there too.
        exchanged: For outputs, derivatives and event indicators, the blocks that their value depends on
            in model exchange; TIME for what the drives of a trajectory move.
        elementwise: Those of them of which it is the element at the same place only.
        derivative_of: The block of states whose derivatives by time these are.
        is_event_indicator: Whether a change of their sign is an event of model exchange.
        tuned: For outputs, derivatives and event indicators, the blocks of tunable parameters that their
            value depends on, which are knowns in FMI 3.
    """

    causality: str
    variability: str
    variables: tuple[Variable, ...]
    follows: Names = ()
    starts_from: Names = ()
    arrays: tuple[Array, ...] = ()
    exchanged: Names = ()
    elementwise: Names = ()
    derivative_of: str = ""
    is_event_indicator: bool = False
    tuned: Names = ()

    @classmethod
    def of(cls, causality: str, variability: str, *groups: Group) -> Block:
        """Return the block of some quantities."""
        variables = tuple(variable for part in groups for variable in part.variables)
        arrays = tuple(part.array for part in groups if part.array is not None)
        return cls(causality, variability, variables, arrays=arrays)
