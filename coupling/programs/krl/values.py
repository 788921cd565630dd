"""Values of KRL: numbers, words, structures, and the geometric operator of frames."""

from __future__ import annotations

import numpy as np

from coupling.errors import ProgramError
from coupling.programs.angles import pose_of_abc
from coupling.programs.poses import inverse, product, zyx_of_pose
from coupling.programs.program import Pose
from coupling.programs.text import shorten
from coupling.programs.unknown import Unknown

FRAME_KEYS = tuple("XYZABC")
AXIS_KEYS = tuple(f"A{i}" for i in range(1, 7))
EXTERNAL_KEYS = tuple(f"E{i}" for i in range(1, 7))
REAL_KEYS = frozenset((*FRAME_KEYS, *AXIS_KEYS, *EXTERNAL_KEYS))
_MM = 1e3
# Beyond this, as a controller's numbers end, a program is mistaken.
_MAX_NUMBER = 1e8


# A structure; names of its components are upper case.
Aggregate = dict[str, "Value"]
# Numbers; `#WORD` of an enumeration; `"text"`; structures; what is not known.
Value = bool | int | float | str | Aggregate | Unknown


class UnknownValueError(Exception):
    """A value is needed that the program does not tell.

    Attributes:
        value: Unknown value.
    """

    def __init__(self, value: Unknown) -> None:
        super().__init__(value.name)
        self.value = value


def null_frame() -> Aggregate:
    """Return the frame of zeros."""
    return dict.fromkeys(FRAME_KEYS, 0.0)


def copy_value(value: Value) -> Value:
    """Return a value that does not change with the first one."""
    return (
        {key: copy_value(part) for key, part in value.items()} if isinstance(value, dict) else value
    )


def single(value: float) -> float:
    """Return a number in single precision, as a controller keeps it."""
    return float(np.float32(value))


def is_number(value: object) -> bool:
    """Return whether a value is INT or REAL."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def number(value: Value, where: str) -> float:
    """Return a finite number.

    Raises:
        ProgramError: If it is none, or too large.
        UnknownValueError: If it is not known.
    """
    if isinstance(value, Unknown):
        raise UnknownValueError(value)
    if not is_number(value):
        raise ProgramError(f"{where}: expected a number, got {describe_value(value)}")
    assert not isinstance(value, str | dict)
    if not abs(value) <= _MAX_NUMBER:
        raise ProgramError(f"{where}: expected a number of at most {_MAX_NUMBER:g}, got {value:g}")
    return value


def describe_value(value: Value) -> str:
    """Return a value as a message shows it."""
    if isinstance(value, Unknown):
        return value.name
    if isinstance(value, dict):
        inner = ",".join(f"{key} {describe_value(part)}" for key, part in value.items())
        return shorten("{" + inner + "}")
    return shorten(str(value).upper() if isinstance(value, bool) else str(value))


def pose_of_frame(frame: Aggregate, where: str) -> Pose:
    """Return the pose of X, Y, Z [mm], A, B, C [deg]; components that are missing are zero."""
    return pose_of_abc([number(frame.get(key, 0.0), where) for key in FRAME_KEYS])


def frame_of_pose(pose: Pose) -> Aggregate:
    """Return X, Y, Z [mm], A, B, C [deg] of a pose, C being zero where it turns about A's axis.

    Example:
        >>> frame = frame_of_pose(pose_of_abc([1.0, 2.0, 3.0, 10.0, 20.0, 30.0]))
        >>> [round(frame[key], 9) for key in FRAME_KEYS]
        [1.0, 2.0, 3.0, 10.0, 20.0, 30.0]
    """
    values = (*(_MM * p for p in pose[:3]), *zyx_of_pose(pose))
    return dict(zip(FRAME_KEYS, values, strict=True))


def compose_frames(left_value: Value, right: Value, where: str) -> Aggregate:
    """Return left:right, the frame `right` seen from `left`; components that are missing are zero.

    Status, turn and external axes are those of `right`.

    Raises:
        ProgramError: If one is not a frame.
    """
    for side in (left_value, right):
        if isinstance(side, Unknown):
            raise UnknownValueError(side)
        if not isinstance(side, dict) or any(key in side for key in AXIS_KEYS):
            raise ProgramError(f"{where}: expected frames beside ':', got {describe_value(side)}")
    assert isinstance(left_value, dict)
    assert isinstance(right, dict)
    result = frame_of_pose(product(pose_of_frame(left_value, where), pose_of_frame(right, where)))
    return result | {key: part for key, part in right.items() if key not in FRAME_KEYS}


def invert_frame(frame: Value, where: str) -> Aggregate:
    """Return the inverse of a frame, INV_POS.  Raises as `compose_frames`."""
    checked = compose_frames(frame, null_frame(), where)
    return frame_of_pose(inverse(pose_of_frame(checked, where)))
