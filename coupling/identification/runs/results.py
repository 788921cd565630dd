"""What measured runs identify of a robot: figures, refusal and warnings, and the robot itself."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coupling.identification.robot_file import Identification
from coupling.identification.runs.experiment import RunExperiment, size_of
from coupling.identification.runs.fit import ParameterFit
from coupling.identification.runs.judge import (
    discrepancy,
    measurement_lacks,
    mostly_in_backlash,
)
from coupling.identification.runs.measurement import MeasuredPath
from coupling.identification.runs.slow_part import CUT_OFF
from coupling.identification.runs.source import MeasuredFile
from coupling.path.length_text import in_words
from coupling.results.gear_result import GearDiagnosis
from coupling.results.learned_result import (
    LearnedParameterResult,
    LearnedResult,
    LearnedRunResult,
    LeftResult,
)
from coupling.results.run_result import three
from coupling.robot.parameters import apply_values
from elastic_robot.fmi.interface import IDEAL

# More than so many times the noise is not noise.
_FAR = 2.5

Learned = Identification[ParameterFit, LearnedResult]


def conclude(
    sources: Sequence[MeasuredFile],
    fit: ParameterFit,
    before: RunExperiment,
    verdicts: tuple[LearnedParameterResult, ...],
    gears: tuple[GearDiagnosis, ...],
    whole: tuple[GearDiagnosis, ...],
) -> Learned:
    """Return what measured runs identify of a robot.

    Args:
        sources: Runs and measurements.
        fit: The fit.
        before: The runs around the robot file, behind the frame that fits it best.
        verdicts: Verdict on each parameter.
        gears: Diagnosis of the gears where it was measured.
        whole: The same along the whole path of the last run, where nothing is identifiable.
    """
    experiment, first = fit.experiment, sources[0]
    noise = experiment.problem.noise(experiment.residuals)
    left = LeftResult(robot_file=size_of(before.slow), learned=size_of(experiment.slow))
    if any(verdict.identified for verdict in verdicts):
        refusal = _unloaded(fit, noise, gears)
    else:
        seconds = sum(float(np.ptp(run.measured.time)) for run in experiment.problem.runs)
        unknown = discrepancy(left.robot_file, left.learned, noise)
        refusal = f"nothing is identifiable: {measurement_lacks(gears, whole, seconds, unknown)}"
    warnings = _motor_remarks(sources, experiment.problem.runs)
    if left.learned > _FAR * noise and not refusal:
        warnings.append(
            f"{in_words(left.learned)} of the slow part of the deviation remain, noise alone"
            f" would be {in_words(noise)}: an effect that is not in the model (a backlash"
            " with rounded flanks, another load, heat), or a gear unloaded in its backlash; the"
            f" intervals are therefore {fit.left_over.widened:.2g} times as wide, and hardly"
            " identifiable parameters stay near the file"
        )
    result = LearnedResult(
        robot=str(first.file),
        refusal=refusal,
        converged=fit.converged,
        left_m=left,
        noise_m=fit.noise,
        noise_left_m=noise,
        widened=fit.left_over.widened,
        warnings=warnings,
        slow_below_Hz=CUT_OFF,
        parameters=verdicts,
        gears=gears,
        runs=tuple(_run(source, fit, before, number) for number, source in enumerate(sources)),
    )
    robot = apply_values(first.robot, {verdict.name: verdict.written for verdict in verdicts})
    words = (
        f"Slow part of the residual, frame and clock fitted: {in_words(left.robot_file)} rms with"
        f" {first.file.name}, {in_words(left.learned)} with this file."
    )
    return Identification(fit, robot, result, words, command="learn")


def _unloaded(fit: ParameterFit, noise: float, gears: Sequence[GearDiagnosis]) -> str:
    """Return which gears hang free under what is left over noise [m], in words; "" where none does."""
    experiment = fit.experiment
    path = experiment.problem.runs[-1].desired_motion.path
    unloaded = mostly_in_backlash(gears, float(np.ptp(path.time)))
    after = size_of(experiment.whitened)
    if not unloaded or after <= _FAR * noise:
        return ""
    return (
        f"{in_words(after)} remain, noise alone would be {in_words(noise)}, and {unloaded}:"
        " parameters cannot describe a gear that is unloaded in its backlash; place the part or the base"
        " so that it is loaded"
    )


def _motor_remarks(sources: Sequence[MeasuredFile], runs: Sequence[MeasuredPath]) -> list[str]:
    """Return what the user should look at of columns of motors."""
    remarks = [
        f"{source.measured.name}: its columns {source.measured.motors.names[0]} .. are not used, as"
        f" drives are {IDEAL}, or their joints have no motor in the robot file"
        for source, run in zip(sources, runs, strict=True)
        if source.measured.motors is not None and run.measured.motors is None
    ]
    motors = [run.measured.motors for run in runs if run.measured.motors]
    return remarks + [words for columns in motors for words in columns.remarks]


def _of_motors(run: MeasuredPath) -> dict[str, float]:
    """Return the deviations by which columns of motors count [rad], [N m], by name."""
    motors = run.measured.motors
    if motors is None:
        return {}
    return dict(zip(motors.names, motors.deviation.tolist(), strict=True))


def _run(
    source: MeasuredFile, fit: ParameterFit, before: RunExperiment, number: int
) -> LearnedRunResult:
    fitted = fit.experiment
    run = fitted.problem.runs[number]
    frame_values = fitted.problem.frame_values(fitted.x, number)
    slow_before, slow = before.slow[number], fitted.slow[number]
    shift, turn = run.measured.frame_offset(frame_values[:3], frame_values[3:6])
    time = run.measured.time
    return LearnedRunResult(
        run=str(source.folder),
        measured=run.measured.name,
        rows=len(time),
        from_s=float(time[0]),
        to_s=float(time[-1]),
        frame_shift_m=three(shift),
        frame_turn_rad=three(turn),
        clock_s=float(run.measured.clock + frame_values[6]),
        orientation_noise_rad=float(fitted.problem.residuals[number].noise[1])
        if run.tool_rotation is not None
        else None,
        motors=_of_motors(run),
        time=fitted.problem.slow[number].time.tolist(),
        left_robot_file_m=np.linalg.norm(slow_before[:, :3], axis=1).tolist(),
        left_learned_m=np.linalg.norm(slow[:, :3], axis=1).tolist(),
    )
