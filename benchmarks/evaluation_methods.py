"""Evaluations that the methods of compensation take: python -m benchmarks.evaluation_methods."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from benchmarks.evaluation_tasks import Withheld, hanging_cases
from benchmarks.evaluations import SCHEMES_RUN, WITHHELD
from coupling.case.case import Case
from coupling.path.deviation import measure
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.robot.cell import Cell, Member
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.solve import InverseCorrection, Mirror
from coupling.solve.correction import Method
from coupling.solve.fixed_point import Loop
from coupling.solve.schemes import SCHEMES
from docs.scripts.page import table
from docs.scripts.runs import example
from elastic_robot.fmi.interface import Mode

_MOST = 25


@dataclass(frozen=True)
class MethodRow:
    """How a method did in a case.

    Attributes:
        case: Name of the case.
        method: Name of the method.
        mode: Mode of its robots.
        scheme: Scheme of its couplings; "any" where it has none.
        evaluations: Of the process, in all.
        simulations: Of robots, those of the polish among them.
        left: Largest deviation from the desired path, validated [m].
        outcome: Word for how it ended.
        wall: Wall time [s].
    """

    case: str
    method: str
    mode: Mode
    scheme: str
    evaluations: int
    simulations: int
    left: float
    outcome: str
    wall: float


class CountedFmu:
    """A robot's FMU, and how often it was simulated."""

    def __init__(self, fmu: RobotFmu) -> None:
        self._fmu = fmu
        self.count = 0

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        """Return the path of the TCP."""
        self.count += 1
        return self._fmu.simulate(command, wrench, mode)

    def deflected(
        self, command: JointPath, wrench: WrenchHistory, coordinates: int
    ) -> tuple[ToolPath, np.ndarray]:
        """Return the path of the TCP and how the joints give way."""
        self.count += 1
        return self._fmu.deflected(command, wrench, coordinates)


def _counted(member: Member) -> tuple[Member, CountedFmu]:
    """Return a member of a cell all of whose simulations are counted."""
    assert isinstance(member.robot, RobotFmu)
    assert member.inverter is not None
    counted = CountedFmu(member.robot)
    inverter = replace(member.inverter, simulated=cast(RobotFmu, counted))
    return replace(member, robot=counted, inverter=inverter), counted


def corrected(
    name: str, case: Case, cell: Cell, mode: Mode, method: Method, scheme: str
) -> MethodRow:
    """Return how a method does with a scheme, or with any, in a case."""
    pairs = [_counted(member) for member in cell.members]
    process = Withheld(case.process) if scheme == WITHHELD else case.process
    relaxation = SCHEMES["robin" if scheme == "any" else scheme.split(",")[0]]()
    loop = Loop(
        Cell(tuple(member for member, _ in pairs)),
        process,
        mode,
        relaxation,
        case.coupling.tolerance(),
        _MOST,
        case.controller,
    )
    start = time.perf_counter()
    found = method.correct(loop, case.motion)
    return MethodRow(
        name,
        type(method).__name__.lower(),
        mode,
        scheme,
        found.evaluations,
        sum(counted.count for _, counted in pairs),
        measure(found.achieved, found.desired).maximum,
        found.outcome.value,
        time.perf_counter() - start,
    )


def cases() -> dict[str, Case]:
    """Return the cases by name."""
    cone = example("cone", tool_path={"depth_m": 0.003})
    return {"cone, 6 turns": cone, **hanging_cases(), "two robots": example("two_robots")}


def rows(names: Iterable[str]) -> Iterator[MethodRow]:
    """Yield the rows of cases: the inverse of the moving robot, and mirroring without inertia."""
    for name in names:
        case = cases()[name]
        with FmuPool("native") as models:
            cell, _ = cell_of(case.robots, models)
            yield corrected(name, case, cell, "dynamic", InverseCorrection(), "any")
            for scheme in SCHEMES_RUN:
                yield corrected(name, case, cell, "quasistatic", Mirror(), scheme)


def lines(found: Iterable[MethodRow]) -> str:
    """Return the table."""
    head = ("case", "method", "mode", "scheme", "evaluations", "simulations", "deviation [um]")
    return table((*head, "ended", "time [s]"), (cells(row) for row in found))


def cells(row: MethodRow) -> list[str]:
    """Return the line of a row."""
    left = 1e6 * row.left
    return [
        *(row.case, row.method, row.mode, row.scheme, f"{row.evaluations}", f"{row.simulations}"),
        *(f"{left:.2g}" if left < 10.0 else f"{left:.0f}", row.outcome, f"{row.wall:.2g}"),
    ]


def main(names: list[str]) -> None:
    """Print the table."""
    unknown = [name for name in names if name not in cases()]
    if unknown:
        sys.exit(f"expected cases out of {', '.join(cases())}, got {', '.join(unknown)}")
    found = []
    for row in rows(names or list(cases())):
        found.append(row)
        print(*cells(row), sep="; ", flush=True)
    print(f"\n{lines(found)}")


if __name__ == "__main__":
    main(sys.argv[1:])
