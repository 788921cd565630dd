"""Impulses of a sampled torque over even steps."""

from __future__ import annotations

import ctypes

import numpy as np

from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, finite_numbers

# Samples that a spline of a torque goes through at least.
_FEWEST_SAMPLES = 4


class _SampledTorque(ctypes.Structure):
    """er_sampled_torque of desk/impulse.h."""

    _fields_ = (
        ("count", ctypes.c_int64),
        ("spacing", ctypes.c_double),
        ("torque", ctypes.c_void_p),
        ("work", ctypes.c_void_p),
    )


def torque_impulses(spacing: float, torque: np.ndarray, steps: int, length: float) -> np.ndarray:
    """Return the impulses of a torque over steps from its first sample on [N m s], (steps,).

    Args:
        spacing: Distance of the samples [s].
        torque: Samples of the torque, four or more [N m], (k,); a cubic spline goes through them, and
            behind the last one it stays.
        steps: Number of steps.
        length: Length of a step [s].

    Raises:
        ValueError: If there are fewer than four samples, or one is not finite.

    Example:
        >>> torque_impulses(0.5, np.array([0.0, 0.25, 1.0, 2.25, 4.0]), 2, 1.0).round(12).tolist()
        [0.333333333333, 2.333333333333]
    """
    samples = finite_numbers("torque", torque, (len(torque),))
    if len(samples) < _FEWEST_SAMPLES:
        raise ValueError(f"expected {_FEWEST_SAMPLES} samples or more, got {len(samples)}")
    work, impulse = np.empty_like(samples), np.empty(steps)
    sampled = _SampledTorque(len(samples), spacing, address(samples), address(work))
    loaded_library().er_impulses(
        ctypes.byref(sampled), ctypes.c_int64(steps), ctypes.c_double(length), address(impulse)
    )
    return impulse
