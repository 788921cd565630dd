"""Measured runs along one path, and what a model says of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from coupling.errors import LearnError
from coupling.identification.next.measured_run import MeasuredRun
from coupling.identification.next.options import FrameAccuracy
from coupling.identification.runs.measurement import SimulatedPath
from coupling.identification.runs.parameters import factors_between, learnable
from coupling.identification.runs.source import MeasuredFile, require_comparable
from coupling.robot.parameters import (
    RobotParameter,
    apply_values,
    robot_parameters,
    scaled_values,
    value_of,
)
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.fmu_pool import FmuPool
from elastic_robot.description import Robot

# Paths are the same to this [m], and begin and end at the same time to this [s].
_SAME, _SAME_TIME = 1e-6, 1e-9
# Simulated paths in memory, at most.
_CACHED = 120


@dataclass
class History:
    """Measured runs along one path, in their order.

    Attributes:
        sources: The runs, and what was measured under their commands as it came.
        frame_accuracy: Standard deviations of the measuring device's frame and tip.
        robot: Robot of the first one's file, with the backlash that was learned of gears for which that
            states none.
        parameters: Its parameters that are learned.
        fmu: FMU of that robot.
        runs: Measured runs, on their commands' clocks and in the robot's frame.
    """

    sources: tuple[MeasuredFile, ...]
    frame_accuracy: FrameAccuracy
    robot: Robot
    parameters: tuple[RobotParameter, ...]
    fmu: RobotFmu
    runs: tuple[MeasuredRun, ...] = ()
    _paths: dict[tuple[int, bytes], SimulatedPath] = field(default_factory=dict)

    @classmethod
    def of(
        cls, sources: Sequence[MeasuredFile], frame_accuracy: FrameAccuracy, models: FmuPool
    ) -> History:
        """Return the history of runs and what was measured under their commands.

        Args:
            sources: Runs in their order; the robot of the first one is the file's.
            frame_accuracy: Standard deviations of the measuring device's frame and tip.
            models: Simulation models of the robots.

        Raises:
            LearnError: If a measurement is none of its run, or the runs are of other robots or paths.
        """
        require_comparable(sources)
        _require_one_path(sources)
        first = sources[0]
        fmu = models.of(first.robot, first.torque_curve, first.drive).fmu
        parameters = learnable(first.robot, first.torque_curve, first.drive)
        history = cls(tuple(sources), frame_accuracy, first.robot, parameters, fmu)
        history = history.with_backlash_of(sources[-1].robot)
        return history.aligned_with(history.start)

    def with_backlash_of(self, learned: Robot) -> History:
        """Return the history of a robot that has backlash where a learned one has some and it none."""
        first = self.sources[0]
        values = {
            p.name: p.value
            for p in robot_parameters(learned, first.torque_curve, ("backlash",))
            if not value_of(self.robot, p.name)
        }
        if not values:
            return self
        robot = apply_values(self.robot, values)
        parameters = learnable(robot, first.torque_curve, first.drive)
        return replace(self, robot=robot, parameters=parameters, _paths={})

    def aligned_with(self, x: np.ndarray) -> History:
        """Return the history with the device's frame, clock and tip fitted to a robot's model.

        What the robot's parameters explain is not attributed to the device.

        Args:
            x: Log factors of the robot [1], (P,).
        """
        runs = tuple(
            MeasuredRun.of(source, self.simulated(number, x), self.frame_accuracy)
            for number, source in enumerate(self.sources)
        )
        return replace(self, runs=runs)

    @property
    def start(self) -> np.ndarray:
        """Log factors of the file's robot [1], (P,)."""
        return self.factors_of(0)

    def robot_at(self, x: np.ndarray) -> Robot:
        """Return the robot with log factors x [1], (P,)."""
        return apply_values(self.robot, scaled_values(self.parameters, x))

    def factors_of(self, number: int) -> np.ndarray:
        """Return the log factors of the robot that a run was computed for [1], (P,)."""
        return factors_between(self.parameters, self.sources[number].robot)

    def simulated(self, number: int, x: np.ndarray) -> SimulatedPath:
        """Return where the tool of a robot is under a run's command.

        Args:
            number: Number of the run, from 0.
            x: Log factors of the robot [1], (P,).
        """
        key = (number, x.tobytes())
        if key not in self._paths:
            stored = self.sources[number].stored
            path = self.fmu.simulate(stored.joints, stored.wrench, "dynamic", self.robot_at(x))
            self._paths[key] = SimulatedPath(path)
            if len(self._paths) > _CACHED:
                self._paths.pop(next(iter(self._paths)))
        return self._paths[key]

    def unmodelled(self, number: int, x: np.ndarray) -> np.ndarray:
        """Return measured less simulated poses of a run, (n, 6): [m], and [rad] or 0.

        Args:
            number: Number of the run, from 0.
            x: Log factors of the robot [1], (P,).
        """
        measured, path = self.runs[number].measured, self.simulated(number, x)
        shift = measured.position - path.position(measured.time)
        turn = np.zeros_like(shift)
        if measured.rotation is not None:
            turn = (measured.rotation * path.rotation(measured.time).inv()).as_rotvec()
        return np.hstack([shift, turn])


def _require_one_path(sources: Sequence[MeasuredFile]) -> None:
    """Refuse runs of other paths than the first one's.

    Raises:
        LearnError: If one of them has another desired path.
    """
    first = sources[0]
    path = first.stored.desired
    for other in sources[1:]:
        other_path = other.stored.desired
        same = len(other_path.time) == len(path.time) and np.allclose(
            other_path.time, path.time, rtol=0.0, atol=_SAME_TIME
        )
        if not same or np.abs(other_path.position - path.position).max() > _SAME:
            raise LearnError(
                f"{other.folder}: expected the desired path of {first.folder}, got another one: give"
                " measured runs of one path"
            )
