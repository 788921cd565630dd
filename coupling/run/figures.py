"""A run's figures: deviations of its tools and all else that result.json has."""

from __future__ import annotations

from importlib import metadata
from typing import TypeVar

import numpy as np

from coupling.path.deviation import Deviation, DeviationParts
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.results.drive_result import CommandResult
from coupling.results.gear_result import BacklashReversal
from coupling.results.limit_warning import LimitWarning
from coupling.results.outlook import WorstReplay
from coupling.results.run_result import (
    GapResult,
    RobotResult,
    RunResult,
    SharesResult,
    ToothPassingResult,
)
from coupling.run.cut_check import CUT_STABILITY
from coupling.run.drive_motion import DRIVE_MOTION
from coupling.run.execute import Run
from coupling.run.expected_robots import DRAWN_ROBOTS
from coupling.run.gear_check import GEAR_LOADS
from coupling.run.path_checks import TOOL_GAP, UNLOADED_PATHS
from coupling.run.plant import PLANT_REPLAY

_PACKAGES = ("elastic-robot-fmu", "fmpy", "numpy", "pin", "pythonfmu", "scipy")


def shares_of(run: Run, tool: int | None = None) -> SharesResult:
    """Return the deviations by cause of one tool of a run, or the worst of all."""

    def between(path: ToolPath | None, other: ToolPath | None) -> Deviation | None:
        return None if path is None or other is None else run.deviation(path, tool, other)

    correction, unloaded_after = run.correction, run.finding_of(UNLOADED_PATHS)
    return SharesResult(
        gravity=run.deviation(correction.unloaded, tool),
        process=run.deviation(run.before, tool, correction.unloaded),
        gravity_after=between(unloaded_after, run.desired),
        process_after=between(correction.achieved, unloaded_after),
        dynamic_after=between(run.dynamic, run.desired),
    )


def figures_of(
    run: Run, case: str, robots: tuple[RobotResult, ...], tool: int | None = None
) -> RunResult:
    """Return the figures of a run, or of one of its robots.

    Verdict, iterations and evaluations of the process are those of the whole cell.

    Args:
        tool: Number of the robot, from 0; None: the worst figures of all.
    """
    correction, gap, plant = run.correction, run.finding_of(TOOL_GAP), run.finding_of(PLANT_REPLAY)
    rows_of_tool = slice(None) if tool is None else slice(tool, tool + 1)
    names, reversals = run.robots[rows_of_tool], correction.backlash_reversals
    before = run.deviation(run.before, tool)
    warnings = tuple(_with_robot(warning, run) for warning in run.warnings)
    warnings = tuple(warning for warning in warnings if warning.robot in names)
    return RunResult(
        case=case,
        kind=run.kind,
        mode=run.mode,
        converged=correction.converged,
        outcome=correction.outcome.value,
        reason=correction.reason,
        process_evaluations=correction.evaluations,
        repeatability=run.repeatability,
        noise=run.noise,
        before=correction.before.how,
        deviation_before_m=before,
        deviation_after_m=run.deviation(correction.achieved, tool),
        consistency_m=correction.consistency,
        peak_force_N=_of_tool(correction.response.wrench, tool).peak_force,
        shares_m=shares_of(run, tool),
        robustness=tuple(
            replay if tool is None else replay.of_tool(tool) for replay in run.robustness
        ),
        outlook=outlook_of(run),
        stability=run.finding_of(CUT_STABILITY).stability,
        mean_force_across=run.finding_of(CUT_STABILITY).force,
        cut=run.finding_of(CUT_STABILITY).cut,
        forecast=run.forecast,
        plant=plant and plant.of_tool(tool),
        backlash_reversals=None
        if reversals is None
        else tuple(r for r in (_with_robot(r, run) for r in reversals) if r.robot in names),
        gears=tuple(
            gear.model_copy(update={"robot": name})
            for name, gears in zip(names, run.finding_of(GEAR_LOADS)[rows_of_tool], strict=True)
            for gear in gears
        ),
        command=CommandResult(
            rows=len(correction.joints.time),
            drives=tuple(
                drive.model_copy(update={"robot": name})
                for name, drives in zip(
                    names, run.finding_of(DRIVE_MOTION)[rows_of_tool], strict=True
                )
                for drive in drives
            ),
        ),
        pinch_gap_m=None if gap is None or tool is not None else GapResult.extremes(gap),
        tooth_passing=_tooth_passing(run, rows_of_tool),
        iterations=correction.iterations,
        warnings=warnings,
        rate_warnings=tuple(warning.text for warning in warnings if warning.name == "rate"),
        remarks=run.remarks,
        evaluation_keys=run.keys,
        fmu_fingerprint=run.fmu_fingerprint,
        versions=versions(),
        robots=robots[rows_of_tool],
    )


_Named = TypeVar("_Named", LimitWarning, BacklashReversal)


def _with_robot(part: _Named, run: Run) -> _Named:
    """Return what is of one robot with its name, which it lacks where there is one robot alone."""
    return part if part.robot else part.model_copy(update={"robot": run.robots[0]})


def outlook_of(run: Run) -> WorstReplay | None:
    """Return what to expect on robots that are none of the model's own, of the tool that is worst.

    Returns:
        None where nothing was replayed, of a coupling, which commands nothing, and of a robot that was
        measured, of which the forecast tells.
    """
    if run.forecast is not None or run.kind == "couple":
        return None
    drawn = run.finding_of(DRAWN_ROBOTS)
    return WorstReplay.among(run.deviation(run.before), run.robustness, drawn)


def _of_tool(wrench: WrenchHistory, tool: int | None) -> WrenchHistory:
    return wrench if tool is None else wrench.tools[tool]


def _tooth_passing(run: Run, tools: slice) -> ToothPassingResult | None:
    """Return what a periodic process leaves, slow part and ripple apart; None where none does.

    Neither does one whose period is longer than the path.
    """
    correction = run.correction
    time, period = correction.desired.time, correction.response.period
    if period is None or period > time[-1] - time[0]:
        return None
    deviation = correction.achieved.position - correction.desired.position
    parts_of_tools = [DeviationParts.of(time, of_tool, period) for of_tool in deviation[tools]]
    lowest = np.min([part.lowest.min(axis=0) for part in parts_of_tools], axis=0)
    highest = np.max([part.highest.max(axis=0) for part in parts_of_tools], axis=0)
    walls = zip(lowest.tolist(), highest.tolist(), strict=True)
    return ToothPassingResult(
        period_s=period,
        slow_m=max(part.largest_slow for part in parts_of_tools),
        ripple_m=max(part.largest_ripple for part in parts_of_tools),
        envelope_m=dict(zip("xyz", walls, strict=True)),
    )


def versions() -> dict[str, str]:
    """Return the versions of the packages that a result depends on."""
    version_of = {}
    for package in _PACKAGES:
        try:
            version_of[package] = metadata.version(package)
        except metadata.PackageNotFoundError:  # run from a checkout that is not installed
            version_of[package] = "not installed as a package"
    return version_of
