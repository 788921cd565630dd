"""A command as written, replayed on robots that differ from the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.path.deviation import Deviation, measure
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.results.replay import Replay
from coupling.robot.cell import Cell
from coupling.robot.simulated_model import SimulatedModel
from coupling.run.check import CheckedCommand
from coupling.run.uncertain_parameters import SampledRobots
from coupling.solve.correction import Correction

# Beyond this a deviation by superposition is trusted to be the larger one: backlash and servos made it
# wrong by factors of 0.59 to 2.1 on 228 drawn robots, and none that was larger by this factor was in
# truth smaller.
_MARGIN = 1.5


@dataclass(frozen=True)
class ReplayedCommand:
    """A command that is replayed as written.

    Attributes:
        cell: The robots of the model.
        models: Simulation of each of them.
        joints: Motion of the drives.
        wrench: Wrenches on the tools.
        desired: Desired paths of the tools.
        correction: The correction whose command it is; None: nothing tells what it corrects.
    """

    cell: Cell
    models: tuple[SimulatedModel, ...]
    joints: JointPath
    wrench: WrenchHistory
    desired: ToolPath
    correction: Correction | None = None

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
            correction,
        )

    def on(self, name: str, robots: Sequence[SimulatedModel], sampled: SampledRobots) -> Replay:
        """Return what it leaves on robots that are sampled, by the name of the replay, with its path.

        What the uncorrected command leaves on them is by superposition.

        Raises:
            SimulationError: If a robot cannot be simulated.
        """
        replay, path = self._superposed(name, _differing(name, robots, sampled), sampled.force)
        return replay.keeping(path)

    def uncorrected_on(
        self, name: str, robots: Sequence[SimulatedModel], sampled: SampledRobots
    ) -> Deviation:
        """Return what the uncorrected command leaves on robots that are sampled, simulated.

        Raises:
            SimulationError: If a robot cannot be simulated.
        """
        return self._uncorrected(_differing(name, robots, sampled), sampled.force)

    def replay(
        self, name: str, robots: Sequence[SimulatedModel], force: float
    ) -> tuple[Replay, ToolPath]:
        """Return what it leaves on other robots, and the uncorrected command where that may be less.

        Args:
            force: Factor of the wrench.

        Returns:
            The replay, and the paths of the tools under the command.

        Raises:
            SimulationError: If a robot cannot be simulated.
        """
        replay, path = self._superposed(name, robots, force)
        if replay.uncorrected is not None and not is_surely_better(replay):
            replay = replay.beside(self._uncorrected(robots, force))
        return replay, path

    def _superposed(
        self, name: str, robots: Sequence[SimulatedModel], force: float
    ) -> tuple[Replay, ToolPath]:
        path = self.cell.with_robots(robots).simulate(
            self.joints, self.wrench.scaled(force), "dynamic"
        )
        replay = Replay.of(name, path, self.desired)
        if self.correction is not None:
            uncorrected = path.displaced(self._taken_off)
            replay = replay.beside(measure(uncorrected, self.desired))
        return replay, path

    def _uncorrected(self, robots: Sequence[SimulatedModel], force: float) -> Deviation:
        assert self.correction is not None
        before, cell = self.correction.before, self.cell.with_robots(robots)
        path = cell.simulate(before.joints, before.wrench.scaled(force), "dynamic")
        return measure(path, self.desired)

    @cached_property
    def _taken_off(self) -> np.ndarray:
        """What a command takes off by superposition, as on the model [m], [rad], (tools, n, 6)."""
        assert self.correction is not None
        return self.correction.before.path.deviation_from(self.correction.achieved)


def is_surely_better(replay: Replay) -> bool:
    """Return whether the uncorrected command leaves more, however wrong its superposition is."""
    deviation, uncorrected = replay.deviation, replay.uncorrected
    return uncorrected is not None and (
        uncorrected.maximum > _MARGIN * deviation.maximum
        and uncorrected.maximum_less_constant > _MARGIN * deviation.maximum_less_constant
    )


def _differing(
    name: str, robots: Sequence[SimulatedModel], sampled: SampledRobots
) -> list[SimulatedModel]:
    pairs = zip(robots, sampled.differences, strict=True)
    return [robot.differing(difference, name) for robot, difference in pairs]
