"""A frame touched off by a robot that sags: what its controller shows, and where the tool really is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.errors import PlanningError
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.path.length_text import format_um
from coupling.robot.inverse_kinematics import InverseKinematics
from elastic_robot.description import Robot
from elastic_robot.errors import EquilibriumError
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

# A command that brings the sagging tool to a real point is found to this [m], in so many iterations.
_TOLERANCE, _ITERATIONS = 1e-12, 30
# Largest residual of that after all iterations [m]: below the accuracy of any touch.
_MAX_RESIDUAL = 1e-7


class UntouchableError(PlanningError):
    """A robot cannot stand at a point that it is to touch.

    Attributes:
        point: The point by its number, from 1.
    """

    def __init__(self, words: str, point: int) -> None:
        super().__init__(words)
        self.point = point


@dataclass(frozen=True)
class TouchOff:
    """Frame that a robot takes for the world, as it was touched off where it stood with its sag.

    Attributes:
        real_from_shown: World that its controller shows, in the real one: where the tool at rest was.
        residual: Largest distance of a touched point from that [m].

    Example:
        >>> shown = np.array([[1.0, 0.0, 0.0]])
        >>> sagged = TouchOff.of(shown, shown - np.array([0.0, 0.0, 0.008]))
        >>> path = ToolPath(np.array([0.0, 1.0]), np.tile([1.0, 0, 0, 0, 0, 0, 1.0], (2, 1)))
        >>> sagged.programmed(path).position[0, 0].tolist()
        [1.0, 0.0, 0.008]
    """

    real_from_shown: Frame
    residual: float

    @classmethod
    def of(cls, commanded: np.ndarray, real: np.ndarray) -> TouchOff:
        """Return the displacement that fits touched points best, from one point a shift alone.

        Args:
            commanded: Positions of the TCP that the controller shows, world axes [m], (n, 3).
            real: Real positions, world axes [m], (n, 3).
        """
        real_from_shown = Frame.fitted(commanded, real)
        residual = real - real_from_shown.points(commanded)
        return cls(real_from_shown, float(np.linalg.norm(residual, axis=1).max()))

    def programmed(self, path: ToolPath) -> ToolPath:
        """Return a real path in the world as the program has it."""
        return path.transformed(self.real_from_shown.inverse())


@dataclass(frozen=True)
class RestingRobot:
    """A robot that stands still under its own weight.

    Attributes:
        home: Joint angles near which the points are reached [rad], (joints,).
    """

    robot: Robot
    torque_curve: str
    home: np.ndarray
    world_from_base: Frame

    def tool_at(self, commanded: np.ndarray, rotation: Rotation) -> np.ndarray:
        """Return the tool's positions at rest under commands to points, world axes [m], (n, 3).

        Gears with hysteresis come to each of them from no load.

        Args:
            commanded: Positions of the TCP that the controller shows [m], (n, 3).
            rotation: world_from_tool that is commanded, the same at all points.

        Raises:
            UntouchableError: If a point is out of reach or the robot finds no rest there.
        """
        elastic = ElasticRobot(self.robot, self.torque_curve, quasistatic=True)
        near, positions = self.home, []
        for k, point in enumerate(commanded, start=1):
            standstill = ToolPath.with_rotation(
                np.array([0.0, 1.0]), np.array([point, point]), rotation
            )
            path = standstill.transformed(self.world_from_base.inverse())
            try:
                near = InverseKinematics(self.robot, near).plan(path).q[0][0]
                zero = np.zeros_like(near)
                elastic.reset(0.0, HeldCommand(0.0, near, zero, zero), Load())
            except (PlanningError, EquilibriumError) as cause:
                raise UntouchableError(
                    f"point {k}, at {np.round(point, 4).tolist()} m: {cause}: give points that the robot"
                    " can touch",
                    k,
                ) from cause
            positions.append(elastic.tcp()[:3])
        return self.world_from_base.points(np.array(positions))

    def command_for(self, real: np.ndarray, rotation: Rotation) -> np.ndarray:
        """Return the commands under which the tool rests at real points [m], (n, 3); as `tool_at`.

        Raises:
            PlanningError: As `tool_at`, or if a gear that is unloaded in its backlash lets it rest
                beside a point.
        """
        commanded = real.copy()
        for _ in range(_ITERATIONS):
            missing = real - self.tool_at(commanded, rotation)
            residual = float(np.abs(missing).max())
            if residual < _TOLERANCE:
                return commanded
            commanded = commanded + missing
        if residual > _MAX_RESIDUAL:
            raise PlanningError(
                f"expected commands with the tool at rest at the points, got {format_um(residual)} um"
                " beside one after the other: a gear is unloaded in its backlash there; give other"
                " points"
            )
        return commanded
