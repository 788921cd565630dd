"""Rotary axes of a five-axis machine: what its programs mean as seen from the part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator
from scipy.spatial.transform import Rotation

from coupling.files.toml_file import Schema, Vector3

Letter = Literal["A", "B", "C"]
Coordinates = Literal["tool-tip", "machine"]
_AXIS_DIRECTIONS = {"A": (1.0, 0.0, 0.0), "B": (0.0, 1.0, 0.0), "C": (0.0, 0.0, 1.0)}
_TOOL_AXIS = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Kinematics:
    """Rotary axes from the part to the tool; X, Y, Z are behind those that turn the part.

        part_from_tool = T_1(q_1) .. T_t(q_t) D(x, y, z) T_t+1(q_t+1) .. T_n(q_n)

    T_i(q) is the rotation by q about an axis through a point, D a displacement.  ISO 841 counts an axis
    positive where the tool turns by the right-hand rule relative to the part: a table turns the other
    way.

    Attributes:
        letters: Letters of the axes.
        directions: Unit vectors of the axes while all are at zero, part frame [1], (n, 3).
        points: Points on the axes while all are at zero [m], (n, 3): of those that turn the part in the
            part frame, of those that turn the tool from its tip.
        tables: Number t of axes that turn the part.

    Example:
        >>> table = Kinematics(("C", "A"), np.eye(3)[[2, 0]], np.zeros((2, 3)), tables=2)
        >>> table.axis(np.deg2rad([[90.0, 30.0]])).round(9) + 0.0
        array([[0.5      , 0.       , 0.8660254]])
    """

    letters: tuple[str, ...]
    directions: np.ndarray
    points: np.ndarray
    tables: int

    def axis(self, angles: np.ndarray) -> np.ndarray:
        """Return the vectors from the tool's tip to its holder, part frame [1], (k, 3).

        Args:
            angles: Angles of the axes [rad], (k, n).
        """
        vector = np.tile(_TOOL_AXIS, (len(angles), 1))
        for number in reversed(range(len(self.letters))):
            vector = self._turn(number, angles).apply(vector)
        return vector

    def tip(self, place: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Return the tool's tip in the part [m], (k, 3), where X, Y, Z are those of the linear axes.

        Args:
            place: X, Y, Z [m], (k, 3).
            angles: Angles of the axes [rad], (k, n).
        """
        point = np.zeros_like(place)
        for number in reversed(range(len(self.letters))):
            if number == self.tables - 1:
                point = point + place
            point = self.points[number] + self._turn(number, angles).apply(
                point - self.points[number]
            )
        return point if self.tables else point + place

    def _turn(self, number: int, angles: np.ndarray) -> Rotation:
        return Rotation.from_rotvec(np.outer(angles[:, number], self.directions[number]))


class RotaryTable(Schema):
    """Table [tool_path.rotary] of the case file: the rotary axes of the machine that G-code is for.

    Keys: axes, from the part to the tool, each "table" or "head" and its letter, with a minus where it
    turns against ISO 841; coordinates, what X, Y, Z are where the program does not say it; points_m,
    points on the axes, for machine coordinates; shortest, letters that go the shortest way to an angle.
    """

    axes: Annotated[list[str], Field(min_length=1, max_length=3)]
    coordinates: Coordinates | None = None
    points_m: dict[Letter, Vector3] = {}
    shortest: list[Letter] = []

    @field_validator("axes")
    @classmethod
    def _require_axes(cls, axes: list[str]) -> list[str]:
        for axis in axes:
            carrier, _, letter = axis.partition(" ")
            if carrier not in ("table", "head") or letter.removeprefix("-") not in _AXIS_DIRECTIONS:
                raise ValueError(
                    f'expected "table" or "head" and a letter A, B or C, as "table -A", got {axis!r}'
                )
        letters = [axis[-1] for axis in axes]
        if len(set(letters)) < len(letters):
            raise ValueError(f"expected each letter once, got {', '.join(letters)}")
        carriers = [axis.split()[0] for axis in axes]
        if carriers != sorted(carriers, reverse=True):
            raise ValueError(
                "expected axes from the part to the tool, those of the table first, got a head before a"
                " table"
            )
        return axes

    @model_validator(mode="after")
    def _complete(self) -> RotaryTable:
        letters = [axis[-1] for axis in self.axes]
        if unknown := [
            letter for letter in (*self.points_m, *self.shortest) if letter not in letters
        ]:
            raise ValueError(f"expected letters of axes, {', '.join(letters)}, got {unknown[0]}")
        missing = [letter for letter in letters if letter not in self.points_m]
        if self.coordinates == "machine" and missing:
            raise ValueError(
                f'expected points_m of all axes for coordinates = "machine", got none of {missing[0]}:'
                " give a point on each, a table's in the part frame, a head's from the tool's tip"
            )
        return self

    @property
    def kinematics(self) -> Kinematics:
        """The axes as seen from the part."""
        letters = tuple(axis[-1] for axis in self.axes)
        signs = [-1.0 if "-" in axis else 1.0 for axis in self.axes]
        directions = np.array(
            [
                np.multiply(sign, _AXIS_DIRECTIONS[letter])
                for sign, letter in zip(signs, letters, strict=True)
            ]
        )
        points = {str(letter): point for letter, point in self.points_m.items()}
        places = np.array([points.get(letter, [0.0, 0.0, 0.0]) for letter in letters])
        tables = sum(axis.startswith("table") for axis in self.axes)
        return Kinematics(letters, directions, places, tables)
