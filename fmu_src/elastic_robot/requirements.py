"""What the numbers of a robot's description must be; each refusal tells the key and what was got."""

from __future__ import annotations

import math

import numpy as np

Vector = tuple[float, ...]

# A direction must be given to this accuracy in length; it is normalised afterwards.
_UNIT_LENGTH_TOLERANCE = 1e-9


def require_number(key: str, value: float, *, minimum: float, open_end: bool, unit: str) -> None:
    """Refuse what is no finite number from, or above, a minimum.

    Raises:
        ValueError: With the key, what was expected and what was got.
    """
    good = math.isfinite(value) and (value > minimum if open_end else value >= minimum)
    if not good:
        bound = f"{'>' if open_end else '>='} {minimum:g}"
        raise ValueError(f"{key}: expected a finite number {bound} [{unit}], got {value!r}")


def require_vector(key: str, value: Vector, length: int, unit: str) -> None:
    """Refuse what is not `length` finite numbers.

    Raises:
        ValueError: With the key, what was expected and what was got.
    """
    if len(value) != length or not all(map(math.isfinite, value)):
        raise ValueError(f"{key}: expected {length} finite numbers [{unit}], got {list(value)}")


def unit_vector(key: str, value: Vector) -> Vector:
    """Return a direction normalised, (3,).

    Raises:
        ValueError: If its length differs from 1 by more than what rounding in a file does.
    """
    require_vector(key, value, 3, "unit vector")
    length = float(np.linalg.norm(value))
    if abs(length - 1.0) > _UNIT_LENGTH_TOLERANCE:
        advice = "a direction" if length == 0.0 else f"{[float(c) / length for c in value]}"
        raise ValueError(
            f"{key}: expected a unit vector, got {list(value)}, of length {length:.9g}: give {advice}"
        )
    if abs(length - 1.0) < 1e-15:  # already rounded to the last bit: a copy stays identical
        return value
    return tuple(float(c) / length for c in value)


def require_pairs(name: str, table: np.ndarray, least: int) -> None:
    """Refuse what is not a table of pairs (angle [rad], torque [N m]), at least `least` of them.

    Raises:
        ValueError: With the name, what was expected and how many points were got.
    """
    if table.ndim != 2 or table.shape[1] != 2 or len(table) < least or not np.isfinite(table).all():
        raise ValueError(
            f"{name}: expected at least {least} pairs of finite numbers [rad, N m], got"
            f" {len(table)} points"
        )
