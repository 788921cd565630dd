"""Data of RAPID: kinds, records with their components, and values that only the controller knows."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NoReturn

from coupling.errors import ProgramError
from coupling.programs.poses import pose_of_quaternion
from coupling.programs.program import Pose
from coupling.programs.text import LARGEST, shorten
from coupling.programs.unknown import Unknown

# A quaternion written with few digits is normalised; beyond this it is a mistake.
_UNIT_TOLERANCE = 1e-3
# Written for an external axis that is not there.
NO_AXIS = 9e9
# Characters of a text, and elements of an array, at most.
_LONGEST_TEXT, _LARGEST_ARRAY = 1000, 20_000
_SINGLE = struct.Struct("f")

# Components of the records that RAPID defines, with their kinds.
_RECORDS = {
    "pos": "x num, y num, z num",
    "orient": "q1 num, q2 num, q3 num, q4 num",
    "pose": "trans pos, rot orient",
    "confdata": "cf1 num, cf4 num, cf6 num, cfx num",
    "extjoint": "eax_a num, eax_b num, eax_c num, eax_d num, eax_e num, eax_f num",
    "robjoint": "rax_1 num, rax_2 num, rax_3 num, rax_4 num, rax_5 num, rax_6 num",
    "robtarget": "trans pos, rot orient, robconf confdata, extax extjoint",
    "jointtarget": "robax robjoint, extax extjoint",
    "speeddata": "v_tcp num, v_ori num, v_leax num, v_reax num",
    "zonedata": (
        "finep bool, pzone_tcp num, pzone_ori num, pzone_eax num, zone_ori num, zone_leax num,"
        " zone_reax num"
    ),
    "loaddata": "mass num, cog pos, aom orient, ix num, iy num, iz num",
    "tooldata": "robhold bool, tframe pose, tload loaddata",
    "wobjdata": "robhold bool, ufprog bool, ufmec string, uframe pose, oframe pose",
}
# What data have that are declared without a value.
_EMPTY: dict[str, Value] = {"num": 0.0, "dnum": 0.0, "bool": False, "string": ""}


Value = float | bool | str | tuple["Value", ...] | Unknown


@dataclass(frozen=True, slots=True)
class Data:
    """A value and its kind.

    Attributes:
        kind: Name of the kind in small letters; empty for brackets, whose kind their use tells.
        value: Numbers in mm, deg and mm/s, as the text has them.
        rank: Number of indices of an array; 0 for what is none.
    """

    kind: str
    value: Value
    rank: int = 0


@dataclass
class Kinds:
    """Kinds of data: those of RAPID and those that a program defines.

    Attributes:
        records: Names and kinds of components, by the record's name in small letters.
    """

    records: dict[str, tuple[tuple[str, str], ...]] = field(
        default_factory=lambda: {name: components(text) for name, text in _RECORDS.items()}
    )

    def define(self, records: Mapping[str, tuple[tuple[str, str], ...]], file: str) -> None:
        """Add records that a program defines.

        Raises:
            ProgramError: If RAPID has one of their names.
        """
        for name, fields in records.items():
            if name in _RECORDS:
                raise ProgramError(
                    f"{file}: expected records of other names than RAPID's, got {name}"
                )
            self.records[name] = fields

    def shaped(self, kind: str, value: Value, where: str, rank: int = 0) -> Value:
        """Return a value as data of a kind hold it.

        Raises:
            ProgramError: If it is none of that kind.
        """
        if isinstance(value, Unknown) or not kind:
            return value
        if rank:
            if not isinstance(value, tuple) or len(value) > _LARGEST_ARRAY:
                _refuse(f"{kind} in an array of at most {_LARGEST_ARRAY}", value, where)
            return tuple(self.shaped(kind, item, where, rank - 1) for item in value)
        fields = self.records.get(kind)
        if fields is not None:
            if not isinstance(value, tuple) or len(value) != len(fields):
                names = ", ".join(name for name, _ in fields)
                _refuse(f"{kind}, in brackets {names}", value, where)
            return tuple(
                self.shaped(part, item, where)
                for (_, part), item in zip(fields, value, strict=True)
            )
        if kind in ("num", "dnum"):
            if isinstance(value, bool) or not isinstance(value, float):
                _refuse("a number", value, where)
            return value if kind == "dnum" else single(value, where)
        scalar = {"bool": bool, "string": str}.get(kind)
        if scalar is not None and not isinstance(value, scalar):
            _refuse(f"a value of {kind}", value, where)
        return value

    def empty(self, kind: str, extents: tuple[int, ...], where: str) -> Value:
        """Return what data of a kind hold before they get a value."""
        if math.prod(extents) > _LARGEST_ARRAY:
            raise ProgramError(
                f"{where}: expected an array of at most {_LARGEST_ARRAY} elements, got"
                f" {math.prod(extents)}"
            )
        if extents:
            return (self.empty(kind, extents[1:], where),) * extents[0]
        fields = self.records.get(kind)
        if fields is not None:
            return tuple(self.empty(part, (), where) for _, part in fields)
        return _EMPTY.get(kind, Unknown(f"data of {kind}"))

    def component(self, data: Data, name: str, where: str) -> Data:
        """Return a component of a record.

        Raises:
            ProgramError: If it has none of that name.
        """
        if not data.kind and isinstance(data.value, Unknown):
            return data
        at, kind = self._place(data, name, where)
        if isinstance(data.value, Unknown):
            return Data(kind, data.value)
        assert isinstance(data.value, tuple)
        return Data(kind, data.value[at])

    def with_component(self, data: Data, name: str, value: Value, where: str) -> Data:
        """Return a record with another value of a component.  Raises as `component`."""
        if not data.kind and isinstance(data.value, Unknown):
            return data
        at, _ = self._place(data, name, where)
        if isinstance(data.value, Unknown):
            return data
        assert isinstance(data.value, tuple)
        return Data(data.kind, (*data.value[:at], value, *data.value[at + 1 :]))

    def _place(self, data: Data, name: str, where: str) -> tuple[int, str]:
        fields = self.records.get(data.kind, ()) if data.rank == 0 else ()
        for at, (component, kind) in enumerate(fields):
            if component == name.lower():
                return at, kind
        raise ProgramError(
            f"{where}: expected a component of {data.kind or 'a record'}, got {shorten(name)!r}"
        )


def components(text: str) -> tuple[tuple[str, str], ...]:
    """Return names and kinds of components that are written name kind, name kind."""
    pairs = (part.split() for part in text.split(","))
    return tuple((name, kind) for name, kind in pairs)


def single(value: float, where: str) -> float:
    """Return a number as a controller keeps it, in single precision.

    Raises:
        ProgramError: If it is too large.
    """
    if value == NO_AXIS:  # no number of single precision, and never computed with
        return value
    if not abs(value) <= LARGEST:
        raise ProgramError(f"{where}: expected a number of at most {LARGEST:g}, got {value:g}")
    (rounded,) = _SINGLE.unpack(_SINGLE.pack(value))
    return float(rounded)


def text_of(value: str, where: str) -> str:
    """Return a text that is not too long.

    Raises:
        ProgramError: If it is.
    """
    if len(value) > _LONGEST_TEXT:
        raise ProgramError(
            f"{where}: expected a text of at most {_LONGEST_TEXT} characters, got {len(value)}"
        )
    return value


def numbers_of(value: Value, what: str, where: str) -> list[float]:
    """Return numbers that are all known.

    Raises:
        ProgramError: If they are not.
    """
    items = value if isinstance(value, tuple) else (value,)
    for item in items:
        if isinstance(item, Unknown):
            _refuse(what, item, where)
        if not isinstance(item, float) or item == NO_AXIS or not math.isfinite(item):
            _refuse(f"numbers as {what}", value, where)
    return [float(item) for item in items if isinstance(item, float)]


def pose_of(value: Value, where: str) -> Pose:
    """Return the pose of ((x, y, z), (w, x, y, z)).

    Raises:
        ProgramError: If it is none, or not known.
    """
    if not isinstance(value, tuple) or len(value) != 2:
        _refuse("[[x,y,z],[q1,q2,q3,q4]]", value, where)
    position = numbers_of(value[0], "position", where)
    quaternion = numbers_of(value[1], "quaternion", where)
    if (len(position), len(quaternion)) != (3, 4):
        _refuse("[[x,y,z],[q1,q2,q3,q4]]", value, where)
    length = sum(q * q for q in quaternion) ** 0.5
    if abs(length - 1.0) > _UNIT_TOLERANCE:
        raise ProgramError(f"{where}: expected a quaternion of length 1, got length {length:.6g}")
    return pose_of_quaternion(position, quaternion)


def value_of(pose: Pose) -> Value:
    """Return ((x, y, z), (w, x, y, z)) of a pose."""
    x, y, z, w = pose[3:]
    return tuple(1e3 * p for p in pose[:3]), (w, x, y, z)


def format_value(value: Value) -> str:
    """Return a value for a message."""
    if isinstance(value, Unknown):
        return value.name
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, str):
        return f'"{shorten(value)}"'
    return shorten(f"[{','.join(format_value(item) for item in value[:9])}]")


def _refuse(expected: str, value: Value, where: str) -> NoReturn:
    raise ProgramError(f"{where}: expected {expected}, got {format_value(value)}")


def require_truth(value: Value, where: str) -> bool:
    """Return the value of a condition.

    Raises:
        ProgramError: If it is none.
    """
    if not isinstance(value, bool):
        raise ProgramError(f"{where}: expected a condition, got {format_value(value)}")
    return value
