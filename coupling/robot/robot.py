"""Contracts of robots, one or a cell of several."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from coupling.events import Watch, unwatched
from coupling.path.controller import Controller
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from elastic_robot.fmi.interface import Mode

# What is said of a limit that is passed, by its name.
_PASSED = {
    "rate": "joint {joint} moves at {value:.3g} rad/s at t = {time:.3f} s; its maximum rate is"
    " {limit:.3g} rad/s",
    "payload": "the force on the tool is {value:.5g} N at t = {time:.3f} s; the robot's rated load is"
    " {limit:.5g} N",
    "gear-torque-peak": "joint {joint}: its gear carries {value:.5g} N m at t = {time:.3f} s; its peak"
    " torque is {limit:.5g} N m",
    "effort": "joint {joint}: its gear carries {value:.5g} N m at t = {time:.3f} s; the effort of its"
    " URDF, the highest torque, is {limit:.5g} N m: correct it by gear_torque_Nm if it is none",
    "sampling": "linear interpolation of the force between the process's samples causes an estimated"
    " {value_um:.4g} um at t = {time:.3f} s; tolerance_m is {limit_um:.4g} um: lower sample_s, or give a"
    " path from a file more rows",
    "motor-torque": "joint {joint}: its motor needs {value:.5g} N m at t = {time:.3f} s; its torque"
    " limit is {limit:.5g} N m, {more:.3g} N m less",
    "motor-torque-warm": "joint {joint}: warm, with 30 % less friction, its motor needs"
    " {value:.5g} N m at t = {time:.3f} s; its torque limit is {limit:.5g} N m, {more:.3g} N m less",
    "motor-torque-cold": "joint {joint}: cold, with 30 % more friction, its motor needs"
    " {value:.5g} N m at t = {time:.3f} s; its torque limit is {limit:.5g} N m, {more:.3g} N m less",
    "gear-torque-emergency": "joint {joint}: its gear carries {value:.5g} N m at t = {time:.3f} s; its"
    " torque in an emergency stop is {limit:.5g} N m",
}


@dataclass(frozen=True)
class LimitWarning:
    """A limit of the robot file is passed, or a tolerance of the case.

    Attributes:
        name: Name of the limit: "rate", "payload", "gear-torque-peak", "gear-torque-emergency",
            "effort", "motor-torque", "motor-torque-warm", "motor-torque-cold" or "sampling".
        value: Largest demand [rad/s], [N] or [N m]; of samples what they cost [m].
        limit: Limit of the robot, or the tolerance, in the same unit.
        time: Instant at which it is worst [s].
        joint: Number, from 1; None for what is no joint's.
        robot: Name of the robot in a cell of several.
    """

    name: str
    value: float
    limit: float
    time: float
    joint: int | None = None
    robot: str = ""

    def __str__(self) -> str:
        whose = f"{self.robot}: " if self.robot else ""
        return whose + _PASSED[self.name].format(
            **vars(self),
            more=self.value - self.limit,
            value_um=1e6 * self.value,
            limit_um=1e6 * self.limit,
        )


@dataclass(frozen=True)
class BacklashReversal:
    """A gear passes through its backlash: a wrong backlash would show here.

    Attributes:
        joint: Number, from 1.
        begins, ends: Time at which it leaves one flank and reaches the next [s].
        before, after: These flanks, -1 or 1; 0 at the ends of a path that begins or ends in the
            backlash.
        robot: Name of the robot in a cell of several.
    """

    joint: int
    begins: float
    ends: float
    before: int
    after: int
    robot: str = ""


@dataclass(frozen=True)
class InverseCommand:
    """Commands that keep the moving robots' tools on their paths.

    Attributes:
        joints: Motion of the drives, in the rows to send to the robots.
        backlash_reversals: Passages of gears through their backlash, by robot, joint and time.
    """

    joints: JointPath
    backlash_reversals: tuple[BacklashReversal, ...] = ()


class SimulatedRobot(Protocol):
    """A robot, as the coupling needs it."""

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        """Return the paths that the TCPs take.

        Raises:
            SimulationError: If the robot cannot be simulated.
        """


class InvertibleRobot(SimulatedRobot, Protocol):
    """A robot, as a correction needs it."""

    def plan(self, path: ToolPath) -> JointPath:
        """Return the joint angles of the undeflected robot along the paths of its tools.

        Raises:
            PlanningError: If it cannot follow.
        """

    def forward(self, joints: JointPath, time: np.ndarray) -> ToolPath:
        """Return the paths of the undeflected tools under a motion of the drives.

        Args:
            joints: The motion.
            time: Rising, within the motion [s], (k,).
        """

    def inverse(
        self,
        desired: SampledPath,
        wrench: WrenchHistory,
        controller: Controller,
        goal: float,
        watch: Watch = unwatched,
    ) -> InverseCommand:
        """Return the commands that keep the moving robot's tools on their paths.

        Args:
            desired: Desired paths of the tools.
            wrench: Wrenches on them, from their start to their end.
            controller: Controller that takes the commands.
            goal: Deviation at the tools that needs no further improvement [m].
            watch: Function called with the progress of the work.

        Raises:
            PlanningError: If a path asks for more than the drives can do.
            SimulationError: If the robot cannot be simulated.
        """
