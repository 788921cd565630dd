"""What was learned: figures in learned.json, and the robot file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coupling.errors import LearnError
from coupling.identification.robot_file import FileEntry, fitted_text
from coupling.identification.runs.judge import LearnedParameter
from coupling.identification.runs.learning import Learned
from coupling.identification.runs.measurement import MeasuredPath
from coupling.identification.runs.residual import Residual
from coupling.identification.runs.slow_part import CUT_OFF, SlowPart
from coupling.identification.verdict import interval_words
from coupling.results.learned_result import (
    LearnedParameterResult,
    LearnedResult,
    LearnedRunResult,
    LeftResult,
)
from coupling.results.run_result import three


def figures(found: Learned) -> LearnedResult:
    """Return the figures of what was learned; SI."""
    before, after = found.left
    return LearnedResult(
        robot=str(found.sources[0].file),
        refusal=found.refusal,
        converged=found.fit.converged,
        left_m=LeftResult(robot_file=before, learned=after),
        noise_m=found.spread.noise,
        noise_left_m=found.noise_left,
        widened=found.widened,
        warnings=found.warnings,
        draws=found.spread.draws,
        slow_below_Hz=CUT_OFF,
        parameters=tuple(map(_parameter, found.parameters)),
        gears=found.gears,
        runs=tuple(_run(found, number) for number in range(len(found.runs))),
    )


def _parameter(parameter: LearnedParameter) -> LearnedParameterResult:
    return LearnedParameterResult(
        name=parameter.name,
        start=parameter.start,
        value=parameter.value,
        low=parameter.low,
        high=parameter.high,
        written=parameter.written,
        factor=parameter.factor,
        factor_low=parameter.low / parameter.start,
        factor_high=parameter.high / parameter.start,
        identifiable=parameter.identifiable,
        significant=parameter.significant,
        effect_m=parameter.effect,
        reason=parameter.reason,
    )


def _of_motors(one: MeasuredPath) -> dict[str, float]:
    """Return the deviations by which columns of motors count [rad], [N m], by name."""
    motors = one.measured.motors
    if motors is None:
        return {}
    return dict(zip(motors.names, motors.deviation.tolist(), strict=True))


def _run(found: Learned, number: int) -> LearnedRunResult:
    one, source = found.runs[number], found.sources[number]
    size = (len(found.fit.z) - len(found.parameters)) // len(found.runs)
    own = found.fit.z[len(found.parameters) + size * number :][:size]
    rest, slow = found.before[number], found.fit.slow[number]
    shift, turn = one.measured.frame_offset(own[:3], own[3:6])
    time = one.measured.time
    return LearnedRunResult(
        run=str(source.folder),
        measured=one.measured.name,
        rows=len(time),
        from_s=float(time[0]),
        to_s=float(time[-1]),
        frame_shift_m=three(shift),
        frame_turn_rad=three(turn),
        clock_s=float(one.measured.clock + own[6]),
        orientation_noise_rad=float(Residual(one).noise[1]) if one.held is not None else None,
        motors=_of_motors(one),
        time=SlowPart.of(time).time.tolist(),
        left_robot_file_m=np.linalg.norm(rest[:, :3], axis=1).tolist(),
        left_learned_m=np.linalg.norm(slow[:, :3], axis=1).tolist(),
    )


def learned_text(found: Learned, target: Path) -> str:
    """Return the robot file of the first run with what was learned.

    Args:
        found: Result of learning.
        target: Path of the new file.

    Raises:
        LearnError: If nothing should be written.
        RobotFileError: If the run's robot file cannot be read.
    """
    if found.refusal:
        raise LearnError(f"{target}: not written: {found.refusal}")
    start = found.sources[0].file
    measured = " and ".join(source.measured.name for source in found.sources)
    entries = [
        FileEntry(
            own.name,
            None if own.written == own.start else own.written,
            remark(own),
            interval=(own.low, own.high),
        )
        for own in found.parameters
    ]
    before, after = found.left
    left = (
        f"Slow part of the residual, frame and clock fitted: {1e6 * before:.1f} um rms with"
        f" {start.name}, {1e6 * after:.1f} um with this file."
    )
    return fitted_text(start, found.robot, entries, "learn", measured, left, target)


def remark(own: LearnedParameter) -> str:
    """Return how sure a value is, in words."""
    if own.identifiable or own.written == own.start:
        return own.remark
    return f"best fit with the others, but {own.reason}; {interval_words(own.low, own.high)}"
