"""The bench on which sampled robots run a command; a worker keeps one over all its samples."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.case.file import load_case
from coupling.errors import HostError, ProcessError, SimulationError, StudyError
from coupling.events import unwatched
from coupling.files.scratch import ScratchFolder
from coupling.path.deviation import measure
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.results.study_result import StudySample
from coupling.robot.cell import Cell
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.run.plant import coupled_on
from coupling.run.uncertain_parameters import SampledRobots, UncertainParameters
from coupling.solve.fixed_point import Coupling
from coupling.study.statistics import parts_of_path

# Parts of the path's time of which a sample keeps the largest deviation.
PARTS = 400
# Times that a sample is tried again after the process of its FMU has ended.
RETRIES = 3


@dataclass(frozen=True)
class Workers:
    """Who does the work.

    Attributes:
        count: Processes of a local cluster, one thread each.
        scheduler: Address of a running cluster's scheduler; empty: a local cluster.
    """

    count: int = os.cpu_count() or 1
    scheduler: str = ""


@dataclass(frozen=True)
class StudyJob:
    """What every worker needs to know of a study; it goes to other machines as a pickle.

    Attributes:
        achieved: Paths of the model's tools, at the same times.
        wrench: Wrenches on the model's tools, at these times.
        process: The case file, where the process is to be evaluated for every sample; else None.
        store: Store of evaluations that keeps what the process answers, if any.
    """

    kind: str
    robots: tuple[PlacedRobot, ...]
    fmus: tuple[bytes, ...]
    parameters: UncertainParameters
    desired: ToolPath
    achieved: ToolPath
    joints: JointPath
    wrench: WrenchHistory
    process: Path | None = None
    store: Path | None = None


class RobotPool:
    """Robots that stay loaded from sample to sample; a context manager that ends them."""

    def __init__(self, work: StudyJob) -> None:
        self._work = work
        self._stack = ExitStack()
        self._models = self._stack.enter_context(FmuPool(work.kind))
        for robot, fmu in zip(work.robots, work.fmus, strict=True):
            self._models.take(robot.description, robot.torque_curve, fmu, robot.drive)
        self._cell, _ = cell_of(work.robots, self._models)
        self._first = parts_of_path(work.desired.time, PARTS)
        self._case: Case | None = None
        if work.process is not None:
            case = load_case(work.process, self._stack.enter_context(ScratchFolder()))
            self._case = replace(case, process=case.evaluated_process(work.store))

    def __enter__(self) -> RobotPool:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the robots."""
        self._stack.close()

    def sample(self, number: int, values: Sequence[float]) -> StudySample:
        """Return what the command leaves on the robots of a sample.

        Raises:
            HostError: If a robot's process has ended; the next sample starts another.
        """
        sampled = self._work.parameters.sampled(values)
        try:
            path, coupling = self._run(sampled)
        except HostError:
            raise
        except (SimulationError, ProcessError) as error:
            return StudySample(number=number, deviation=None, distance=(), failure=str(error))
        distance = np.maximum.reduceat(path.distance_to(self._work.desired), self._first)
        return StudySample(
            number=number,
            deviation=measure(path, self._work.desired),
            distance=tuple(distance.tolist()),
            evaluations=0 if coupling is None else len(coupling.evaluations),
            converged=coupling is None or coupling.converged,
        )

    def _run(self, sampled: SampledRobots) -> tuple[ToolPath, Coupling | None]:
        """Return the path of the sampled robots, and how they came together with the process."""
        work, cell = self._work, self._sampled_cell(sampled)
        if self._case is not None:
            coupling = coupled_on(
                self._case, cell, sampled.force, work.joints, work.achieved, unwatched
            )
            return coupling.path, coupling
        loads = work.wrench.scaled(sampled.force)
        return cell.simulate(work.joints, loads, "dynamic"), None

    def _sampled_cell(self, sampled: SampledRobots) -> Cell:
        robots = [
            self._models.of(robot.description, robot.torque_curve, robot.drive).differing(
                difference, "sampled parameters"
            )
            for robot, difference in zip(self._work.robots, sampled.differences, strict=True)
        ]
        return self._cell.with_robots(robots)


def simulate_here(work: StudyJob, points: Mapping[int, Sequence[float]]) -> Iterator[StudySample]:
    """Give every sample as soon as it is done, simulated by this program, one after another.

    Raises:
        StudyError: If the process of an FMU ends again and again.
    """
    with RobotPool(work) as pool:
        for number, values in points.items():
            yield _try_sample(pool, number, values)


def _try_sample(pool: RobotPool, number: int, values: Sequence[float]) -> StudySample:
    for _ in range(RETRIES):
        with suppress(HostError):
            return pool.sample(number, values)
    try:
        return pool.sample(number, values)
    except HostError as cause:
        raise ended_again(cause) from cause


def ended_again(cause: HostError) -> StudyError:
    """Return what is said of a sample whose FMU has ended its process in all tries."""
    return StudyError(f"a robot ended its process in {RETRIES + 1} tries of one sample: {cause}")
