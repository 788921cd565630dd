"""Contracts of robots, one or a cell of several."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from coupling.events import Watch, unwatched
from coupling.path.controller import Controller
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from coupling.results.gear_result import BacklashReversal
from elastic_robot.fmi.interface import Mode

# Simulates a window: from the wrenches on the tools at its times, which begin where the last one ended,
# and whether the last one is taken back and this one in its place, to the paths of the TCPs.
Advance = Callable[[WrenchHistory, bool], ToolPath]


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


@runtime_checkable
class MarchingRobot(SimulatedRobot, Protocol):
    """A robot that can be simulated window by window."""

    def march(self, command: JointPath, start: WrenchHistory, end: float, mode: Mode) -> Advance:
        """Begin a simulation, until another one of this robot begins; the result takes its windows.

        Args:
            start: Wrenches in initialisation, at the start alone.
            end: Time up to which it may go on [s].

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
            wrench: Wrenches on them, from their start to their end.
            goal: Deviation at the tools that needs no further improvement [m].

        Raises:
            PlanningError: If a path asks for more than the drives can do.
            SimulationError: If the robot cannot be simulated.
        """
