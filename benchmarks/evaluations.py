"""Evaluations of the process that every scheme and method takes: python -m benchmarks.evaluations.

    python -m benchmarks.evaluations                    all but cone_fem
    python -m benchmarks.evaluations cone two_robots    only these
    python -m benchmarks.evaluations cone_fem           the sheet that is computed: a minute an evaluation

A coupled path is compared with a reference: the same coupling, converged a thousand times as far.  What a
scheme says of itself does not count.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.evaluation_tasks import LONG, TASKS, CouplingTask, Withheld
from benchmarks.goals import Goal
from coupling.errors import SimulationError
from coupling.events import Event
from coupling.path.histories import JointPath, ToolPath, WrenchHistory
from coupling.robot.robot import SimulatedRobot
from coupling.run.models import Models
from coupling.solve.fixed_point import (
    Evaluated,
    Loop,
    Tolerance,
    couple,
    told_at,
    unloaded_path,
)
from coupling.solve.schemes import SCHEMES
from docs.scripts.page import table
from elastic_robot.fmi.interface import Mode

STATED, WITHHELD = "robin, K stated", "robin, K withheld"
SCHEMES_RUN = (STATED, WITHHELD, "constant", "aitken", "anderson")
# Distance from the reference that a coupled path is meant to keep [m], and the evaluations that are
# meant to be enough for it: with a stiffness that is stated, and without at gains up to the largest.
ENOUGH, MOST_STATED, MOST, LARGEST_GAIN = 1e-6, 3, 4, 5.0
_REFERENCE = Tolerance(path=1e-9, rms=1e-9, force=1e-6)
_REFERENCE_EVALUATIONS = 60


@dataclass(frozen=True)
class Reference:
    """The path that a coupling converges to.

    Attributes:
        path: It.
        change: Change of the path in the last evaluation [m].
    """

    path: ToolPath
    change: float

    @classmethod
    def of(cls, task: CouplingTask) -> Reference:
        """Return that of a task, by its springs and far below any tolerance of a scheme."""
        found = _coupled(task, STATED, _REFERENCE, _REFERENCE_EVALUATIONS, Counted(task.robot))
        return cls(found.path, found.changes[-1])


@dataclass(frozen=True)
class CouplingRow:
    """How a scheme did in a task.

    Attributes:
        task: Name of the task.
        mode: Mode of its robots.
        scheme: Name of the scheme.
        gain: Loop gain of the task, where it is known.
        errors: Distance from the reference after every evaluation [m].
        converged: Whether the scheme says so.
        outcome: Word for how it ended.
        simulations: Simulations of robots.
        wall: Wall time [s].
        known: Change of the reference in its last evaluation [m].
    """

    task: str
    mode: Mode
    scheme: str
    gain: float | None
    errors: tuple[float, ...]
    converged: bool
    outcome: str
    simulations: int
    wall: float
    known: float

    @property
    def evaluations(self) -> int:
        """Number of evaluations that the scheme took."""
        return len(self.errors)

    @property
    def good(self) -> bool:
        """Whether it ended by itself, at the right path."""
        return self.converged and self.errors[-1] <= ENOUGH

    @property
    def enough(self) -> int | None:
        """Number of evaluations after which the path stays right, if there is one."""
        wrong = [k for k, error in enumerate(self.errors, 1) if error > ENOUGH]
        last = wrong[-1] if wrong else 0
        return last + 1 if last < len(self.errors) else None


class Counted:
    """Robots, and how often they were simulated."""

    def __init__(self, robot: SimulatedRobot) -> None:
        self._robot = robot
        self.count = 0

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        """Return the paths of the TCPs."""
        self.count += len(command.q)
        return self._robot.simulate(command, wrench, mode)


@dataclass(frozen=True)
class _Coupled:
    """A coupling: its last path, all of them, their changes, and how it ended."""

    path: ToolPath
    paths: list[ToolPath]
    changes: list[float]
    converged: bool
    outcome: str


def _coupled(
    task: CouplingTask, scheme: str, tolerance: Tolerance, most: int, robot: Counted
) -> _Coupled:
    process = Withheld(task.process) if scheme == WITHHELD else task.process
    paths: list[ToolPath] = []
    changes: list[float] = []

    def watch(event: Event) -> None:
        if isinstance(event, Evaluated):
            paths.append(event.path)
            changes.append(event.evaluation.path_change)

    relaxation = SCHEMES[scheme.split(",")[0]]()
    loop = Loop(robot, process, task.mode, relaxation, tolerance, most, watch=watch)
    times, rows = told_at(task.desired, task.mode)
    start = unloaded_path(loop, task.command, times.time)
    try:
        found = couple(loop, task.command, start, rows)
    except SimulationError:
        return _Coupled(start, [start], [np.inf], False, "robot failed")
    return _Coupled(found.path, paths, changes, found.converged, found.outcome.value)


def measured(task: CouplingTask, scheme: str, reference: Reference) -> CouplingRow:
    """Return how a scheme does in a task."""
    robot, start = Counted(task.robot), time.perf_counter()
    found = _coupled(task, scheme, Tolerance(), task.most, robot)
    wall = time.perf_counter() - start
    return CouplingRow(
        task.name,
        task.mode,
        scheme,
        task.gain,
        tuple(float(path.distance_to(reference.path).max()) for path in found.paths),
        found.converged,
        found.outcome,
        robot.count,
        wall,
        reference.change,
    )


def rows(names: Iterable[str]) -> Iterator[CouplingRow]:
    """Yield the rows of tasks, by their names."""
    for name in names:
        with Models("native") as models:
            for task in {**TASKS, **LONG}[name](models):
                reference = Reference.of(task)
                for scheme in SCHEMES_RUN:
                    yield measured(task, scheme, reference)


def goals(found: Iterable[CouplingRow]) -> list[Goal]:
    """Return the goals: of every coupling whose stiffness is stated, and of those up to a gain of 5."""
    reached = []
    for row in found:
        up_to = row.gain is not None and row.gain <= LARGEST_GAIN
        if row.scheme == STATED or (row.scheme == WITHHELD and up_to):
            most = MOST_STATED if row.scheme == STATED else MOST
            text = f"{row.task}, {row.mode}, {row.scheme}, evaluations"
            if not row.converged:
                text += f" ({row.outcome})"
            elif not row.good:
                text += f" (off by {1e6 * row.errors[-1]:.2g} um)"
            met = row.good and row.evaluations <= most
            reached.append(Goal(text, f"at most {most}", row.evaluations, met))
    return reached


def lines(found: Iterable[CouplingRow]) -> str:
    """Return the table."""
    head = (
        *("task", "mode", "scheme", "evaluations", "for 1 um", "simulations", "off by [um]"),
        *("ended", "time [s]"),
    )
    return table(head, (_cells(row) for row in found))


def _cells(row: CouplingRow) -> list[str]:
    enough = "never" if row.enough is None else f"{row.enough}"
    return [
        *(row.task, row.mode, row.scheme, f"{row.evaluations}", enough, f"{row.simulations}"),
        *(f"{1e6 * row.errors[-1]:.2g}", row.outcome, f"{row.wall:.2g}"),
    ]


def main(names: list[str]) -> None:
    """Print the table and what it says of the goals."""
    known = {**TASKS, **LONG}
    unknown = [name for name in names if name not in known]
    if unknown:
        sys.exit(f"expected tasks out of {', '.join(known)}, got {', '.join(unknown)}")
    found = []
    for row in rows(names or list(TASKS)):
        found.append(row)
        print(*_cells(row), f"(reference changed by {row.known:.1e} m)", sep="; ", flush=True)
    print(f"\n{lines(found)}\n\nGoals of that run:\n")
    print("\n".join(f"- {goal}" for goal in goals(found)))


if __name__ == "__main__":
    main(sys.argv[1:])
