"""A frame touched off by a robot that sags: what its controller shows, and where the tool really is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.errors import PlanningError
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.robot.inverse_kinematics import InverseKinematics
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import EquilibriumError
from elastic_robot.hysteresis import Hysteresis, Past
from elastic_robot.kinematics import base_from_tool, pose_of
from elastic_robot.parameters import Parameters
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import TORQUE_CURVES

# A command that brings the sagging tool to a real point is found to this [m], in so many iterations.
_FOUND, _ITERATIONS = 1e-12, 30
# Largest residual of that after all iterations [m]: below the accuracy of any touch.
_ENOUGH = 1e-7


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
        found = Frame.fitted(commanded, real)
        off = real - found.points(commanded)
        return cls(found, float(np.linalg.norm(off, axis=1).max()))

    def programmed(self, path: ToolPath) -> ToolPath:
        """Return a real path in the world as the program has it."""
        return path.transformed(self.real_from_shown.inverse())


@dataclass(frozen=True)
class RestingRobot:
    """A robot that stands still under its own weight.

    Attributes:
        robot: Its description, gravity in the axes of its base.
        torque_curve: Name of its gears' torque curve.
        home: Joint angles near which the points are reached [rad], (joints,).
        world_from_base: Frame of its base in the world.
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
            PlanningError: If a point is out of reach or the robot finds no rest there.
        """
        chain, parameters = build_chain(self.robot), Parameters.of(self.robot)
        data, curve = chain.model.createData(), TORQUE_CURVES[self.torque_curve].build(parameters)
        past = Past.start(Hysteresis(chain.elements, parameters.hysteresis))
        dynamics, near, found = Dynamics(chain, parameters.gravity), self.home, []
        for k, point in enumerate(commanded, start=1):
            still = ToolPath.with_rotation(np.array([0.0, 1.0]), np.array([point, point]), rotation)
            path = still.transformed(self.world_from_base.inverse())
            try:
                near = InverseKinematics(self.robot, near).plan(path).q[0][0]
                output = chain.kinematic_errors.output_angle(near)
                x = equilibrium(dynamics, curve, output, ToolLoad(), past)
            except (PlanningError, EquilibriumError) as cause:
                raise PlanningError(
                    f"point {k}, at {np.round(point, 4).tolist()} m: {cause}: give points that the robot"
                    " can touch"
                ) from cause
            found.append(pose_of(base_from_tool(chain, data, chain.theta(output, x)))[:3])
        return self.world_from_base.points(np.array(found))

    def command_for(self, real: np.ndarray, rotation: Rotation) -> np.ndarray:
        """Return the commands under which the tool rests at real points [m], (n, 3); as `tool_at`.

        Raises:
            PlanningError: As `tool_at`, or if a gear that is unloaded in its backlash lets it rest
                beside a point.
        """
        commanded = real.copy()
        for _ in range(_ITERATIONS):
            missing = real - self.tool_at(commanded, rotation)
            left = float(np.abs(missing).max())
            if left < _FOUND:
                return commanded
            commanded = commanded + missing
        if left > _ENOUGH:
            raise PlanningError(
                f"expected commands under which the tool rests at the points, got {1e6 * left:.3g} um"
                " beside one after the other: a gear is unloaded in its backlash there; give other"
                " points"
            )
        return commanded
