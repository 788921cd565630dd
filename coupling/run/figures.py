"""A run's figures: deviations of its tools and all else that result.json has."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import metadata

import numpy as np

from coupling.path.deviation import Deviation, measure
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.results.outlook import DrawnDeviation, WorstReplay
from coupling.results.run_result import (
    CommandResult,
    DriveResult,
    GapResult,
    GearResult,
    PlantResult,
    ReplayResult,
    ReversalResult,
    RobotResult,
    RunResult,
    ToothPassingResult,
    WarningResult,
)
from coupling.run.execute import Run
from coupling.run.plant import PlantReplay
from coupling.run.tooth_passing import tooth_passing_parts

_PACKAGES = ("elastic-robot-fmu", "fmpy", "numpy", "pin", "pythonfmu", "scipy")


@dataclass(frozen=True)
class Deviations:
    """Deviations of one tool or the worst of several, in a run.

    Attributes:
        before: Deviation of the loaded tool from the desired path, command = desired path.
        after: Deviation of the achieved path from the desired one.
        gravity: Deviation of the unloaded tool from the desired path, command = desired path.
        process: Deviation of the loaded tool from the unloaded one, under the same command.
        gravity_after, process_after: The same under the corrected command: where the tool goes without
            the process, and by how much the process then moves it; None where that was not simulated.
        dynamic: Deviation of the path under the corrected command, simulated in dynamic mode, from the
            desired one; None where that was not run.
    """

    before: Deviation
    after: Deviation
    gravity: Deviation
    process: Deviation
    gravity_after: Deviation | None
    process_after: Deviation | None
    dynamic: Deviation | None

    @classmethod
    def of(cls, run: Run, tool: int | None = None) -> Deviations:
        """Return the deviations of one tool of a run, or the worst of all."""

        def of_tool(path: ToolPath) -> ToolPath:
            return path if tool is None else path.tools[tool]

        correction, desired = run.correction, of_tool(run.desired)
        before, unloaded = of_tool(run.before), of_tool(correction.unloaded)
        achieved = of_tool(correction.achieved)
        dry = None if run.unloaded_after is None else of_tool(run.unloaded_after)
        return cls(
            before=measure(before, desired),
            after=measure(achieved, desired),
            gravity=measure(unloaded, desired),
            process=measure(before, unloaded),
            gravity_after=None if dry is None else measure(dry, desired),
            process_after=None if dry is None else measure(achieved, dry),
            dynamic=None if run.dynamic is None else measure(of_tool(run.dynamic), desired),
        )


def figures_of(
    run: Run, case: str, robots: tuple[RobotResult, ...], tool: int | None = None
) -> RunResult:
    """Return the figures of a run, or of one of its robots.

    Verdict, iterations and evaluations of the process are those of the whole cell.

    Args:
        robots: Its robots, as `drawn_robots` has them.
        tool: Number of the robot, from 0; None: the worst figures of all.
    """
    correction, deviations = run.correction, Deviations.of(run, tool)
    rows_of_tool = slice(None) if tool is None else slice(tool, tool + 1)
    names, any_effect = run.robots[rows_of_tool], correction.backlash_reversals
    warnings = [
        limit_warning
        for limit_warning in run.warnings
        if (limit_warning.robot or names[0]) in names
    ]
    return RunResult.of(
        correction,
        run,
        case=case,
        deviation_before_m=deviations.before,
        deviation_after_m=deviations.after,
        peak_force_N=_of_tool(correction.response.wrench, tool).peak_force,
        shares_m=deviations,
        robustness=[
            ReplayResult(
                name=replay.name,
                deviation_m=replay.deviation if tool is None else replay.tools[tool],
            )
            for replay in run.robustness
        ],
        outlook=outlook_of(run, deviations.before),
        plant=_plant(run.plant, tool),
        backlash_reversals=any_effect
        and [
            ReversalResult.of(change, robot=name)
            for change in any_effect
            if (name := change.robot or names[0]) in names
        ],
        gears=[
            GearResult.of(gear, robot=name)
            for name, gears in zip(names, run.gears[rows_of_tool], strict=True)
            for gear in gears
        ],
        command=CommandResult(
            rows=len(correction.joints.time),
            drives=tuple(
                DriveResult.of(
                    drive,
                    robot=name,
                    range_rad=(drive.lowest, drive.highest),
                    range_limit_rad=(drive.lower_limit, drive.upper_limit),
                )
                for name, drives in zip(names, run.drives[rows_of_tool], strict=True)
                for drive in drives
            ),
        ),
        pinch_gap_m=None if run.gap is None or tool is not None else GapResult.extremes(run.gap),
        tooth_passing=_tooth_passing(run, rows_of_tool),
        warnings=[
            WarningResult.of(
                limit_warning, robot=limit_warning.robot or run.robots[0], text=str(limit_warning)
            )
            for limit_warning in warnings
        ],
        rate_warnings=[str(warning) for warning in warnings if warning.name == "rate"],
        versions=versions(),
        robots=robots[rows_of_tool],
    )


def outlook_of(run: Run, before: Deviation) -> WorstReplay | None:
    """Return what to expect on a robot that is none of the model's own.

    Args:
        before: Deviation under its uncorrected command.

    Returns:
        None where nothing was replayed, and of a robot that was measured, of which the forecast tells.
    """
    if run.forecast is not None:
        return None
    expected = DrawnDeviation.among(run.drawn)
    return WorstReplay.among(before, run.robustness, expected)


def _of_tool(wrench: WrenchHistory, tool: int | None) -> WrenchHistory:
    return wrench if tool is None else wrench.tools[tool]


def _tooth_passing(run: Run, tools: slice) -> ToothPassingResult | None:
    """Return what a periodic process leaves, slow part and ripple apart; None where none does."""
    parts, period = tooth_passing_parts(run), run.correction.response.period
    if parts is None or period is None:
        return None
    parts_of_tools = parts[tools]
    lowest = np.min([part.lowest.min(axis=0) for part in parts_of_tools], axis=0)
    highest = np.max([part.highest.max(axis=0) for part in parts_of_tools], axis=0)
    walls = zip(lowest.tolist(), highest.tolist(), strict=True)
    return ToothPassingResult(
        period_s=period,
        slow_m=max(part.largest_slow for part in parts_of_tools),
        ripple_m=max(part.largest_ripple for part in parts_of_tools),
        envelope_m=dict(zip("xyz", walls, strict=True)),
    )


def _plant(plant: PlantReplay | None, tool: int | None) -> PlantResult | None:
    """Return what the command leaves on the plant; None where the case has none."""
    if plant is None:
        return None
    return PlantResult.of(
        plant,
        wrench="model" if plant.coupling is None else "coupled",
        deviation_m=plant.deviation(tool),
        peak_force_N=_of_tool(plant.wrench, tool).peak_force,
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
