"""Evaluations of the process that every scheme and method takes: python -m benchmarks.evaluations.

    python -m benchmarks.evaluations                    all but the computed sheets
    python -m benchmarks.evaluations cone two_robots    only these
    python -m benchmarks.evaluations cone_fem           the computed sheet, hours; goes on where it was

A coupled path is compared with a reference: the same coupling, converged a thousand times as far.
What a scheme says of itself does not count.
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
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from coupling.robot.contract import SimulatedRobot
from coupling.run.fmu_pool import FmuPool
from coupling.solve.coupling import couple, sampled_for
from coupling.solve.fixed_point import Evaluated, Loop, Tolerance, unloaded_path
from coupling.solve.schemes import SCHEMES
from docs.scripts.page import table
from elastic_robot.fmi.interface import Mode

STATED, WITHHELD = "robin, K stated", "robin, K withheld"
SCHEMES_RUN = (STATED, WITHHELD, "constant", "aitken", "anderson")
# Distance from the reference that a coupled path is meant to keep [m], and the evaluations that are
# meant to be enough for it: with a stiffness that is stated, and without at gains up to the largest.
ENOUGH, MOST_STATED, MOST, LARGEST_GAIN = 1e-6, 3, 4, 5.0
_REFERENCE = Tolerance(path=1e-9, rms=1e-9, force=1e-6)
# Change of a reference in its last evaluation above which it is none [m].
_KNOWN = 1e-8


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
    def of(cls, task: CouplingTask, start: ToolPath | None = None) -> Reference:
        """Return that of a task: by the first scheme that gets there, or the nearest.

        Args:
            task: The task.
            start: Path from which is started; the unloaded one unless given.
        """
        found = []
        for scheme in (STATED, WITHHELD, "anderson"):
            ended = coupled(
                task, scheme, _REFERENCE, task.most_for_reference, Counted(task.robot), start
            )
            found.append(cls(ended.path, ended.changes[-1]))
            if found[-1].known:
                break
        return min(found, key=lambda reference: reference.change)

    @property
    def known(self) -> bool:
        """Whether it can be compared with."""
        return self.change <= _KNOWN


@dataclass(frozen=True)
class CouplingRow:
    """How a scheme did in a task.

    Attributes:
        task: Name of the task.
        mode: Mode of its robots.
        scheme: Name of the scheme.
        gain: Loop gain of the task, where it is known.
        errors: Distance from the reference after every evaluation [m]; not a number where there is none.
        beyond: Number of samples that are off by more than 1 um in the end.
        elsewhere: Whether that is another solution, as where a gear in its backlash has two places to
            rest.
        converged: Whether the scheme says so.
        outcome: Word for how it ended.
        simulations: Simulations of robots.
        wall: Wall time [s].
    """

    task: str
    mode: Mode
    scheme: str
    gain: float | None
    errors: tuple[float, ...]
    beyond: int
    elsewhere: bool
    converged: bool
    outcome: str
    simulations: int
    wall: float

    @property
    def evaluations(self) -> int:
        """Number of evaluations that the scheme took."""
        return len(self.errors)

    @property
    def good(self) -> bool:
        """Whether it ended by itself, at the right path."""
        return self.converged and (self.elsewhere or self.errors[-1] <= ENOUGH)

    @property
    def enough(self) -> int | None:
        """Number of evaluations after which the path stays right, if there is one."""
        wrong = [k for k, error in enumerate(self.errors, 1) if not error <= ENOUGH]
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
class Coupled:
    """A coupling.

    Attributes:
        path: Its last path.
        paths: All paths.
        changes: Largest changes of the path in every evaluation [m].
        converged: Whether the scheme says so.
        outcome: Word for how it ended.
    """

    path: ToolPath
    paths: list[ToolPath]
    changes: list[float]
    converged: bool
    outcome: str


def coupled(
    task: CouplingTask,
    scheme: str,
    tolerance: Tolerance,
    most: int,
    robot: Counted,
    start: ToolPath | None = None,
) -> Coupled:
    """Return how a scheme couples a task.

    Args:
        task: The task.
        scheme: One of SCHEMES_RUN.
        tolerance: Tolerance of the coupling.
        most: Evaluations at most.
        robot: The task's robot.
        start: Path from which is started; the unloaded one unless given.
    """
    process = Withheld(task.process) if scheme == WITHHELD else task.process
    paths: list[ToolPath] = []
    changes: list[float] = []

    def watch(event: Event) -> None:
        if isinstance(event, Evaluated):
            paths.append(event.path)
            changes.append(event.evaluation.path_change)

    relaxation = SCHEMES[scheme.split(",")[0]]()
    loop = Loop(robot, process, task.mode, relaxation, tolerance, most, watch=watch)
    times = sampled_for(loop, SampledPath.of(task.desired))
    start = start or unloaded_path(loop, task.command, times.path.time)
    try:
        found = couple(loop, task.command, start, times.sample_rows)
    except SimulationError:
        return Coupled(start, [start], [np.inf], False, "robot failed")
    return Coupled(found.path, paths, changes, found.converged, found.outcome.value)


def measured(task: CouplingTask, scheme: str, reference: Reference) -> CouplingRow:
    """Return how a scheme does in a task."""
    robot, start = Counted(task.robot), time.perf_counter()
    found = coupled(task, scheme, Tolerance(), task.most, robot)
    wall = time.perf_counter() - start
    off = [path.distance_to(reference.path) for path in found.paths]
    return CouplingRow(
        task.name,
        task.mode,
        scheme,
        task.gain,
        tuple(float(distance.max()) if reference.known else np.nan for distance in off),
        int(np.count_nonzero(off[-1] > ENOUGH)),
        found.converged and reference.known and _elsewhere(task, found.path, reference),
        found.converged,
        found.outcome,
        robot.count,
        wall,
    )


def _elsewhere(task: CouplingTask, path: ToolPath, reference: Reference) -> bool:
    """Return whether a path that is not the reference is a solution as well: without inertia only."""
    if task.mode == "dynamic" or np.all(path.distance_to(reference.path) <= ENOUGH):
        return False
    own = Reference.of(task, path)
    return own.known and bool(np.all(path.distance_to(own.path) <= ENOUGH))


def rows(names: Iterable[str]) -> Iterator[CouplingRow]:
    """Yield the rows of tasks, by their names."""
    for name in names:
        with FmuPool("native") as models:
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
            elif np.isnan(row.errors[-1]):
                text += " (no reference)"
            elif row.elsewhere:
                text += f" (another solution at {row.beyond} samples)"
            elif not row.good:
                text += f" (off by {1e6 * row.errors[-1]:.2g} um)"
            met = row.good and row.evaluations <= most
            reached.append(Goal(text, f"at most {most}", row.evaluations, met))
    return reached


def lines(found: Iterable[CouplingRow]) -> str:
    """Return the table."""
    head = ("task", "mode", "scheme", "evaluations", "for 1 um", "simulations", "off by [um]")
    return table((*head, "samples off", "ended", "time [s]"), (cells(row) for row in found))


def cells(row: CouplingRow) -> list[str]:
    """Return the line of a row."""
    enough = "never" if row.enough is None else f"{row.enough}"
    off = ("?", "?") if np.isnan(row.errors[-1]) else (_um(row.errors[-1]), f"{row.beyond}")
    ended = f"{row.outcome}, another solution" if row.elsewhere else row.outcome
    return [
        *(row.task, row.mode, row.scheme, f"{row.evaluations}", enough, f"{row.simulations}"),
        *(*off, ended, f"{row.wall:.2g}"),
    ]


def grid(found: Iterable[CouplingRow]) -> str:
    """Return a shorter table: evaluations by task and scheme, and what is wrong where something is."""
    by_task: dict[tuple[str, str], dict[str, str]] = {}
    for row in found:
        by_task.setdefault((row.task, row.mode), {})[row.scheme] = _verdict(row)
    body = [(*task, *(cell[scheme] for scheme in SCHEMES_RUN)) for task, cell in by_task.items()]
    return table(("task", "mode", *SCHEMES_RUN), body)


def _verdict(row: CouplingRow) -> str:
    if not row.converged:
        return row.outcome
    if row.elsewhere:
        return f"{row.evaluations} (another solution at {row.beyond})"
    if np.isnan(row.errors[-1]):
        return f"{row.evaluations} (not known whether right)"
    if not row.good:
        return f"{row.evaluations} (off by {_um(row.errors[-1])} um at {row.beyond})"
    return f"{row.evaluations}"


def _um(length: float) -> str:
    value = 1e6 * length
    return "< 0.001" if value < 1e-3 else f"{value:.2g}" if value < 10.0 else f"{value:.0f}"


def main(names: list[str]) -> None:
    """Print the table and what it says of the goals."""
    known = {**TASKS, **LONG}
    unknown = [name for name in names if name not in known]
    if unknown:
        sys.exit(f"expected tasks out of {', '.join(known)}, got {', '.join(unknown)}")
    found = []
    for row in rows(names or list(TASKS)):
        found.append(row)
        print(*cells(row), sep="; ", flush=True)
    print(f"\n{lines(found)}\n\nGoals of that run:\n")
    print("\n".join(f"- {goal}" for goal in goals(found)))


if __name__ == "__main__":
    main(sys.argv[1:])
