"""A cell of robots in one world frame; one robot is a cell of one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.events import Watch, unwatched
from coupling.inverse.inversion import Wanted
from coupling.path.controller import Controller
from coupling.path.discrepancy import Discrepancy
from coupling.path.histories import JointPath, ToolPath, WrenchHistory, poses
from coupling.path.interpolation import SampledPath
from coupling.robot.moving import Inverter
from coupling.robot.programmed import TouchOff
from coupling.robot.robot import Inverse, LimitWarning, SimulatedRobot
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
        >>> turned.path_in_world(ToolPath(np.array([0.0, 1.0]), pose)).position[0, 0].round(9)
        array([2. , 0. , 0.5])
    """

    position: np.ndarray
    rotation: Rotation

    def path_in_world(self, path: ToolPath) -> ToolPath:
        """Return the path of one tool given in the robot's base in the world frame."""
        position = self.position + self.rotation.apply(path.position[0])
        return ToolPath(path.time, poses(position, self.rotation * path.rotations[0]))

    def path_in_base(self, path: ToolPath) -> ToolPath:
        """Return the path of one tool given in the world in the robot's base frame."""
        base_from_world = self.rotation.inv()
        position = base_from_world.apply(path.position[0] - self.position)
        return ToolPath(path.time, poses(position, base_from_world * path.rotations[0]))

    def wrench_in_base(self, wrench: WrenchHistory) -> WrenchHistory:
        """Return the wrench on one tool given in world axes in the axes of the robot's base."""
        vectors = self.rotation.inv().apply(wrench.wrench.reshape(-1, 3))
        spring = wrench.spring and wrench.spring.seen_from(self.position, self.rotation)
        return WrenchHistory(wrench.time, vectors.reshape(wrench.wrench.shape), spring)


AT_THE_ORIGIN = Placement(np.zeros(3), Rotation.identity())


class Planner(Protocol):
    """Kinematics of one robot, both ways."""

    def plan(self, path: ToolPath) -> JointPath:
        """Return its joint angles along the path of its tool."""
        ...

    def forward(self, joints: JointPath, time: np.ndarray) -> ToolPath:
        """Return the path of its undeflected tool under a motion of its drives."""
        ...

    def rate_warnings(self, path: JointPath) -> list[LimitWarning]:
        """Return one warning for each joint whose maximum rate is exceeded."""
        ...


@dataclass(frozen=True)
class Member:
    """A robot of a cell.

    Attributes:
        name: Word for it in messages and folders.
        placement: Place of its base.
        robot: Its simulation, in its own base frame.
        planner: Its kinematics.
        inverter: Its inverse; None for a robot that is not to be corrected.
        touch_off: What it takes for the world where it was touched off; None: the world.
        discrepancy: What its tool was measured to do beyond the model, in the world; None: nothing.
    """

    name: str
    placement: Placement
    robot: SimulatedRobot
    planner: Planner
    inverter: Inverter | None = None
    touch_off: TouchOff | None = None
    discrepancy: Discrepancy | None = None

    def programmed(self, path: ToolPath) -> ToolPath:
        """Return a path of its tool in the world as its program has it."""
        return path if self.touch_off is None else self.touch_off.programmed(path)

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        """Return the path that its tool takes, in the world.

        Raises:
            SimulationError: If it cannot be simulated.
        """
        path = self.robot.simulate(command, self.placement.wrench_in_base(wrench), mode)
        path = self.placement.path_in_world(path)
        return path if self.discrepancy is None else self.discrepancy.real(path)

    def model_path(self, path: ToolPath) -> ToolPath:
        """Return where the tool of its model has to be, in its base, for the tool to be on a path."""
        own = path if self.discrepancy is None else self.discrepancy.model(path)
        return self.placement.path_in_base(own)


@dataclass(frozen=True)
class Cell:
    """Robots that move at the same time; paths and wrenches are in world axes.

    Attributes:
        members: The robots; the world is the base of the first one.
    """

    members: tuple[Member, ...]

    def plan(self, path: ToolPath) -> JointPath:
        """Return the joint angles of all robots whose programs have the paths of their tools.

        Robots that were touched off have them in the frames that their controllers show.

        Raises:
            PlanningError: If a robot cannot follow.
        """
        return self._undeflected(self.programmed(path))

    def programmed(self, path: ToolPath) -> ToolPath:
        """Return the paths of the tools as the robots' programs have them, without any correction."""
        pairs = zip(self.members, path.tools, strict=True)
        return ToolPath.of_tools([member.programmed(tool) for member, tool in pairs])

    def _undeflected(self, path: ToolPath) -> JointPath:
        """Return the joint angles that put the undeflected tools on their paths."""
        motions = [
            member.planner.plan(member.placement.path_in_base(tool))
            for member, tool in zip(self.members, path.tools, strict=True)
        ]
        return JointPath.of_robots(motions)

    def forward(self, joints: JointPath, time: np.ndarray) -> ToolPath:
        """Return the paths of the undeflected tools under a motion of the drives.

        Args:
            joints: The motion of all robots.
            time: Rising, within the motion [s], (k,).
        """
        return ToolPath.of_tools(
            [
                member.placement.path_in_world(member.planner.forward(own, time))
                for member, own in zip(self.members, joints.robots, strict=True)
            ]
        )

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        """Return the paths that the tools take.

        Raises:
            SimulationError: If a robot cannot be simulated.
        """
        return ToolPath.of_tools(
            [
                member.simulate(own, load, mode)
                for member, own, load in zip(
                    self.members, command.robots, wrench.tools, strict=True
                )
            ]
        )

    def inverse(
        self,
        desired: SampledPath,
        wrench: WrenchHistory,
        controller: Controller,
        goal: float,
        watch: Watch = unwatched,
    ) -> Inverse:
        """Return the commands that keep the moving robots' tools on their paths.

        Raises:
            PlanningError: If a path asks for more than the drives can do.
            SimulationError: If a robot cannot be simulated.
        """
        found = []
        rigid = self._undeflected(desired.samples)
        for member, tool, own, load in zip(
            self.members, desired.path.tools, rigid.robots, wrench.tools, strict=True
        ):
            assert member.inverter is not None
            loads = member.placement.wrench_in_base(load)
            wanted = Wanted(member.model_path(tool), own, loads)
            found.append(member.inverter.invert(wanted, controller, goal, watch))
        changes = [
            replace(change, robot=self._name(member))
            for member, inverse in zip(self.members, found, strict=True)
            for change in inverse.flank_changes
        ]
        return Inverse(JointPath.of_robots([inverse.joints for inverse in found]), tuple(changes))

    def _name(self, member: Member) -> str:
        """Return the name of a robot where there are several."""
        return member.name if len(self.members) > 1 else ""

    def rate_warnings(self, command: JointPath) -> list[LimitWarning]:
        """Return one warning for each joint whose maximum rate is exceeded."""
        return [
            replace(warning, robot=self._name(member))
            for member, own in zip(self.members, command.robots, strict=True)
            for warning in member.planner.rate_warnings(own)
        ]
