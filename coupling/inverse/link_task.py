"""Desired motion of the links of a robot, and the result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.inverse.spline import UniformSpline

End = Literal["rest", "loaded", "free"]

# Degree of the splines that the links move along.
DEGREE = 5


@dataclass(frozen=True)
class Weights:
    """Weights of the sum of squares; the unit of the sum of squares is a micrometre at the tool.

    Attributes:
        position: Weight of a position error [1/m].
        rotation: Weight of a rotation error [1/rad]: 0.1 mrad counts as a micrometre.
        acceleration: Weight of the links' angular acceleration less the rigid robot's [s^2/rad].
        balance: Weight of a torque missing in a tilt, over that of its displacement of the tool against
            the tilt's stiffness and its inertia between two nodes.  Heavier, rounding takes over.
    """

    position: float = 1e6
    rotation: float = 1e4
    acceleration: float = 0.2
    balance: float = 30.0


@dataclass(frozen=True)
class LinkTask:
    """Desired motion of the links.

    Attributes:
        start, spacing, intervals: Nodes of the motion: start + k spacing [s].
        position: Function from times to desired positions of the TCP [m], (k, 3).
        rotation: Function from times to its rotations.
        wrench: Function from times to wrenches on the robot at the TCP, base axes, (k, 6).
        guess: Joint angles of the rigid robot at the nodes [rad], (intervals + 1, joints).
        begins, ends: How: at "rest"; "loaded", in mid-motion with tilts at rest under their static
            loads, as a simulation begins; or "free".
    """

    start: float
    spacing: float
    intervals: int
    position: Callable[[np.ndarray], np.ndarray]
    rotation: Callable[[np.ndarray], Rotation]
    wrench: Callable[[np.ndarray], np.ndarray]
    guess: np.ndarray
    begins: End = "rest"
    ends: End = "rest"

    @property
    def nodes(self) -> np.ndarray:
        """Times of the nodes [s], (intervals + 1,)."""
        return self.start + self.spacing * np.arange(self.intervals + 1)

    def part(self, first: int, last: int) -> LinkTask:
        """Return the task between two nodes; where it is cut the motion is free."""
        return replace(
            self,
            start=self.start + self.spacing * first,
            intervals=last - first,
            guess=self.guess[first : last + 1],
            begins=self.begins if first == 0 else "free",
            ends=self.ends if last == self.intervals else "free",
        )


@dataclass(frozen=True)
class GaussNewtonStep:
    """One pass of Gauss and Newton's method.

    Attributes:
        position, rotation: Largest error of the tool's pose before the pass [m], [rad].
        torque: Largest torque missing in a tilt before it [N m].
        step: Largest change of an angle in it [rad].
    """

    position: float
    rotation: float
    torque: float
    step: float


@dataclass(frozen=True)
class LinkMotion:
    """Motion of the links.

    Attributes:
        theta: All angles of the chain; those of the joints are phi = q + e.
        passes: The way there.
        error: Distance of the tool from its path at the nodes [m], (intervals + 1,).
    """

    theta: UniformSpline
    passes: tuple[GaussNewtonStep, ...] = field(default=())
    error: np.ndarray = field(default_factory=lambda: np.zeros(0))


def interpolating(task: LinkTask, values: np.ndarray) -> UniformSpline:
    """Return the spline through values at the nodes, any unit, (intervals + 1, quantities).

    At rest at an end that is at rest, with a linear outermost piece of its second derivative at others.
    """
    begins, ends = ((1, 2) if end == "rest" else (3, 4) for end in (task.begins, task.ends))
    return UniformSpline.through(task.start, task.spacing, values, DEGREE, (begins, ends))
