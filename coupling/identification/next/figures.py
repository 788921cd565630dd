"""How the next command was computed: next.json, and in words for terminal and page."""

from __future__ import annotations

import numpy as np

from coupling.errors import sentence
from coupling.identification.next.command import CommandPlan
from coupling.identification.next.measured_run import MeasuredRun
from coupling.identification.next.options import FrameAccuracy
from coupling.path.length_text import in_words
from coupling.results.forecast import RunForecast
from coupling.results.next_result import (
    NextResult,
    NextRunResult,
    PathCorrectionResult,
)
from coupling.results.run_result import three

# Constants that differ by so many times what differs from run to run are those of another tool or part.
_MOVED = 5.0


def figures(plan: CommandPlan, forecast: RunForecast | None = None) -> NextResult:
    """Return the figures of a plan; SI.

    Args:
        plan: Plan of the next command.
        forecast: Deviation that it is expected to leave; None before it is computed.
    """
    return NextResult(
        absolute=plan.options.absolute,
        tolerance_m=plan.history.runs[-1].source.tolerance,
        warnings=tuple(_warnings(plan)),
        sentences=tuple(sentences(plan)),
        runs=tuple(map(_run, plan.history.runs)),
        step=plan.step,
        move=plan.move,
        robot=plan.model.name,
        parameters_refused="" if plan.learned is None else plan.learned.result.refusal,
        lowest_mode_Hz=plan.model.lowest_mode if np.isfinite(plan.model.lowest_mode) else None,
        correction=_correction(plan),
        forecast=forecast,
    )


def _correction(plan: CommandPlan) -> PathCorrectionResult | None:
    """Return the correction along the path; None where there is none."""
    correction = plan.correction
    if correction is None:
        return None
    return PathCorrectionResult(
        cutoff_Hz=correction.cutoff,
        gain=correction.gain,
        time=correction.time.tolist(),
        deviation_m=correction.deviation[:, :3].tolist(),
    )


def _run(run: MeasuredRun) -> NextRunResult:
    forecast, time = run.source.forecast, run.measured.time
    thin = slice(None, None, max(1, len(time) // 2000))
    shift, turn = run.measured.frame_offset(run.shift, run.turn)
    return NextRunResult(
        run=str(run.source.folder),
        measured=run.measured.name,
        rows=len(time),
        from_s=float(time[0]),
        to_s=float(time[-1]),
        frame_shift_m=three(shift),
        frame_turn_rad=three(turn),
        clock_s=run.clock,
        time=time[thin].tolist(),
        tip_m=three(run.tip),
        noise_m=run.noise,
        left_out=run.left_out,
        size_m=run.size,
        forecast=forecast,
        distance_m=np.linalg.norm(run.deviation[thin], axis=1).tolist(),
    )


def sentences(plan: CommandPlan) -> list[str]:
    """Return what there is to say of a plan, the most important first."""
    lines = [_verdict(plan)]
    lines.append(f"Next: {_move(plan)}.")
    lines += _warnings(plan)
    if plan.learned is not None and plan.learned.result.refusal:
        lines.append(sentence(f"No parameters are learned: {plan.learned.result.refusal}"))
    if not plan.options.absolute:
        lines.append(
            "The constant part of the deviation is not corrected, as the measuring frame is not known:"
            " give its uncertainty by --frame-known to correct the absolute position too."
        )
    return lines


def _warnings(plan: CommandPlan) -> list[str]:
    """Return what is doubtful of the measurements."""
    accuracy = plan.options.frame_accuracy
    texts = [constant_sentence(plan)] if plan.options.absolute else []
    for run in plan.history.runs:
        texts += [frame_sentence(run, accuracy), clock_sentence(run)]
    return [text for text in texts if text]


def constant_sentence(plan: CommandPlan) -> str:
    """Return that the robot, its tool or the part is elsewhere than in the run before; "" where not."""
    history, last = plan.history, len(plan.history.runs) - 1
    before, now = (
        history.unmodelled(number, plan.model.x)[:, :3].mean(axis=0)
        for number in (max(last - 1, 0), last)
    )
    shift = now - before
    if np.linalg.norm(shift) <= _MOVED * plan.options.random:
        return ""
    off = ", ".join(f"{1e3 * value:+.2g}" for value in shift)
    return (
        f"Since the run before the whole path has moved by {off} mm (x, y, z of the base), as after a"
        " change of tool, part or zero: this is corrected. Measure this run again if nothing was"
        " changed."
    )


def frame_sentence(run: MeasuredRun, frame_accuracy: FrameAccuracy) -> str:
    """Return that a frame is doubted which is said to be known; "" where it is not."""
    if frame_accuracy.explains(run.offset):
        return ""
    off = ", ".join(f"{1e3 * value:+.2f}" for value in run.offset)
    return (
        f"CHECK THE FRAME: {run.measured.name} deviates from the robot's model by a constant of {off} mm"
        f" (x, y, z of the base), more than an industrial robot and a frame known to"
        f" {1e3 * frame_accuracy.shift:.2g} mm explain. It is corrected as an error of the robot: if it"
        " is one of the frame, it becomes one of the next run that no measurement in this frame shows."
    )


def clock_sentence(run: MeasuredRun) -> str:
    """Return what a clock that was moved leaves open; "" where it was taken for the command's."""
    if run.clock == 0.0:
        return ""
    path = run.desired
    steps = np.linalg.norm(np.diff(path.position[0], axis=0), axis=1)
    speed = float((steps / np.diff(path.time)).max())
    return (
        f"The clock of {run.measured.name} was shifted by {1e3 * run.clock:+.2g} ms to fit best. A"
        " delay of the robot of this order is not distinguishable from it: it is neither corrected"
        f" nor contained in these figures, and is {in_words(1e-3 * speed)} along the path per ms at"
        f" up to {speed:.2g} m/s. To have it corrected, measure on the controller's clock and give"
        " --clock-known."
    )


def _verdict(plan: CommandPlan) -> str:
    """Return how the last run compares with the best one and its forecast."""
    runs, step = plan.history.runs, plan.step
    last, base = runs[-1], runs[step.base]
    if step.worse:
        name = base.source.folder.name
        return (
            f"WORSE: the deviation under {last.source.folder.name} was {_rms(plan, last)} rms, under"
            f" {name} only {_rms(plan, base)}: where it was worse the next command is that of {name}"
            " again"
        )
    forecast = last.source.forecast
    if forecast is None:
        return f"Deviation under the last command: {_rms(plan, last)} rms."
    rms = last.size.rms if forecast.absolute else last.size.rms_less_constant
    state = "as forecast" if forecast.low <= rms <= forecast.high else "worse than forecast"
    if rms < forecast.low:
        state = "better than forecast"
    interval = f"{in_words(forecast.low)} to {in_words(forecast.high)}"
    return f"Deviation under the last command: {in_words(rms)} rms, {state} ({interval})."


def _move(plan: CommandPlan) -> str:
    """Return what is learned, and what to expect of further runs."""
    words = f"the parameters {plan.model.name}"
    correction = plan.correction
    if correction is not None:
        words = (
            f"learning along the path up to {correction.cutoff:.2g} Hz with gain"
            f" {correction.gain:.2g} in the mean, with {words}"
        )
    return words


def _rms(plan: CommandPlan, run: MeasuredRun) -> str:
    return in_words(plan.options.rms_of(run.size))
