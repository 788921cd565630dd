"""What was learned: figures in learned.json, and the robot file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coupling.errors import LearnError
from coupling.identification.robot_file import fitted_text
from coupling.identification.runs.learning import Learned
from coupling.identification.runs.measurement import MeasuredPath
from coupling.identification.runs.residual import Residual
from coupling.identification.runs.slow_part import CUT_OFF, SlowPart
from coupling.path.length_text import format_um
from coupling.results.learned_result import (
    LearnedResult,
    LearnedRunResult,
    LeftResult,
)
from coupling.results.run_result import three


def figures(learned: Learned) -> LearnedResult:
    """Return the figures of what was learned; SI."""
    before, after = learned.residual_rms
    return LearnedResult(
        robot=str(learned.sources[0].file),
        refusal=learned.refusal,
        converged=learned.fit.converged,
        left_m=LeftResult(robot_file=before, learned=after),
        noise_m=learned.fit.noise,
        noise_left_m=learned.noise_left,
        widened=learned.widened,
        warnings=learned.warnings,
        slow_below_Hz=CUT_OFF,
        parameters=learned.parameters,
        gears=learned.gears,
        runs=tuple(_run(learned, number) for number in range(len(learned.runs))),
    )


def _of_motors(run: MeasuredPath) -> dict[str, float]:
    """Return the deviations by which columns of motors count [rad], [N m], by name."""
    motors = run.measured.motors
    if motors is None:
        return {}
    return dict(zip(motors.names, motors.deviation.tolist(), strict=True))


def _run(learned: Learned, number: int) -> LearnedRunResult:
    run, source = learned.runs[number], learned.sources[number]
    fitted = learned.fit.experiment
    frame_values = fitted.problem.frame_values(fitted.x, number)
    slow_before, slow = learned.before.slow[number], fitted.slow[number]
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
        orientation_noise_rad=float(Residual(run).noise[1])
        if run.tool_rotation is not None
        else None,
        motors=_of_motors(run),
        time=SlowPart.of(time).time.tolist(),
        left_robot_file_m=np.linalg.norm(slow_before[:, :3], axis=1).tolist(),
        left_learned_m=np.linalg.norm(slow[:, :3], axis=1).tolist(),
    )


def learned_text(learned: Learned, target: Path) -> str:
    """Return the robot file of the first run with what was learned.

    Args:
        learned: Result of learning.
        target: Path of the new file.

    Raises:
        LearnError: If nothing should be written.
        RobotFileError: If the run's robot file cannot be read.
    """
    if learned.refusal:
        raise LearnError(f"{target}: not written: {learned.refusal}")
    start = learned.sources[0].file
    measured = " and ".join(source.measured.name for source in learned.sources)
    before, after = learned.residual_rms
    words = (
        f"Slow part of the residual, frame and clock fitted: {format_um(before)} um rms with"
        f" {start.name}, {format_um(after)} um with this file."
    )
    return fitted_text(start, learned.robot, learned.parameters, "learn", measured, words, target)
