"""Tilted planes of G-code: frames in which three axes are programmed."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.path.frame import Frame
from coupling.toolpaths.bounds import MAX_DISTANCE

_MAX_ANGLE = 720.0  # no plane is turned by more [deg]
# CYCLE800(FR, TC, ST, MODE, X0, Y0, Z0, A, B, C, X1, Y1, Z1, ...)
_MODE_ARGUMENT, _FIRST_COORDINATE, _LAST_COORDINATE = 3, 4, 13
# The mode of rotations about X, the new Y and the new Z.
_AXIS_BY_AXIS = "57"


def plane_of_g68_2(values: dict[str, float], unit: float) -> Frame:
    """Return the frame of G68.2, an origin and Euler angles about Z, the new X and the new Z.

    Args:
        values: Words of the line; they lose its own.
        unit: Unit of lengths [m].

    Raises:
        ValueError: If it is given in another form.

    Example:
        >>> plane = plane_of_g68_2({"X": 10.0, "I": 90.0, "J": 30.0}, 0.001)
        >>> plane.position, plane.rotate(np.array([0.0, 0.0, 1.0])).round(9) + 0.0
        (array([0.01, 0.  , 0.  ]), array([0.5      , 0.       , 0.8660254]))
    """
    if other := next((letter for letter in "PRQDH" if letter in values), None):
        raise ValueError(
            f"expected G68.2 with X, Y, Z and Euler angles I, J, K, got {other}{values[other]:g},"
            " another form of it: write Euler angles"
        )
    origin = np.array([values.pop(letter, 0.0) * unit for letter in "XYZ"])
    return _frame(origin, "ZXZ", np.array([values.pop(letter, 0.0) for letter in "IJK"]))


def plane_of_cycle800(statement: str, unit: float) -> Frame | None:
    """Return the frame of a CYCLE800 of Siemens', or None where it resets one.

    Args:
        statement: The cycle with its arguments, without blanks.
        unit: Unit of lengths [m].

    Raises:
        ValueError: If it is additive, or gives its angles in another way than axis by axis.

    Example:
        >>> plane_of_cycle800('CYCLE800(1,"TC1",0,57,0,0,0,0,-30,0,0,0,0,1)', 0.001).position
        array([0., 0., 0.])
    """
    arguments = statement.removeprefix("CYCLE800(").removesuffix(")").split(",")
    if arguments in ([""], ["0"]):
        return None
    if len(arguments) < _LAST_COORDINATE or arguments[_MODE_ARGUMENT] != _AXIS_BY_AXIS:
        mode = arguments[_MODE_ARGUMENT] if len(arguments) > _MODE_ARGUMENT else "none"
        raise ValueError(
            f"expected CYCLE800 with mode {_AXIS_BY_AXIS}, rotations axis by axis about X, Y, Z, got"
            f" {mode[:10]}: post-process in this mode"
        )
    try:
        status = int(arguments[2] or "0")
        numbers = [float(text or "0") for text in arguments[_FIRST_COORDINATE:_LAST_COORDINATE]]
    except ValueError as cause:
        raise ValueError(
            "expected numbers in CYCLE800, got something else: let the post-processor write them"
        ) from cause
    if status % 10 or status // 100 % 100:
        raise ValueError(
            f"expected CYCLE800 to set a new plane for the tool, got status {status}, an additive one or"
            " a tool that is set up: post-process with status 0"
        )
    before, angles, behind = (np.array(numbers[k : k + 3]) for k in (0, 3, 6))
    frame = _frame(unit * before, "XYZ", angles)
    return _frame(frame.points(unit * behind), "XYZ", angles)


def _frame(origin: np.ndarray, sequence: str, angles: np.ndarray) -> Frame:
    for name, values, most in (
        ("origin [m]", origin, MAX_DISTANCE),
        ("angles [deg]", angles, _MAX_ANGLE),
    ):
        if not np.abs(values).max() <= most:
            raise ValueError(
                f"expected a plane's {name} within {most:g}, got {np.abs(values).max():.4g}: look at it"
            )
    return Frame(origin, Rotation.from_euler(sequence, angles, degrees=True))
