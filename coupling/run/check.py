"""A check of a command: what it needs, what it computes, what is said of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import Generic, TypeVar, cast

from coupling.case.case import Case
from coupling.errors import SimulationError
from coupling.events import Watch
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.results.limit_warning import LimitWarning
from coupling.results.repeatability import ForceNoise
from coupling.results.run_result import Kind, RunResult
from coupling.results.section import Section
from coupling.robot.cell import Cell
from coupling.robot.simulated_model import SimulatedModel
from coupling.run.fmu_pool import FmuPool
from coupling.run.gear_loads import at_samples
from coupling.solve.correction import Correction
from elastic_robot.fmi.interface import Mode

Finding = TypeVar("Finding", covariant=True)


@dataclass
class CheckedCommand:
    """A command, all that its checks may need, and what they have found so far.

    Attributes:
        case: The case; its process is without the noise that is taken off.
        kind: "couple" or "compensate".
        noise: Noise in the process's forces; None where it can have none, or is periodic.
        is_measured: Whether the robot was measured, and a forecast tells what to expect of it.
        findings: Findings by the names of their checks.
        durations: Wall time by part of the run [s].
    """

    case: Case
    kind: Kind
    cell: Cell
    models: tuple[SimulatedModel, ...]
    fmus: FmuPool
    correction: Correction
    noise: ForceNoise | None
    watch: Watch
    is_measured: bool = False
    findings: dict[str, object] = field(default_factory=dict)
    durations: dict[str, float] = field(default_factory=dict)

    def finding_of(self, check: Check[Finding]) -> Finding:
        """Return what a check finds, computed when it is first asked for."""
        if check.name not in self.findings:
            if not check.applies(self):
                return check.absent
            with timed(check.name, self.durations):
                self.findings[check.name] = check.compute(self)
        return cast("Finding", self.findings[check.name])

    @cached_property
    def loads(self) -> WrenchHistory:
        """Wrenches on the tools at the case's samples, springs included."""
        correction = self.correction
        return at_samples(correction.response.wrench, correction.achieved, self.case.desired)

    def simulated(self, joints: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath | None:
        """Return the paths in a mode; None where they cannot be simulated, which spoils no result."""
        try:
            return self.cell.simulate(joints, wrench, mode)
        except SimulationError:
            return None


def of_corrections(command: CheckedCommand) -> bool:
    """Return whether a command is corrected, not that of a coupling alone."""
    return command.kind == "compensate"


@dataclass(frozen=True)
class Check(Generic[Finding]):
    """A check of a command.

    Attributes:
        name: Name, also of its wall time.
        compute: Function that computes its finding, and asks a command for those that it needs.
        absent: Finding where it does not apply.
        applies: Function that says whether it applies.
        warnings: Function that gives the limits that are passed.
        sections: Function that gives what terminal and page say of it, of the content of result.json.
    """

    name: str
    compute: Callable[[CheckedCommand], Finding]
    absent: Finding
    applies: Callable[[CheckedCommand], bool] = lambda _: True
    warnings: Callable[[CheckedCommand], Sequence[LimitWarning]] = lambda _: ()
    sections: Callable[[RunResult], list[Section]] = lambda _: []


@contextmanager
def timed(name: str, durations: dict[str, float]) -> Iterator[None]:
    """Note the wall time of a block under a name [s]."""
    start = time.perf_counter()
    yield
    durations[name] = time.perf_counter() - start
