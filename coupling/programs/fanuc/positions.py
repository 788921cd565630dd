"""Positions of FANUC programs: X, Y, Z, W, P, R or joint angles, with the frames that they stand in."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coupling.errors import ProgramError
from coupling.programs.angles import pose_of_wpr, wpr_of
from coupling.programs.program import Pose
from coupling.programs.text import NUMBER, real, shorten

_GROUP = re.compile(r"\bGP(\d)\s*:")
_HEAD = re.compile(r"CONFIG\s*:\s*'[^'\n]*'|\b(UF|UT)\s*:\s*(\w+)")
_FIELD = re.compile(rf"([A-Z]\d*)\s*=\s*({NUMBER})\s*(mm|deg)")
_UNTAUGHT = re.compile(r"[A-Z]\d*\s*=\s*\**[.*]*\*\s*(?:mm|deg)?")
_AXIS = re.compile(r"J([1-9])")
_CARTESIAN = "XYZWPR"
_MAX_P = 90.0
_MM = 1e3


@dataclass(frozen=True)
class TpPosition:
    """Numbers of a position.

    Attributes:
        values: X, Y, Z [mm], W, P, R [deg], or joint angles [deg].
        is_joint: Whether they are joint angles.
        frame, tool: Numbers of the user frame and the tool that they belong to; None for any.
        others: Axes beside the robot's, of the rail or of other groups, with their values [mm], [deg].
    """

    values: tuple[float, ...]
    is_joint: bool = False
    frame: int | None = None
    tool: int | None = None
    others: tuple[tuple[str, float], ...] = ()

    @property
    def is_tilted_over(self) -> bool:
        """Whether controllers hold the pose by other angles, whose P is within 90 degrees."""
        return not self.is_joint and abs(self.values[4]) > _MAX_P

    @property
    def pose(self) -> Pose:
        """The pose of Cartesian numbers."""
        return pose_of_wpr(self.values)

    def plus(self, other: Sequence[float], sign: float = 1.0) -> TpPosition:
        """Return the sum, number by number, as the language adds positions."""
        values = tuple(a + sign * b for a, b in zip(self.values, other, strict=True))
        return TpPosition(values, self.is_joint, self.frame, self.tool, self.others)


def cartesian_of(pose: Pose) -> tuple[float, ...]:
    """Return X, Y, Z [mm], W, P, R [deg] of a pose.

    Example:
        >>> [round(x, 9) + 0.0 for x in cartesian_of((0.001, 0.0, 0.0, 0.0, 0.0, 0.5**0.5, 0.5**0.5))]
        [1.0, 0.0, 0.0, 0.0, 0.0, 90.0]
    """
    angles = wpr_of(np.array([pose]))[0].tolist()
    return (*(_MM * x for x in pose[:3]), *angles)


def position_of(text: str, where: str) -> TpPosition:
    """Return the position of its data.

    Args:
        text: Data between the braces.
        where: The position, for messages.

    Raises:
        ProgramError: If they are not whole, or hold what is not known.
    """
    parts = _GROUP.split(text)
    groups = dict(zip(parts[1::2], parts[2::2], strict=True)) or {"1": text}
    if "1" not in groups:
        raise ProgramError(
            f"{where}: expected a position of the robot, group GP1, got GP{min(groups)} alone"
        )
    heads = {head[1]: head[2] for head in _HEAD.finditer(groups["1"]) if head[1]}
    fields = _fields(groups["1"], where)
    others = [(name, value) for name, value in fields.items() if name.startswith("E")]
    for number, group in groups.items():
        if number != "1":
            others += [(f"GP{number} {name}", v) for name, v in _fields(group, where).items()]
    frame, tool = (_number(heads.get(word, "F"), where) for word in ("UF", "UT"))
    return TpPosition(*_values(fields, where), frame, tool, tuple(others))


def _fields(text: str, where: str) -> dict[str, float]:
    """Return the numbers of a group by their names."""
    fields: dict[str, float] = {}
    for part in re.split(r"[,\n]", _HEAD.sub("", text)):
        word = part.strip()
        if not word:
            continue
        field = _FIELD.fullmatch(word)
        if field is None:
            if _UNTAUGHT.fullmatch(word):
                raise ProgramError(f"{where}: expected a taught position, got {shorten(word)!r}")
            if re.match(r"R[XYZWPR]\b", word):
                raise ProgramError(
                    f"{where}: expected a position of a tool that the robot holds, got one of a tool"
                    f" that stands, RTCP: {shorten(word)!r}"
                )
            raise ProgramError(
                f"{where}: expected X, Y, Z in mm, W, P, R or J1, J2, .. in deg, got"
                f" {shorten(word)!r}"
            )
        unit = {"X": "mm", "Y": "mm", "Z": "mm", "W": "deg", "P": "deg", "R": "deg"}.get(field[1])
        if unit not in (None, field[3]):
            raise ProgramError(f"{where}: expected {field[1]} in {unit}, got {field[3]}")
        fields[field[1]] = real(field[2], where)
    return fields


def _values(fields: dict[str, float], where: str) -> tuple[tuple[float, ...], bool]:
    """Return the robot's numbers, and whether they are joint angles."""
    if any(_AXIS.fullmatch(name) for name in fields):
        axes = [name for name in fields if _AXIS.fullmatch(name)]
        if axes != [f"J{k}" for k in range(1, len(axes) + 1)]:
            raise ProgramError(f"{where}: expected J1, J2, .. in order, got {', '.join(axes)}")
        _require_known(fields, axes, where)
        return tuple(fields[name] for name in axes), True
    missing = [name for name in _CARTESIAN if name not in fields]
    if missing:
        raise ProgramError(
            f"{where}: expected X, Y, Z, W, P, R or J1, J2, .., got none of {', '.join(missing)}"
        )
    _require_known(fields, list(_CARTESIAN), where)
    return tuple(fields[name] for name in _CARTESIAN), False


def _require_known(fields: dict[str, float], known_fields: list[str], where: str) -> None:
    for name in fields:
        if name not in known_fields and not re.fullmatch(r"E\d", name):
            raise ProgramError(
                f"{where}: expected either X, Y, Z, W, P, R or J1, J2, .., got {name}"
            )


def _number(text: str, where: str) -> int | None:
    """Return the number of a frame; None for F, any."""
    if text.upper() == "F":
        return None
    if not re.fullmatch(r"\d{1,4}", text):
        raise ProgramError(f"{where}: expected the number of a frame or F, got {shorten(text)!r}")
    return int(text)
