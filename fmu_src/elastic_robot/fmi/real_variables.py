"""Values of the FMU's real variables by value reference, and what may be set and read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from elastic_robot.errors import ParameterError, RangeError
from elastic_robot.fmi.variables import Block

# Blocks without numbers below zero, and what among them is above it.
_AT_LEAST_ZERO = ("contact", "stiffness", "damping", "backlash", "hysteresis", "tolerance")
_ABOVE_ZERO = ("stiffness",)
# Lists of variables of which the places are kept.
_LISTS_KEPT = 100


@dataclass(frozen=True)
class Places:
    """Indices of the variables of a list.

    Attributes:
        rows: Their index in the array of values; a slice where they follow one another.
        outputs: The blocks of what is computed among them: outputs and local variables.
        has_parameters: Whether there are parameters among them.
        has_angles: Whether there are angles of drives among them.
        has_ranges: Whether there are variables with a range among them.
        fixed: Value references of the fixed ones.
    """

    rows: slice | list[int]
    outputs: frozenset[str]
    has_parameters: bool
    has_angles: bool
    has_ranges: bool
    fixed: tuple[int, ...]


class RealVariables:
    """The values as one array; a block of variables is a slice of it.

    Args:
        table: The blocks of real variables, in the order of their value references.

    Attributes:
        values: All values, in the order of the value references.
    """

    def __init__(self, table: Mapping[str, Block]) -> None:
        self._slices: dict[str, slice] = {}
        self._block_of: list[str] = []
        self._table = table
        variables = [v for block in table.values() for v in block.variables]
        for key, block in table.items():
            first = len(self._block_of)
            self._block_of += [key] * len(block.variables)
            self._slices[key] = slice(first, len(self._block_of))
        self._names = [variable.shown for variable in variables]
        self._units = [variable.unit for variable in variables]
        self.values = np.array([float(variable.start or 0.0) for variable in variables])
        self._lists: dict[tuple[int, ...], Places] = {}

    def __len__(self) -> int:
        """Return the number of variables."""
        return len(self._names)

    def name(self, reference: int) -> str:
        """Return the name of a variable in sentences."""
        return self._names[reference]

    def slice_of(self, key: str) -> slice:
        """Return the indices of the values of a block."""
        return self._slices[key]

    def block(self, key: str) -> np.ndarray:
        """Return the values of a block, any unit, (size,): a view."""
        return self.values[self._slices[key]]

    def require_unfixed(self, references: Sequence[int]) -> None:
        """Raise a ParameterError for the first fixed parameter."""
        for k in self.places(references).fixed:
            raise ParameterError(f"{self._names[k]} is fixed; set it before initialisation ends")

    def places(self, references: Sequence[int]) -> Places:
        """Return the indices of variables; masters ask for the same few lists over and over.

        Raises:
            ParameterError: If there is no such variable.
        """
        key = tuple(references)
        known = self._lists.get(key)
        if known is None:
            known = self._find(key)
            if len(self._lists) < _LISTS_KEPT:
                self._lists[key] = known
        return known

    def set(self, references: Sequence[int], values: Sequence[float]) -> Places:
        """Set inputs and parameters; return where they are.

        Raises:
            ParameterError: If a variable is an output; nothing is set then.
            RangeError: If a value is not finite or out of a parameter's range; nor then.
        """
        places = self.places(references)
        self._require_finite(references, values, "", RangeError)
        if places.outputs:
            output = next(k for k in references if self._block_of[k] in places.outputs)
            kind = "an output" if self._kind(output) == "output" else "computed"
            raise ParameterError(f"{self._names[output]} is {kind} and cannot be set")
        if places.has_ranges:
            self._require_ranges(references, values)
        self.values[places.rows] = values
        return places

    def inputs(
        self, references: Sequence[int], derivatives: Sequence[float]
    ) -> list[tuple[str, int]]:
        """Return the blocks of inputs whose derivatives are given, and their places in them.

        Raises:
            ParameterError: If a variable is no input, or a derivative not finite.
        """
        self.places(references)
        found = []
        for reference, value in zip(references, derivatives, strict=True):
            key, name = self._block_of[reference], self._names[reference]
            if self._table[key].causality != "input":
                raise ParameterError(f"derivative: expected that of an input, got {name}")
            if not isfinite(value):
                raise ParameterError(f"derivative of {name}: expected a finite number, got {value}")
            found.append((key, reference - self._slices[key].start))
        return found

    def get(self, references: Sequence[int], places: Places) -> list[float]:
        """Return values.

        Raises:
            ParameterError: If one is not finite.
        """
        values: list[float] = self.values[places.rows].tolist()
        self._require_finite(references, values, ": give inputs and parameters of physical size")
        return values

    def _require_ranges(self, references: Sequence[int], values: Sequence[float]) -> None:
        for k, value in zip(references, values, strict=True):
            key = self._block_of[k]
            above = key in _ABOVE_ZERO or self._names[k] in _ABOVE_ZERO
            if key in _AT_LEAST_ZERO and not (value > 0.0 if above else value >= 0.0):
                raise RangeError(
                    f"{self._names[k]}: expected a number {'>' if above else '>='} 0, got"
                    f" {value} {self._units[k]}"
                )

    def _kind(self, reference: int) -> str:
        return self._table[self._block_of[reference]].causality

    def _find(self, references: tuple[int, ...]) -> Places:
        for reference in references:
            if not 0 <= reference < len(self):
                raise ParameterError(
                    f"value reference of a real variable: expected 0 to {len(self) - 1}, got {reference}"
                )
        blocks = {self._block_of[reference] for reference in references}
        kinds = {key: self._table[key].causality for key in blocks}
        first = references[0]
        follow = references == tuple(range(first, first + len(references)))
        return Places(
            rows=slice(first, first + len(references)) if follow else list(references),
            outputs=frozenset(key for key in blocks if kinds[key] in ("output", "local")),
            has_parameters="parameter" in kinds.values(),
            has_angles="q_cmd" in blocks,
            has_ranges=not blocks.isdisjoint(_AT_LEAST_ZERO),
            fixed=tuple(
                k for k in references if self._table[self._block_of[k]].variability == "fixed"
            ),
        )

    def _require_finite(
        self,
        references: Sequence[int],
        values: Sequence[float],
        advice: str,
        error: type[ParameterError] = ParameterError,
    ) -> None:
        if all(map(isfinite, values)):
            return
        k, value = next((k, v) for k, v in zip(references, values, strict=True) if not isfinite(v))
        raise error(
            f"{self._names[k]}: expected a finite number, got {value} {self._units[k]}{advice}"
        )
