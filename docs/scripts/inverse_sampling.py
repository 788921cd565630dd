"""What samples of a force cost, as runs tell it and as it is, for docs/inverse.md."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from coupling.case.case import Case
from coupling.path.histories import ToolPath
from coupling.path.interpolation import InterpolatedPath, divided
from coupling.process import ProcessSchema
from coupling.run.execute import loop_of
from coupling.run.models import Models, cell_of
from coupling.run.sampling import sampling_of
from coupling.solve.fixed_point import Tolerance, couple
from docs.scripts.page import table
from docs.scripts.runs import example

# Of the process that is the reference [s].
_OFTEN = 1e-3
# Of its coupling [m]: far below what samples cost.
_EXACT = Tolerance(1e-8, 5e-9, 1e-5)
_SAMPLES = (20, 10, 5)  # [ms]


@dataclass(frozen=True)
class Shown:
    """A row of the table.

    Attributes:
        title: Its name.
        case: Name of the example.
        tables: Keys of its tables that are changed.
    """

    title: str
    case: str
    tables: Mapping[str, Mapping[str, Any]]


_CONE = {"feed_m_s": 0.15, "depth_m": 0.003}
SHOWN = (
    Shown(
        "cone, 0.15 m/s, no backlash",
        "cone",
        {"tool_path": _CONE, "robot": {"torque_curve": "linear"}},
    ),
    Shown(
        "the same, `fanuc_r2000ic`",
        "cone",
        {"tool_path": _CONE, "robot": {"torque_curve": "linear", "description": "fanuc_r2000ic"}},
    ),
    Shown("the same, with backlash", "cone", {"tool_path": _CONE}),
    Shown("pyramid, 0.15 m/s, with backlash", "cone", {"tool_path": _CONE | {"kind": "pyramid"}}),
)


@dataclass(frozen=True)
class Cost:
    """Largest deviation by samples [um].

    Attributes:
        really: Beside the process asked every millisecond.
        estimated: As the run estimates it, the process being a formula.
        parabolas: The same if it were none.
    """

    really: float
    estimated: float
    parabolas: float


def cost(case: Case) -> Cost:
    """Return what the samples of a case's command cost.

    Raises:
        RuntimeError: If the reference does not converge.
    """
    with Models(case.fmu) as fmus:
        cell, _ = cell_of(case.robots, fmus)
        loop = loop_of(case, cell)
        found = case.method.correct(loop, case.motion)
        time, _ = divided(case.motion.path.time, _OFTEN)

        def often(path: ToolPath) -> ToolPath:
            return ToolPath.of_tools([InterpolatedPath(tool).at(time) for tool in path.tools])

        forming = often(case.motion.path)
        task = replace(case.task, forming=forming, sample_rows=np.arange(len(time)))
        reference = couple(
            replace(
                loop,
                process=case.process_table.process(task),
                scheme=case.coupling.new_scheme(),
                tolerance=_EXACT,
            ),
            found.joints,
            often(found.achieved),
        )
        if not reference.converged:
            raise RuntimeError(reference.reason)
        known = np.isin(found.achieved.time, time)
        reached = reference.path.at_rows(np.searchsorted(time, found.achieved.time[known]))
        really = reached.distance_to(found.achieved.at_rows(np.flatnonzero(known))).max()
        estimates = [sampling_of(own, cell, found) for own in (case, _as_a_program(case))]
    assert all(own is not None for own in estimates)
    return Cost(*(1e6 * value for value in (really, *(own.error for own in estimates if own))))


def _as_a_program(case: Case) -> Case:
    """Return a case whose process is taken for none that is a formula."""
    table = case.process_table
    kind = type(table)
    own: type[ProcessSchema] = type(
        kind.__name__, (kind,), {"FORMULA": False, "__module__": kind.__module__}
    )
    return replace(case, process_table=own.model_construct(**table.model_dump()))


def costs() -> str:
    """Return the table."""
    rows = []
    for shown in SHOWN:
        cells = [shown.title]
        for sample in _SAMPLES:
            tables = {key: dict(keys) for key, keys in shown.tables.items()}
            tables.setdefault("tool_path", {})["sample_s"] = 1e-3 * sample
            own = cost(example(shown.case, **tables))
            print(shown.title, sample, own, flush=True)
            cells += [f"{value:.2g}" for value in (own.really, own.estimated, own.parabolas)]
        rows.append(cells)
    columns = [
        f"{s} ms{what}"
        for s in _SAMPLES
        for what in (", actual [um]", ", estimated", ", parabolas")
    ]
    return table(("path, samples every", *columns), rows)
