"""Desired motion of the links of a robot, and the result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.inverse.smooth_wrench import SmoothWrench
from coupling.inverse.spline import UniformSpline
from coupling.native.desk_links import GaussNewtonStep
from coupling.path.histories import WrenchHistory
from coupling.path.interpolation import InterpolatedPath, spline_through
from coupling.path.joint_path import JointPath

End = Literal["rest", "loaded", "free"]

# Degree of the splines that the links move along.
DEGREE = 5
# Longest distance of their nodes [s]: on the reference path 4 ms leave 0.2 um, 8 ms 4 um.
_SPACING = 0.004

# Weights of the sum of squares, whose unit is a micrometre at the tool: of errors of position [1/m], and
# of rotation [1/rad], 0.1 mrad as a micrometre.
OF_POSITION, OF_ROTATION = 1e6, 1e4
# Of the links' angular acceleration less the rigid robot's [s^2/rad].
OF_ACCELERATION = 0.2
# Of the links' angles less the rigid robot's, where a robot of more than six joints may move with its
# tool in place [1/rad]: they come back to them within a fifth of a second.
OF_ANGLE = 50.0
# Of a torque missing in a tilt, over that of its displacement of the tool against the tilt's stiffness
# and its inertia between two nodes.  Heavier, rounding takes over.
OF_BALANCE = 30.0


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

    @classmethod
    def of(
        cls, path: InterpolatedPath, rigid: JointPath, wrench: WrenchHistory, end: float
    ) -> LinkTask:
        """Return the motion with the tool on a path.

        Args:
            path: Desired path of the tool, base frame.
            rigid: Joint angles of the undeflected robot along it, from its start to its end.
            wrench: Wrench on the tool, likewise.
            end: Time at which the motion ends, the path's end or later [s].
        """
        start, last = float(rigid.time[0]), float(rigid.time[-1])
        intervals = int(np.ceil((end - start) / _SPACING - 1e-9))
        spacing = (end - start) / intervals
        begins: End = "rest" if path.at_rest[0] else "loaded"
        ends: End = "rest" if path.at_rest[1] else "free"
        # Behind its end the path stands still, or goes on as it did.
        until = last if ends == "rest" else np.inf

        def position(time: np.ndarray) -> np.ndarray:
            return path.position(np.minimum(time, until))

        def rotation(time: np.ndarray) -> Rotation:
            return path.rotation(np.minimum(time, last))

        nodes = start + spacing * np.arange(intervals + 1)
        guess = spline_through(rigid.time, rigid.q[0], path.at_rest)(np.minimum(nodes, until))
        smooth = SmoothWrench(wrench, spacing)
        return cls(start, spacing, intervals, position, rotation, smooth, guess, begins, ends)

    @property
    def nodes(self) -> np.ndarray:
        """Times of the nodes [s], (intervals + 1,)."""
        return self.start + self.spacing * np.arange(self.intervals + 1)


@dataclass(frozen=True)
class LinkMotion:
    """Motion of the links.

    Attributes:
        theta: All angles of the chain; those of the joints are phi = q + e.
        iterations: The way there.
        error: Distance of the tool from its path at the nodes [m], (intervals + 1,).
    """

    theta: UniformSpline
    iterations: tuple[GaussNewtonStep, ...] = field(default=())
    error: np.ndarray = field(default_factory=lambda: np.zeros(0))


def interpolating(task: LinkTask, values: np.ndarray) -> UniformSpline:
    """Return the spline through values at the nodes, any unit, (intervals + 1, quantities).

    At rest at an end that is at rest, with a linear outermost piece of its second derivative at others.
    """
    begins, ends = ((1, 2) if end == "rest" else (3, 4) for end in (task.begins, task.ends))
    return UniformSpline.through(task.start, task.spacing, values, DEGREE, (begins, ends))
