"""A frame touched off by a robot that sags: what its controller shows, and where the tool really is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.errors import PlanningError
from coupling.path.histories import ToolPath, poses
from coupling.robot.cell import Placement
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.robot.programmed import TouchOff
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import EquilibriumError
from elastic_robot.kinematics import base_from_tool, pose_of
from elastic_robot.parameters import Parameters
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import Acting
from elastic_robot.torque_curves import TORQUE_CURVES

# A command that brings the sagging tool to a real point is found to this [m], in so many passes.
_FOUND, _PASSES = 1e-12, 30
# What is left of that after all passes may be so large [m]: no touch tells less.
_ENOUGH = 1e-7


@dataclass(frozen=True)
class RestingRobot:
    """A robot that stands still under its own weight.

    Attributes:
        robot: Its description, gravity in the axes of its base.
        torque_curve: Name of its gears' torque curve.
        home: Joint angles near which the points are reached [rad].
        placement: Place of its base in the world.
    """

    robot: Robot
    torque_curve: str
    home: np.ndarray
    placement: Placement

    def tool_at(self, commanded: np.ndarray, rotation: Rotation) -> np.ndarray:
        """Return where the tool rests under commands to points, world axes [m], (n, 3).

        Args:
            commanded: Where the controller shows the TCP, (n, 3).
            rotation: world_from_tool that is commanded, the same at all points.

        Raises:
            PlanningError: If a point is out of reach or the robot finds no rest there.
        """
        chain, parameters = build_chain(self.robot), Parameters.of(self.robot)
        data, curve = chain.model.createData(), TORQUE_CURVES[self.torque_curve].build(parameters)
        dynamics, near, found = Dynamics(chain, parameters.gravity), self.home, []
        for k, point in enumerate(commanded, start=1):
            still = poses(np.array([point, point]), Rotation.concatenate([rotation, rotation]))
            path = self.placement.path_in_base(ToolPath(np.array([0.0, 1.0]), still))
            try:
                near = InverseKinematics(self.robot, near).plan(path).q[0][0]
                x = equilibrium(dynamics, curve, near, Acting())
            except (PlanningError, EquilibriumError) as cause:
                raise PlanningError(
                    f"point {k}, at {np.round(point, 4).tolist()} m: {cause}: give points that the robot"
                    " can touch"
                ) from cause
            found.append(pose_of(base_from_tool(chain, data, chain.theta(near, x)))[:3])
        world: np.ndarray = self.placement.position + self.placement.rotation.apply(found)
        return world

    def command_for(self, real: np.ndarray, rotation: Rotation) -> np.ndarray:
        """Return the commands under which the tool rests at real points; as `tool_at`.

        Raises:
            PlanningError: As `tool_at`, or if a gear that hangs in its play lets it rest beside a point.
        """
        commanded = real.copy()
        for _ in range(_PASSES):
            missing = real - self.tool_at(commanded, rotation)
            left = float(np.abs(missing).max())
            if left < _FOUND:
                return commanded
            commanded = commanded + missing
        if left > _ENOUGH:
            raise PlanningError(
                f"expected commands under which the tool rests at the points, got {1e6 * left:.3g} um"
                " beside one after the other: a gear hangs in its play there; give other points"
            )
        return commanded


def touched_off(commanded: np.ndarray, real: np.ndarray) -> TouchOff:
    """Return the displacement that fits touched points best, from one point a shift alone.

    Args:
        commanded: Where the controller shows the TCP, world axes [m], (n, 3).
        real: Where it is, (n, 3).
    """
    turn = Rotation.identity()
    middle, there = commanded.mean(axis=0), real.mean(axis=0)
    if len(commanded) > 1:
        turn, _ = Rotation.align_vectors(real - there, commanded - middle)
    off = real - there - turn.apply(commanded - middle)
    residual = float(np.linalg.norm(off, axis=1).max())
    return TouchOff(there - turn.apply(middle), turn, residual)
