"""Commands of a robot's controller: rows on its cycle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.path.joint_path import JointPath

Interpolation = Literal["cubic", "quintic"]
INTERPOLATIONS: tuple[Interpolation, ...] = get_args(Interpolation)

# Rounding of a duration over a cycle that counts as none.
_CYCLE_ROUNDING = 1e-9


@dataclass(frozen=True)
class Controller:
    """Commands that a robot's controller takes.

    Attributes:
        cycle: Time from row to row [s], > 0.
        interpolation: Motion between rows. "cubic": rows are angles alone, the motion is the C2
            cubic spline through them with zero rate at both ends. "quintic": rows have rates and
            accelerations as well, the motion is the quintic Hermite spline.
        max_acceleration: Highest acceleration that it allows any joint [rad/s^2]; None: the robot's own.

    Example:
        >>> Controller(cycle=0.01).rows(1.0, 1.025)
        array([1.  , 1.01, 1.02, 1.03])
    """

    cycle: float = 0.004
    interpolation: Interpolation = "quintic"
    max_acceleration: float | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.cycle) and self.cycle > 0.0):
            raise ValueError(f"cycle: expected a finite number > 0 [s], got {self.cycle!r}")
        if self.interpolation not in INTERPOLATIONS:
            raise ValueError(
                f"interpolation: expected one of {', '.join(INTERPOLATIONS)}, got"
                f" {self.interpolation!r}"
            )

    def rows(self, start: float, end: float) -> np.ndarray:
        """Return times start, start + cycle, ... up to the first that is not before `end` [s], (n,)."""
        cycles = int(np.ceil((end - start) / self.cycle * (1.0 - _CYCLE_ROUNDING)))
        times = start + self.cycle * np.arange(max(cycles, 1) + 1)
        times[-1] = max(times[-1], end)  # rounding must not leave the end uncovered
        return times


def on_cycle(joints: JointPath, controller: Controller) -> JointPath:
    """Return the motion through angles as rows on the controller's cycle.

    The motion is the C2 cubic spline through the angles with zero rate at both ends.  Rows of angles,
    rates and accelerations of it give the same motion again where the cycle divides the steps between
    samples.  Samples closer than the cycle say more than rows can: the motion is then the spline
    through its values at the rows, which leaves out what is faster than these, whatever the
    interpolation.  A row behind the last sample continues the spline's last piece.

    Args:
        joints: Angles at samples; rates and accelerations are not looked at.
        controller: Controller that takes the rows.
    """
    rows = controller.rows(joints.time[0], joints.time[-1])
    splines = [CubicSpline(joints.time, q, bc_type="clamped") for q in joints.q]
    if np.diff(joints.time).min() < controller.cycle * (1.0 - _CYCLE_ROUNDING):
        splines = [CubicSpline(rows, spline(rows), bc_type="clamped") for spline in splines]
    angles, rates, accelerations = (
        tuple(spline(rows, order) for spline in splines) for order in range(3)
    )
    if controller.interpolation == "cubic":
        return JointPath(rows, angles)
    return JointPath(rows, angles, rates, accelerations)
