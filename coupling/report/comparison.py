"""Runs beside each other: what each comes to, what was measured under it, and in what they differ."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from coupling.case.file import load_case
from coupling.errors import ResultError
from coupling.files.recorded_bag import is_bag
from coupling.identification.next.measured_run import MeasuredRun
from coupling.identification.next.options import ANYWHERE, FrameAccuracy
from coupling.identification.runs.measurement import SimulatedPath, read_measurement
from coupling.identification.runs.recorded_columns import ColumnChoice
from coupling.identification.runs.source import MeasuredFile, read_source
from coupling.path.histories import ToolPath
from coupling.report.background import case_content
from coupling.results.base import Shown
from coupling.run.fmu_pool import FmuPool
from coupling.run.stored_run import CASE, StoredRobot, StoredRun, read_run

# Times per row at which commands are compared.
_BETWEEN = 2


@dataclass(frozen=True)
class CommandDifference:
    """How far the commands of a robot in two runs are apart, while both last.

    Attributes:
        time: [s], (n,).
        angle: Second minus first [rad], (n, joints).
    """

    time: np.ndarray
    angle: np.ndarray

    @property
    def largest(self) -> tuple[float, int, float]:
        """Largest difference [rad], the joint's number from 1, and the time [s]."""
        row, joint = np.unravel_index(np.abs(self.angle).argmax(), self.angle.shape)
        return float(abs(self.angle[row, joint])), int(joint) + 1, float(self.time[row])


@dataclass(frozen=True)
class MeasuredTool:
    """A tool as it was measured under the command of a run, on its clock and in its frame.

    Attributes:
        file: File of the measurement.
        run: The measurement, with what was taken off it.
        desired, actual: Desired and measured path at the measured times, world frame.
    """

    file: Path
    run: MeasuredRun
    desired: ToolPath
    actual: ToolPath

    @classmethod
    def of(
        cls, file: Path, source: MeasuredFile, model: SimulatedPath, own_frame: bool
    ) -> MeasuredTool:
        """Return what was measured under a run, on its clock and in its frame.

        Args:
            model: Path of the tool under the run's command, axes of the robot's base.
            own_frame: Whether the pose of the measuring frame is unknown.

        Raises:
            LearnError: If it is no measurement of this run.
        """
        measured = MeasuredRun.of(source, model, ANYWHERE if own_frame else FrameAccuracy())
        return cls(file, measured, *measured.paths)


@dataclass(frozen=True)
class Comparison(Shown):
    """Runs of the same robots.

    Attributes:
        names: Their names on the page.
        runs: The runs.
        measured: Measured tools by the numbers of their runs, from 0.
    """

    names: tuple[str, ...]
    runs: tuple[StoredRun, ...]
    measured: Mapping[int, MeasuredTool]

    @classmethod
    def of(
        cls,
        places: Sequence[Path],
        own_frame: bool = False,
        choice: ColumnChoice | None = None,
    ) -> Comparison:
        """Read run folders, and files that were measured under the run before each of them.

        Args:
            places: Folders and files in their order.
            own_frame: Whether the pose of the measuring frame is unknown.
            choice: Columns and units of the files, where they are named.

        Raises:
            ResultError: If a folder cannot be read, is named twice, or its robots are others.
            LearnError: If a file is no measurement of its run.
        """
        is_measured = [place.is_file() or is_bag(place) for place in places]
        folders = [place for place, is_file in zip(places, is_measured, strict=True) if not is_file]
        if is_measured[0]:
            raise ResultError(f"{places[0]}: expected a run folder first, got a file")
        if len(places) < 2:
            raise ResultError(f"{places[0]}: expected another run, or a measured path, beside it")
        for number, folder in enumerate(folders):
            if folder.resolve() in [other.resolve() for other in folders[:number]]:
                raise ResultError(
                    f"{folder}: expected another run than those before, got the same folder"
                )
        runs = tuple(read_run(folder) for folder in folders)
        first, *_ = robots = [" and ".join(run.robots) for run in runs]
        for folder, robot_names in zip(folders, robots, strict=True):
            if robot_names != first:
                raise ResultError(
                    f"{folder}: expected a run of the robots {first}, as {folders[0]}, got"
                    f" {robot_names}"
                )
        names = tuple(folder.resolve().name for folder in folders)
        if len(set(names)) < len(names):
            names = tuple(map(str, folders))
        files: dict[int, Path] = {}
        number = -1
        for place, is_file in zip(places, is_measured, strict=True):
            if not is_file:
                number += 1
            elif number in files:
                raise ResultError(f"{place}: expected one measured path behind {folders[number]}")
            else:
                files[number] = place
        sources = {
            number: read_source(folders[number], read_measurement(file, choice))
            for number, file in files.items()
        }
        models = _models(sources, runs, folders[-1])
        measured = {
            number: MeasuredTool.of(files[number], source, models[number], own_frame)
            for number, source in sources.items()
        }
        return cls(names, runs, measured)

    def robots(self) -> Iterator[tuple[str, list[StoredRobot]]]:
        """Yield the name of every robot with its part of every run."""
        for name in self.runs[0].robots:
            yield name, [run.robots[name] for run in self.runs]

    def inputs(self) -> list[tuple[str, ...]]:
        """Return key and values of every input that differs; "-" where there is none."""
        tables = [dict(_inputs(run)) for run in self.runs]
        keys = dict.fromkeys(key for table in tables for key in table)
        rows = [(key, *(table.get(key, "-") for table in tables)) for key in keys]
        return [row for row in rows if len(set(row[1:])) > 1]


def _models(
    sources: Mapping[int, MeasuredFile], runs: Sequence[StoredRun], last: Path
) -> dict[int, SimulatedPath]:
    """Return where the tool of the robot of the last run is under the commands that were measured.

    Frame and clock of a device are fitted to it, as `next` fits them to the robot that it computes the
    last run for: so both tell the same figures.

    Args:
        sources: Measurements, by the numbers of their runs.
        last: Folder of the last run.
    """
    if not sources:
        return {}
    robot = load_case(last / CASE).robots[0].description
    paths = {}
    with FmuPool("native") as models:
        for number, source in sources.items():
            path = runs[number].first.achieved.transformed(source.world_from_base.inverse())
            if source.discrepancy is not None or source.robot != robot:
                fmu = models.of(robot, source.torque_curve, source.drive).fmu
                path = fmu.simulate(source.stored.joints, source.stored.wrench, "dynamic")
            paths[number] = SimulatedPath(path)
    return paths


def command_difference(first: StoredRobot, second: StoredRobot) -> CommandDifference | None:
    """Return how far two commands are apart, None for robots of different numbers of joints."""
    if first.joints.q[0].shape[1] != second.joints.q[0].shape[1]:
        return None
    end = min(float(stored.joints.time[-1]) for stored in (first, second))
    start = max(float(stored.joints.time[0]) for stored in (first, second))
    rows = max(len(stored.joints.time) for stored in (first, second))
    time = np.linspace(start, end, _BETWEEN * (rows - 1) + 1)
    angles = [stored.joints.trajectory.at(time)[0] for stored in (first, second)]
    return CommandDifference(time, angles[1] - angles[0])


def _inputs(run: StoredRun) -> Iterator[tuple[str, str]]:
    """Yield every input of a run by its key."""
    yield "command", run.figures.kind
    yield from _flat(case_content(run))
    for robot in run.figures.robots:
        for file, checksum in robot.files.items():
            yield f"{robot.name} robot, file {file}", checksum
        for source, places in robot.sources.items():
            for place in places:
                yield f"{robot.name} robot, source of {place}", source
    for name, version in run.figures.versions.items():
        yield f"version of {name}", version
    yield "FMU", run.figures.fmu_fingerprint


def _flat(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", str(value)
