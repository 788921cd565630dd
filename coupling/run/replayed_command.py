"""A command as written, replayed on robots that differ from the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.results.outlook import Replay
from coupling.robot.cell import Cell
from coupling.robot.simulated_model import SimulatedModel
from coupling.run.check import CheckedCommand
from coupling.run.uncertain_parameters import SampledRobots


@dataclass(frozen=True)
class ReplayedCommand:
    """A command that is replayed as written.

    Attributes:
        cell: The robots of the model.
        models: Simulation of each of them.
        joints: Motion of the drives.
        wrench: Wrenches on the tools.
        desired: Desired paths of the tools.
    """

    cell: Cell
    models: tuple[SimulatedModel, ...]
    joints: JointPath
    wrench: WrenchHistory
    desired: ToolPath

    @classmethod
    def of(cls, command: CheckedCommand) -> ReplayedCommand:
        """Return that of a run."""
        correction = command.correction
        return cls(
            command.cell,
            command.models,
            correction.joints,
            correction.response.wrench,
            correction.desired,
        )

    def path_on(self, robots: Sequence[SimulatedModel], force: float) -> ToolPath:
        """Return the paths of the tools of other robots, under a factor of the wrench.

        Raises:
            SimulationError: If a robot cannot be simulated.
        """
        wrench = self.wrench.scaled(force)
        return self.cell.with_robots(robots).simulate(self.joints, wrench, "dynamic")

    def on(self, name: str, robots: Sequence[SimulatedModel], sampled: SampledRobots) -> Replay:
        """Return what it leaves on robots that are sampled, by the name of the replay.

        Raises:
            SimulationError: If a robot cannot be simulated.
        """
        pairs = zip(robots, sampled.differences, strict=True)
        differing = [robot.differing(difference, name) for robot, difference in pairs]
        return Replay.of(name, self.path_on(differing, sampled.force), self.desired)
