"""Where the pages meet the coupling: cases, as they stand or changed, and what their runs leave."""

from __future__ import annotations

import csv
import tempfile
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.path.deviation import Deviation
from coupling.path.workpiece import Workpiece
from coupling.results.run_result import GapResult
from coupling.run.execute import Run, run_compensation, run_coupling
from coupling.run.path_checks import TOOL_GAP
from coupling.run.plant import PLANT_REPLAY

EXAMPLES = Path(__file__).parents[2] / "examples"
CASES = EXAMPLES / "cases"


def example_data(name: str, **changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return a case of the examples as data, with keys of its tables changed."""
    data = tomllib.loads((CASES / f"{name}.toml").read_text(encoding="utf-8"))
    for section, keys in changes.items():
        data.setdefault(section, {}).update(keys)
    return data


def example(name: str, **changes: Mapping[str, Any]) -> Case:
    """Return a case of the examples with keys of its tables changed."""
    return case_of(example_data(name, **changes))


def case_of(data: Mapping[str, Any]) -> Case:
    """Return the case of a case file's data; paths in it are absolute."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "case.toml")
        file.write_text(tomlkit.dumps(data), encoding="utf-8")
        return load_case(file)


def coupled(case: Case) -> Run:
    """Couple a case's robots with its process.

    Raises:
        RuntimeError: If that does not converge.
    """
    return _converged(run_coupling(case))


def compensated(case: Case) -> Run:
    """Correct a case's command.

    Raises:
        RuntimeError: If that does not converge.
    """
    return _converged(run_compensation(case))


def _converged(run: Run) -> Run:
    if not run.correction.converged:
        raise RuntimeError(run.correction.reason)
    return run


def replays(run: Run) -> dict[str, Deviation]:
    """Return the deviations under a run's command on robots that differ, and on its case's plant."""
    deviations = {replay.name: replay.deviation for replay in run.robustness}
    plant = run.finding_of(PLANT_REPLAY)
    return deviations if plant is None else deviations | {"plant": plant.deviation_m}


def measured_rows(name: str) -> list[dict[str, str]]:
    """Return the rows of examples/measured/<name>.csv by its columns, without comments."""
    with (EXAMPLES / "measured" / f"{name}.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def peak_force(run: Run, tool: int) -> float:
    """Return the largest force on a tool [N]."""
    return run.correction.response.wrench.tools[tool].peak_force


def around_axis(points: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return forces on a tool that goes round the part's z axis, (n, 3).

    Axial, radial (towards the axis) and tangential (against the motion) [N].

    Args:
        points: Its positions, part axes [m], (n, 3).
        force: Forces, part axes [N], (n, 3).
    """
    outward = points * [1.0, 1.0, 0.0]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    ahead = np.cross([0.0, 0.0, 1.0], outward)
    radial, tangential = (-np.sum(force * way, axis=1) for way in (outward, ahead))
    return np.column_stack([force[:, 2], radial, tangential])


def tool_rows(run: Run) -> list[tuple[str, ...]]:
    """Return each tool's largest deviation before and after, and its peak force, in words."""
    rows: list[tuple[str, ...]] = []
    for tool, name in enumerate(run.robots):
        before = run.deviation(run.before, tool).maximum
        after = run.deviation(run.correction.achieved, tool).maximum
        deviations = (f"{1e6 * before:.0f} um", f"{1e6 * after:.1f} um")
        rows.append((f"{name} tool", *deviations, f"{peak_force(run, tool):.0f} N"))
    return rows


def gap_ranges(run: Run) -> tuple[str, str]:
    """Return from where to where the gap between a cell's tools goes, before and after, in words."""
    tool_gap = run.finding_of(TOOL_GAP)
    assert tool_gap is not None
    gap = {name: 1e3 * value for name, value in GapResult.extremes(tool_gap)}
    before, after = (
        f"{gap[f'narrowest_{state}']:.3f} to {gap[f'widest_{state}']:.3f} mm"
        for state in ("before", "after")
    )
    return before, after


def workpieces(case: Case, run: Run) -> dict[str, Workpiece]:
    """Return the workpieces of a corrected run; that before takes an evaluation where it had none."""
    found = run.correction
    before = found.before.response
    if before is None:
        samples = np.searchsorted(found.desired.time, case.desired.time)
        before = case.process.evaluate(found.before.path.at_rows(samples))
    answers = {"before": before, "after": found.response}
    return {stage: a.workpiece for stage, a in answers.items() if a.workpiece is not None}
