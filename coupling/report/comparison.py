"""Two runs side by side: what each comes to, and in what they differ."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from coupling.errors import ResultError
from coupling.report.background import case_content
from coupling.run.stored_run import StoredRobot, StoredRun, read_run

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
class Comparison:
    """Two runs of the same robots.

    Attributes:
        names: Their names on the page.
        runs: The runs.
    """

    names: tuple[str, str]
    runs: tuple[StoredRun, StoredRun]

    @classmethod
    def of(cls, first: Path, second: Path) -> Comparison:
        """Read two run folders.

        Raises:
            ResultError: If one cannot be read, both are one, or their robots are others.
        """
        if first.resolve() == second.resolve():
            raise ResultError(f"{second}: expected another run than the first, got the same folder")
        runs = read_run(first), read_run(second)
        first_robots, second_robots = (" and ".join(run.robots) for run in runs)
        if first_robots != second_robots:
            raise ResultError(
                f"{second}: expected a run of the robots {first_robots}, as {first}, got {second_robots}"
            )
        names = first.resolve().name, second.resolve().name
        if names[0] == names[1]:
            names = str(first), str(second)
        return cls(names, runs)

    def robots(self) -> Iterator[tuple[str, StoredRobot, StoredRobot]]:
        """Yield name and both runs of every robot."""
        for name, first in self.runs[0].robots.items():
            yield name, first, self.runs[1].robots[name]

    def inputs(self) -> list[tuple[str, str, str]]:
        """Return key and both values of every input that differs; "-" where there is none."""
        first, second = (dict(_inputs(run)) for run in self.runs)
        keys = dict.fromkeys([*first, *second])
        rows = [(key, first.get(key, "-"), second.get(key, "-")) for key in keys]
        return [row for row in rows if row[1] != row[2]]


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
