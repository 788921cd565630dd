"""A run's figures as plain data: the content of result.json."""

from __future__ import annotations

from dataclasses import asdict
from importlib import metadata
from typing import Any

import numpy as np

from coupling.inverse.diagnosis import GearDiagnosis
from coupling.path.deviation import Deviation
from coupling.run.beat import beat_parts
from coupling.run.deviations import Deviations
from coupling.run.outlook import Outlook
from coupling.run.plant import OnPlant
from coupling.run.study import Run
from coupling.solve.correction import Pass
from coupling.solve.fixed_point import Evaluation

_PACKAGES = ("elastic-robot-fmu", "fmpy", "numpy", "pin", "pythonfmu", "scipy")


def figures_of(run: Run, case: str, tool: int | None = None) -> dict[str, Any]:
    """Return the figures of a run, or of one of its robots.

    Verdict, passes and evaluations of the process are those of the whole cell.

    Args:
        run: The run.
        case: Name of the case.
        tool: Number of the robot, from 0; None: the worst figures of all.
    """
    found, deviations = run.correction, Deviations.of(run, tool)
    wrench = found.answer.wrench if tool is None else found.answer.wrench.tools[tool]
    warnings = [
        warning
        for warning in run.warnings
        if tool is None or not warning.robot or warning.robot == run.robots[tool]
    ]
    gap = {} if run.gap is None or tool is not None else {"pinch_gap_m": run.gap.as_dict()}
    return {
        "case": case,
        "kind": run.kind,
        "mode": run.mode,
        "converged": found.converged,
        "outcome": found.outcome.value,
        "reason": found.reason,
        "process_evaluations": found.evaluations,
        "repeatability": None if run.repeatability is None else run.repeatability.as_dict(),
        "noise": None if run.noise is None else run.noise.as_dict(),
        "before": found.before.how,
        "deviation_before_m": deviations.before.as_dict(),
        "deviation_after_m": deviations.after.as_dict(),
        "consistency_m": found.consistency,
        "peak_force_N": wrench.peak_force,
        "shares_m": {
            "gravity": deviations.gravity.as_dict(),
            "process": deviations.process.as_dict(),
            "gravity_after": _told(deviations.gravity_after),
            "process_after": _told(deviations.process_after),
            "dynamic_after": _told(deviations.dynamic),
        },
        "robustness": [
            {
                "name": replay.name,
                "deviation_m": (replay.deviation if tool is None else replay.tools[tool]).as_dict(),
            }
            for replay in run.robustness
        ],
        "outlook": None
        if (outlook := outlook_of(run, deviations.before)) is None
        else outlook.as_dict(),
        "forecast": None if run.forecast is None else run.forecast.as_dict(),
        "plant": _plant(run.plant, tool),
        "flank_changes": _flank_changes(run, tool),
        "gears": _gears(run, tool),
        "command": _command(run, tool),
        **gap,
        "beat": _beat(run, tool),
        "passes": [_pass_figures(entry) for entry in found.passes],
        "warnings": [
            {**asdict(own), "robot": own.robot or run.robots[0], "text": str(own)}
            for own in warnings
        ],
        "rate_warnings": [str(warning) for warning in warnings if warning.name == "rate"],
        "remarks": list(run.remarks),
        "evaluation_keys": list(run.keys),
        "fmu_fingerprint": run.fmu_fingerprint,
        "versions": versions(),
    }


def outlook_of(run: Run, before: Deviation) -> Outlook | None:
    """Return what to expect on a robot that is none of the model's own.

    Args:
        run: The run.
        before: Deviation under its uncorrected command.

    Returns:
        None where nothing was replayed, and of a robot that was measured, of which the forecast tells.
    """
    return None if run.forecast is not None else Outlook.of(before, run.robustness)


def _told(deviation: Deviation | None) -> dict[str, float] | None:
    return None if deviation is None else deviation.as_dict()


def _beat(run: Run, tool: int | None) -> dict[str, Any] | None:
    """Return what a process that beats leaves, slow part and ripple apart; None where none does."""
    parts = beat_parts(run)
    if parts is None:
        return None
    own = parts if tool is None else [parts[tool]]
    walls = np.array([[part.lowest.min(axis=0), part.highest.max(axis=0)] for part in own])
    return {
        "period_s": run.correction.answer.period,
        "slow_m": max(part.largest_slow for part in own),
        "ripple_m": max(part.largest_ripple for part in own),
        "envelope_m": {
            axis: [float(walls[:, 0, k].min()), float(walls[:, 1, k].max())]
            for k, axis in enumerate("xyz")
        },
    }


def _plant(plant: OnPlant | None, tool: int | None) -> dict[str, Any] | None:
    """Return what the command leaves on the plant; None where the case has none."""
    if plant is None:
        return None
    coupling = plant.coupling
    wrench = plant.wrench if tool is None else plant.wrench.tools[tool]
    return {
        "differences": list(plant.differences),
        "wrench": "model" if coupling is None else "coupled",
        "remark": plant.remark,
        "deviation_m": plant.deviation(tool).as_dict(),
        "peak_force_N": wrench.peak_force,
        "coupling": None
        if coupling is None
        else {
            "converged": coupling.converged,
            "outcome": coupling.outcome.value,
            "reason": coupling.reason,
            "process_evaluations": len(coupling.evaluations),
        },
    }


def _flank_changes(run: Run, tool: int | None) -> list[dict[str, Any]] | None:
    """Return the passages of gears through their play; None where the method does not know them."""
    changes = run.correction.flank_changes
    if changes is None:
        return None
    return [
        {
            "robot": change.robot or run.robots[0],
            "joint": change.joint,
            "begins_s": change.begins,
            "ends_s": change.ends,
            "before": change.before,
            "after": change.after,
        }
        for change in changes
        if tool is None or change.robot in ("", run.robots[tool])
    ]


def _gears(run: Run, tool: int | None) -> list[dict[str, Any]]:
    """Return what the gears go through along the desired path."""
    return [
        {"robot": name, **gear_figures(gear)}
        for number, (name, own) in enumerate(zip(run.robots, run.gears, strict=True))
        if tool in (None, number)
        for gear in own
    ]


def gear_figures(gear: GearDiagnosis) -> dict[str, Any]:
    """Return what one gear goes through."""
    tilt = gear.base_tilt
    return {
        "joint": gear.joint,
        "backlash_rad": gear.backlash,
        "flank_changes": gear.changes,
        "floats_s": gear.floats,
        "margin_Nm": gear.margin,
        "backlash_20_percent_m": gear.miss,
        "torque_Nm": gear.torque,
        "torque_time_s": gear.torque_time,
        "base_tilt_rad": None if tilt is None else tilt.angle,
        "base_tilt_direction_rad": None if tilt is None else tilt.direction,
    }


def _command(run: Run, tool: int | None) -> dict[str, Any]:
    """Return what the command asks of the drives."""
    drives = [
        {
            "robot": name,
            "joint": drive.joint,
            "range_rad": [drive.lowest, drive.highest],
            "range_limit_rad": [drive.lower_limit, drive.upper_limit],
            "rate_rad_s": drive.rate,
            "rate_time_s": drive.rate_time,
            "rate_limit_rad_s": drive.rate_limit,
            "acceleration_rad_s2": drive.acceleration,
            "acceleration_time_s": drive.acceleration_time,
            "acceleration_limit_rad_s2": drive.acceleration_limit,
        }
        for number, (name, own) in enumerate(zip(run.robots, run.drives, strict=True))
        if tool in (None, number)
        for drive in own
    ]
    return {"rows": len(run.correction.joints.time), "drives": drives}


def _pass_figures(entry: Pass) -> dict[str, Any]:
    correction = entry.correction
    sampled = (
        {}
        if correction is None
        else {
            "largest_correction_step_m": correction.largest_step,
            "largest_correction_step_time_s": correction.step_time,
            "rate_limited_samples": correction.limited_samples,
        }
    )
    return {
        "number": entry.number,
        "deviation_m": entry.deviation.as_dict(),
        **sampled,
        "evaluations": [evaluation_figures(e) for e in entry.coupling],
    }


def evaluation_figures(evaluation: Evaluation) -> dict[str, Any]:
    """Return the figures of one evaluation of the process."""
    first = evaluation.number == 1
    return {
        "number": evaluation.number,
        "path_change_max_m": evaluation.path_change,
        "path_change_rms_m": evaluation.path_change_rms,
        "force_change_relative": None if first else evaluation.force_change,
        "springs_relative": evaluation.carried,
        "peak_force_N": evaluation.peak_force,
        "worst_time_s": evaluation.worst_time,
    }


def versions() -> dict[str, str]:
    """Return the versions of the packages that a result depends on."""
    found = {}
    for package in _PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:  # run from a checkout that is not installed
            found[package] = "not installed as a package"
    return found
