"""The smooth torque curve in MuJoCo: a callback for what a gear with rounded backlash does not carry."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import copysign

import mujoco
import numpy as np


def rounded_relief(torsion: float, stiffness: float, backlash: float) -> float:
    """Return k x - S(x) [N m], S the backlash with rounded corners.

    S is 0 up to B/2, k (|x| - B/2)^2 / (2 B) up to 3B/2, then k (|x| - B): the default of the
    torque curve `spline` (docs/model.md), here as a formula instead of Akima's pieces.

    Args:
        torsion: x [rad].
        stiffness: k [N m/rad].
        backlash: B, half width of the backlash [rad], > 0.

    Example:
        >>> [round(rounded_relief(x, 1e6, 1e-4), 9) for x in (5e-5, 1e-4, -3e-4)]
        [50.0, 87.5, -100.0]
    """
    size = abs(torsion)
    beyond = size - 0.5 * backlash
    if beyond >= backlash:
        return copysign(stiffness * backlash, torsion)
    if beyond <= 0.0:
        return stiffness * torsion
    return copysign(stiffness * (size - beyond * beyond / (2.0 * backlash)), torsion)


@contextmanager
def smooth_backlash(
    first: int, angle: np.ndarray, drive: np.ndarray, stiffness: np.ndarray, backlash: np.ndarray
) -> Iterator[None]:
    """Let MuJoCo's user actuators follow the relief of rounded backlash as long as the block lasts.

    Args:
        first: Number of the first of them.
        angle, drive: Where MuJoCo keeps hinge and drive angles of each [rad].
        stiffness, backlash: k [N m/rad] and B [rad] of each.
    """
    gears = list(zip(stiffness.tolist(), backlash.tolist(), strict=True))

    def torque(model: mujoco.MjModel, data: mujoco.MjData, actuator: int) -> float:
        del model, data
        k = actuator - first
        return rounded_relief(angle[k] - drive[k], *gears[k])

    mujoco.set_mjcb_act_bias(torque)
    try:
        yield
    finally:
        mujoco.set_mjcb_act_bias(None)
