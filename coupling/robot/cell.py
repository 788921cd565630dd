"""A cell of robots in one world frame; one robot is a cell of one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import PlanningError, SimulationError
from coupling.events import Watch, unwatched
from coupling.inverse.inversion import DesiredMotion
from coupling.path.controller import Controller
from coupling.path.discrepancy import Discrepancy
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from coupling.results.limit_warning import LimitWarning
from coupling.robot.contract import Advance, InverseCommand, MarchingRobot, SimulatedRobot
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.robot.inverter import Inverter
from coupling.robot.touch_off import TouchOff
from elastic_robot.fmi.interface import Mode


@dataclass(frozen=True)
class Member:
    """A robot of a cell.

    Attributes:
        name: Word for it in messages and folders.
        inverter: Its inverse; None for a robot that is not to be corrected.
    """

    name: str
    world_from_base: Frame
    robot: SimulatedRobot
    planner: InverseKinematics
    inverter: Inverter | None = None
    touch_off: TouchOff | None = None
    discrepancy: Discrepancy | None = None

    def programmed(self, path: ToolPath) -> ToolPath:
        """Return a path of its tool in the world as its program has it."""
        return path if self.touch_off is None else self.touch_off.programmed(path)

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        """Return the path that its tool takes, in the world."""
        in_base = wrench.transformed(self.world_from_base.inverse())
        return self.in_world(self.robot.simulate(command, in_base, mode))

    def in_world(self, path: ToolPath) -> ToolPath:
        """Return the path of its real tool in the world, of that of its model in its base."""
        path = path.transformed(self.world_from_base)
        return path if self.discrepancy is None else self.discrepancy.real(path)

    def march(self, command: JointPath, start: WrenchHistory, end: float, mode: Mode) -> Advance:
        """Begin a simulation that goes on window by window."""
        if not isinstance(self.robot, MarchingRobot):
            raise SimulationError(f"{self.name}: expected a robot that can be simulated in windows")
        in_base = start.transformed(self.world_from_base.inverse())
        advance = self.robot.march(command, in_base, end, mode)

        def advance_in_world(loads: WrenchHistory, is_repeat: bool) -> ToolPath:
            in_base = loads.transformed(self.world_from_base.inverse())
            return self.in_world(advance(in_base, is_repeat))

        return advance_in_world

    def model_path(self, path: ToolPath) -> ToolPath:
        """Return the path of its model's tool, in its base, for the tool to be on a path."""
        commanded = path if self.discrepancy is None else self.discrepancy.model(path)
        return commanded.transformed(self.world_from_base.inverse())


@dataclass(frozen=True)
class Cell:
    """Robots that move at the same time; paths and wrenches are in world axes."""

    members: tuple[Member, ...]

    def with_robots(self, robots: Sequence[SimulatedRobot]) -> Cell:
        """Return the cell with other simulations of its robots, in their order."""
        pairs = zip(self.members, robots, strict=True)
        return Cell(tuple(replace(member, robot=robot) for member, robot in pairs))

    def plan(self, path: ToolPath) -> JointPath:
        """Return the joint angles of all robots whose programs have the paths of their tools.

        Robots that were touched off have them in the frames that their controllers show.
        """
        return self.undeflected(self.programmed(path))

    def programmed(self, path: ToolPath) -> ToolPath:
        """Return the paths of the tools as the robots' programs have them, without any correction."""
        pairs = zip(self.members, path.tools, strict=True)
        return ToolPath.of_tools([member.programmed(tool) for member, tool in pairs])

    def undeflected(self, path: ToolPath) -> JointPath:
        """Return the joint angles that put the undeflected tools on their paths."""
        motions = [
            member.planner.plan(tool.transformed(member.world_from_base.inverse()))
            for member, tool in zip(self.members, path.tools, strict=True)
        ]
        return JointPath.of_robots(motions)

    def forward(self, joints: JointPath, time: np.ndarray) -> ToolPath:
        """Return the paths of the undeflected tools under a motion of the drives.

        Args:
            time: Rising, within the motion [s], (k,).
        """
        return ToolPath.of_tools(
            [
                member.planner.forward(motion, time).transformed(member.world_from_base)
                for member, motion in zip(self.members, joints.robots, strict=True)
            ]
        )

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        """Return the paths that the tools take."""
        return ToolPath.of_tools(
            [
                member.simulate(motion, load, mode)
                for member, motion, load in zip(
                    self.members, command.robots, wrench.tools, strict=True
                )
            ]
        )

    def march(self, command: JointPath, start: WrenchHistory, end: float, mode: Mode) -> Advance:
        """Begin a simulation that goes on window by window, as `MarchingRobot.march`."""
        parts = zip(self.members, command.robots, start.tools, strict=True)
        marches = [member.march(motion, load, end, mode) for member, motion, load in parts]

        def advance(loads: WrenchHistory, is_repeat: bool) -> ToolPath:
            pairs = zip(marches, loads.tools, strict=True)
            return ToolPath.of_tools([march(load, is_repeat) for march, load in pairs])

        return advance

    def inverse(
        self,
        desired: SampledPath,
        wrench: WrenchHistory,
        controller: Controller,
        goal: float,
        watch: Watch = unwatched,
    ) -> InverseCommand:
        """Return the commands that keep the moving robots' tools on their paths."""
        inverses = []
        rigid = self.undeflected(desired.samples)
        for member, tool, joints, load in zip(
            self.members, desired.path.tools, rigid.robots, wrench.tools, strict=True
        ):
            assert member.inverter is not None
            loads = load.transformed(member.world_from_base.inverse())
            motion = DesiredMotion(member.model_path(tool), joints, loads)
            try:
                inverses.append(member.inverter.invert(motion, controller, goal, watch))
            except PlanningError as cause:
                if len(self.members) == 1:
                    raise
                raise PlanningError(f"{member.name} robot: {cause}") from cause
        changes = [
            change.model_copy(update={"robot": self._name(member)})
            for member, inverse in zip(self.members, inverses, strict=True)
            for change in inverse.backlash_reversals
        ]
        return InverseCommand(
            JointPath.of_robots([inverse.joints for inverse in inverses]), tuple(changes)
        )

    def _name(self, member: Member) -> str:
        """Return the name of a robot where there are several."""
        return member.name if len(self.members) > 1 else ""

    def rate_warnings(self, command: JointPath) -> list[LimitWarning]:
        """Return one warning for each joint whose maximum rate is exceeded."""
        return [
            warning.of_robot(self._name(member))
            for member, joints in zip(self.members, command.robots, strict=True)
            for warning in member.planner.rate_warnings(joints)
        ]
