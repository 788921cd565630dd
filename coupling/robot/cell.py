"""A cell of several robots in one world frame, with the verbs of a single robot."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.path.histories import JointPath, ToolPath, WrenchHistory
from coupling.robot.inverse_kinematics import Planner, RateWarning
from coupling.solve.fixed_point import SimulatedRobot
from elastic_robot.fmi.interface import Mode


@dataclass(frozen=True)
class Placement:
    """Where a robot stands in the cell.

    Attributes:
        position: Origin of its base in the world [m], (3,).
        rotation: world_from_base.

    Example:
        >>> turned = Placement(np.array([3.0, 0.0, 0.0]), Rotation.from_euler("z", np.pi))
        >>> pose = np.array([[1.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0]] * 2)
        >>> turned.path_in_world(ToolPath(np.array([0.0, 1.0]), pose)).position[0].round(9)
        array([2. , 0. , 0.5])
    """

    position: np.ndarray
    rotation: Rotation

    def path_in_world(self, path: ToolPath) -> ToolPath:
        """Return a tool path given in the robot's base in the world frame."""
        position = self.position + self.rotation.apply(path.position)
        return _path(path.time, position, self.rotation * path.rotation)

    def path_in_base(self, path: ToolPath) -> ToolPath:
        """Return a tool path given in the world in the robot's base frame."""
        base_from_world = self.rotation.inv()
        position = base_from_world.apply(path.position - self.position)
        return _path(path.time, position, base_from_world * path.rotation)

    def wrench_in_base(self, wrench: WrenchHistory) -> WrenchHistory:
        """Return a wrench at the TCP given in world axes in the axes of the robot's base."""
        base_from_world = self.rotation.inv()
        vectors = wrench.wrench.reshape(-1, 3)
        return WrenchHistory(wrench.time, base_from_world.apply(vectors).reshape(-1, 6))


def _path(time: np.ndarray, position: np.ndarray, rotation: Rotation) -> ToolPath:
    quaternion = rotation.as_quat()
    quaternion *= np.where(quaternion[:, 3:] < 0.0, -1.0, 1.0)
    return ToolPath(time, np.hstack([position, quaternion]))


@dataclass(frozen=True)
class Member:
    """A robot of a cell.

    Attributes:
        name: What it is called in messages.
        placement: Where it stands.
        robot: Simulates it in its own base frame.
        planner: Its inverse kinematics.
    """

    name: str
    placement: Placement
    robot: SimulatedRobot
    planner: Planner


@dataclass(frozen=True)
class Cell:
    """Robots that move at the same time.

    Paths and wrenches are those of all tools, in world axes; a joint path holds the joints of all
    robots, in the order of the members.

    Attributes:
        members: The robots.
    """

    members: tuple[Member, ...]

    def plan(self, path: ToolPath) -> JointPath:
        """Return the joint angles of all robots along the paths of their tools.

        Raises:
            PlanningError: If a robot cannot follow.
        """
        return JointPath(
            path.time,
            np.hstack(
                [
                    member.planner.plan(member.placement.path_in_base(tool)).q
                    for member, tool in zip(self.members, path.tools, strict=True)
                ]
            ),
        )

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        """Return the paths that the tools take.

        Raises:
            SimulationError: If a robot cannot be simulated.
        """
        return ToolPath.of_tools(
            [
                member.placement.path_in_world(
                    member.robot.simulate(own, member.placement.wrench_in_base(load), mode)
                )
                for member, own, load in zip(
                    self.members, self.commands(command), wrench.tools, strict=True
                )
            ]
        )

    def commands(self, command: JointPath) -> list[JointPath]:
        """Return the joint path of every robot."""
        counts = [member.planner.joint_count for member in self.members]
        parts = np.split(command.q, np.cumsum(counts)[:-1], axis=1)
        return [JointPath(command.time, q) for q in parts]

    def rate_warnings(self, command: JointPath) -> list[RateWarning]:
        """Return one warning for each joint whose maximum rate is exceeded."""
        return [
            replace(warning, robot=member.name)
            for member, own in zip(self.members, self.commands(command), strict=True)
            for warning in member.planner.rate_warnings(own)
        ]
