"""A run's figures: the content of result.json."""

from __future__ import annotations

from dataclasses import asdict
from importlib import metadata

import numpy as np

from coupling.inverse.diagnosis import GearDiagnosis
from coupling.path.deviation import Deviation
from coupling.process.noise_filter import AdaptiveLowPass
from coupling.process.repeatability import Repeatability
from coupling.process.smoothing import ForceNoise
from coupling.results.outlook import WorstReplay
from coupling.results.run_result import (
    CommandResult,
    DriveResult,
    EvaluationResult,
    GapResult,
    GearResult,
    IterationResult,
    NoiseResult,
    PlantCouplingResult,
    PlantResult,
    RepeatabilityResult,
    ReplayResult,
    ReversalResult,
    RobotResult,
    RunResult,
    SharesResult,
    ToothPassingResult,
    WarningResult,
)
from coupling.run.deviations import Deviations
from coupling.run.execute import Run
from coupling.run.plant import PlantReplay
from coupling.run.tooth_passing import tooth_passing_parts
from coupling.solve.correction import CorrectionIteration
from coupling.solve.fixed_point import Evaluation

_PACKAGES = ("elastic-robot-fmu", "fmpy", "numpy", "pin", "pythonfmu", "scipy")


def figures_of(
    run: Run, case: str, robots: tuple[RobotResult, ...], tool: int | None = None
) -> RunResult:
    """Return the figures of a run, or of one of its robots.

    Verdict, iterations and evaluations of the process are those of the whole cell.

    Args:
        run: The run.
        case: Name of the case.
        robots: Its robots, as `drawn_robots` has them.
        tool: Number of the robot, from 0; None: the worst figures of all.
    """
    found, deviations = run.correction, Deviations.of(run, tool)
    wrench = found.answer.wrench if tool is None else found.answer.wrench.tools[tool]
    warnings = [
        warning
        for warning in run.warnings
        if tool is None or not warning.robot or warning.robot == run.robots[tool]
    ]
    return RunResult(
        case=case,
        kind=run.kind,
        mode=run.mode,
        converged=found.converged,
        outcome=found.outcome.value,
        reason=found.reason,
        process_evaluations=found.evaluations,
        repeatability=_repeatability(run.repeatability),
        noise=_noise(run.noise),
        before=found.before.how,
        deviation_before_m=deviations.before,
        deviation_after_m=deviations.after,
        consistency_m=found.consistency,
        peak_force_N=wrench.peak_force,
        shares_m=SharesResult(
            gravity=deviations.gravity,
            process=deviations.process,
            gravity_after=deviations.gravity_after,
            process_after=deviations.process_after,
            dynamic_after=deviations.dynamic,
        ),
        robustness=tuple(
            ReplayResult(
                name=replay.name,
                deviation_m=replay.deviation if tool is None else replay.tools[tool],
            )
            for replay in run.robustness
        ),
        outlook=outlook_of(run, deviations.before),
        forecast=run.forecast,
        plant=_plant(run.plant, tool),
        backlash_reversals=_backlash_reversals(run, tool),
        gears=_gears(run, tool),
        command=_command(run, tool),
        pinch_gap_m=None if run.gap is None or tool is not None else GapResult.of(run.gap),
        tooth_passing=_tooth_passing(run, tool),
        iterations=tuple(_iteration_figures(entry) for entry in found.iterations),
        warnings=tuple(
            WarningResult(**asdict(own) | {"robot": own.robot or run.robots[0]}, text=str(own))
            for own in warnings
        ),
        rate_warnings=tuple(str(warning) for warning in warnings if warning.name == "rate"),
        remarks=run.remarks,
        evaluation_keys=run.keys,
        fmu_fingerprint=run.fmu_fingerprint,
        versions=versions(),
        robots=robots if tool is None else robots[tool : tool + 1],
    )


def outlook_of(run: Run, before: Deviation) -> WorstReplay | None:
    """Return what to expect on a robot that is none of the model's own.

    Args:
        run: The run.
        before: Deviation under its uncorrected command.

    Returns:
        None where nothing was replayed, and of a robot that was measured, of which the forecast tells.
    """
    return None if run.forecast is not None else WorstReplay.of(before, run.robustness)


def _repeatability(found: Repeatability | None) -> RepeatabilityResult | None:
    if found is None:
        return None
    return RepeatabilityResult(largest_N=found.largest, rms_N=found.rms, peak_N=found.peak)


def _noise(noise: ForceNoise | None) -> NoiseResult | None:
    if noise is None:
        return None
    return NoiseResult(
        level_N=noise.force,
        cutoff_Hz=None if noise.filter is None else noise.filter.cutoff,
        adaptive=isinstance(noise.filter, AdaptiveLowPass),
        counts=noise.heard,
        sentence=noise.sentence,
    )


def _tooth_passing(run: Run, tool: int | None) -> ToothPassingResult | None:
    """Return what a periodic process leaves, slow part and ripple apart; None where none does."""
    parts, period = tooth_passing_parts(run), run.correction.answer.period
    if parts is None or period is None:
        return None
    own = parts if tool is None else [parts[tool]]
    walls = np.array([[part.lowest.min(axis=0), part.highest.max(axis=0)] for part in own])
    return ToothPassingResult(
        period_s=period,
        slow_m=max(part.largest_slow for part in own),
        ripple_m=max(part.largest_ripple for part in own),
        envelope_m={
            axis: (float(walls[:, 0, k].min()), float(walls[:, 1, k].max()))
            for k, axis in enumerate("xyz")
        },
    )


def _plant(plant: PlantReplay | None, tool: int | None) -> PlantResult | None:
    """Return what the command leaves on the plant; None where the case has none."""
    if plant is None:
        return None
    coupling = plant.coupling
    wrench = plant.wrench if tool is None else plant.wrench.tools[tool]
    return PlantResult(
        differences=tuple(plant.differences),
        wrench="model" if coupling is None else "coupled",
        remark=plant.remark,
        deviation_m=plant.deviation(tool),
        peak_force_N=wrench.peak_force,
        coupling=None
        if coupling is None
        else PlantCouplingResult(
            converged=coupling.converged,
            outcome=coupling.outcome.value,
            reason=coupling.reason,
            process_evaluations=len(coupling.evaluations),
        ),
    )


def _backlash_reversals(run: Run, tool: int | None) -> tuple[ReversalResult, ...] | None:
    """Return the passages of gears through their backlash; None where the method does not know them."""
    changes = run.correction.backlash_reversals
    if changes is None:
        return None
    return tuple(
        ReversalResult(
            robot=change.robot or run.robots[0],
            joint=change.joint,
            begins_s=change.begins,
            ends_s=change.ends,
            before=change.before,
            after=change.after,
        )
        for change in changes
        if tool is None or change.robot in ("", run.robots[tool])
    )


def _gears(run: Run, tool: int | None) -> tuple[GearResult, ...]:
    """Return what the gears go through along the desired path."""
    return tuple(
        gear_figures(gear, robot=name)
        for number, (name, own) in enumerate(zip(run.robots, run.gears, strict=True))
        if tool in (None, number)
        for gear in own
    )


def gear_figures(
    gear: GearDiagnosis, robot: str | None = None, swing: float | None = None
) -> GearResult:
    """Return what one gear goes through.

    Args:
        gear: The gear along its path.
        robot: Name of its robot; None where that is told elsewhere.
        swing: By how much its torque changes along the path [N m]; None where that is not asked.
    """
    tilt = gear.base_tilt
    return GearResult(
        robot=robot,
        joint=gear.joint,
        backlash_rad=gear.backlash,
        backlash_reversals=gear.changes,
        in_backlash_s=gear.in_backlash,
        margin_Nm=gear.margin,
        backlash_20_percent_m=gear.miss,
        torque_Nm=gear.torque,
        torque_time_s=gear.torque_time,
        base_tilt_rad=None if tilt is None else tilt.angle,
        base_tilt_direction_rad=None if tilt is None else tilt.direction,
        swing_Nm=swing,
    )


def _command(run: Run, tool: int | None) -> CommandResult:
    """Return what the command asks of the drives."""
    drives = tuple(
        DriveResult(
            robot=name,
            joint=drive.joint,
            range_rad=(drive.lowest, drive.highest),
            range_limit_rad=(drive.lower_limit, drive.upper_limit),
            rate_rad_s=drive.rate,
            rate_time_s=drive.rate_time,
            rate_limit_rad_s=drive.rate_limit,
            acceleration_rad_s2=drive.acceleration,
            acceleration_time_s=drive.acceleration_time,
            acceleration_limit_rad_s2=drive.acceleration_limit,
        )
        for number, (name, own) in enumerate(zip(run.robots, run.drives, strict=True))
        if tool in (None, number)
        for drive in own
    )
    return CommandResult(rows=len(run.correction.joints.time), drives=drives)


def _iteration_figures(entry: CorrectionIteration) -> IterationResult:
    own = entry.correction
    return IterationResult(
        number=entry.number,
        deviation_m=entry.deviation,
        largest_correction_step_m=None if own is None else own.largest_step,
        largest_correction_step_time_s=None if own is None else own.step_time,
        rate_limited_samples=None if own is None else own.limited_samples,
        evaluations=tuple(evaluation_figures(e) for e in entry.coupling),
    )


def evaluation_figures(evaluation: Evaluation) -> EvaluationResult:
    """Return the figures of one evaluation of the process."""
    first = evaluation.number == 1
    return EvaluationResult(
        number=evaluation.number,
        path_change_max_m=evaluation.path_change,
        path_change_rms_m=evaluation.path_change_rms,
        force_change_relative=None if first else evaluation.force_change,
        springs_relative=evaluation.carried,
        peak_force_N=evaluation.peak_force,
        worst_time_s=evaluation.worst_time,
    )


def versions() -> dict[str, str]:
    """Return the versions of the packages that a result depends on."""
    found = {}
    for package in _PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:  # run from a checkout that is not installed
            found[package] = "not installed as a package"
    return found
