"""How the next command was found: next.json, and in words for terminal and page."""

from __future__ import annotations

import numpy as np

from coupling.errors import sentence
from coupling.identification.next.command import CommandPlan
from coupling.identification.next.measured_run import MeasuredRun
from coupling.identification.next.options import FrameAccuracy
from coupling.results.forecast import RunForecast
from coupling.results.next_result import NextResult, NextRunResult, PathCorrectionResult


def figures(found: CommandPlan, forecast: RunForecast | None = None) -> NextResult:
    """Return the figures of a plan; SI.

    Args:
        found: Plan of the next command.
        forecast: Deviation that it is expected to leave; None before it is computed.
    """
    beyond = found.correction
    return NextResult.of(
        found,
        found.options,
        sentences=sentences(found),
        runs=[_run(run) for run in found.history.runs],
        parameters_refused="" if found.learned is None else found.learned.refusal,
        correction=beyond and PathCorrectionResult.of(beyond, deviation_m=beyond.deviation[:, :3]),
        forecast=forecast,
    )


def _run(run: MeasuredRun) -> NextRunResult:
    forecast, time = run.source.forecast, run.measured.time
    thin = slice(None, None, max(1, len(time) // 2000))
    shift, turn = run.measured.frame_offset(run.shift, run.turn)
    return NextRunResult.of(
        run,
        frame_shift_m=shift,
        frame_turn_rad=turn,
        from_s=time[0],
        to_s=time[-1],
        forecast=forecast and forecast.model_copy(update={"robots": ()}),
        time=time[thin],
        distance_m=np.linalg.norm(run.deviation[thin], axis=1),
    )


def sentences(found: CommandPlan) -> list[str]:
    """Return what there is to say of a plan, the most important first."""
    lines = [_verdict(found)]
    lines.append(f"Next: {_move(found)}.")
    for run in found.history.runs:
        lines += filter(None, (frame_sentence(run, found.options.known), clock_sentence(run)))
    if found.learned is not None and found.learned.refusal:
        lines.append(sentence(f"No parameters are learned: {found.learned.refusal}"))
    if found.correction is not None:
        lines.append(f"Converges: {found.contraction.sentence}.")
    if not found.options.absolute:
        lines.append(
            "The constant part of the deviation is not corrected, as the measuring frame is not known:"
            " give its uncertainty by --frame-known to correct the absolute position too."
        )
    return lines


def frame_sentence(run: MeasuredRun, known: FrameAccuracy) -> str:
    """Return that a frame is doubted which is said to be known; "" where it is not."""
    if known.explains(run.offset):
        return ""
    off = ", ".join(f"{1e3 * value:+.2g}" for value in run.offset)
    return (
        f"CHECK THE FRAME: {run.measured.name} deviates from the robot's model by a constant of {off} mm"
        f" (x, y, z of the base), more than an industrial robot and a frame known to"
        f" {1e3 * known.shift:.2g} mm explain. It is corrected as an error of the robot: if it is one of"
        " the frame, it becomes an error of the next run that no measurement in this frame shows."
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
        f" nor contained in these figures, and is {_um(1e-3 * speed)} along the path per ms at up to"
        f" {speed:.2g} m/s. To have it corrected, measure on the controller's clock, within one"
        " cycle."
    )


def _verdict(found: CommandPlan) -> str:
    """Return how the last run was, beside the best one and its forecast."""
    runs, comparison = found.history.runs, found.comparison
    last, best = runs[comparison.last], runs[comparison.best]
    if comparison.worse:
        return (
            f"WORSE: the deviation under {last.source.folder.name} was {_rms(found, last)} rms, under"
            f" {best.source.folder.name} only {_rms(found, best)}: the next command is that of"
            f" {best.source.folder.name}, corrected by half of the deviation measured under it"
        )
    forecast = last.source.forecast
    if forecast is None:
        return f"Deviation under the last command: {_rms(found, last)} rms."
    left = last.size.rms if forecast.absolute else last.size.rms_less_constant
    state = "as forecast" if forecast.low <= left <= forecast.high else "not as forecast"
    better = "better" if left < forecast.low else "worse"
    word = state if state == "as forecast" else f"{better} than forecast"
    ends = f"{_um(forecast.low)} to {_um(forecast.high)}"
    return f"Deviation under the last command: {_um(left)} rms, {word} ({ends})."


def _move(found: CommandPlan) -> str:
    """Return what is learned, and what to expect of further runs."""
    robot = f"the parameters {found.model.name}"
    best = found.history.runs[found.comparison.best]
    if found.comparison.again:
        return (
            f"the command of {best.source.folder.name} again: the rest is faster than what a correction"
            " of the path reaches, or noise"
        )
    if found.comparison.worse:
        return f"{robot}, with half the correction, from the best run"
    words = {
        "path": f"learning along the path, with {robot}",
        "parameters": robot,
        "both": f"{robot}, and learning along the path",
    }[found.move]
    if found.repeated:
        return words
    return (
        f"{words}; the last two runs differ by as much as is left, which no command corrects: runs are"
        " averaged"
    )


def _rms(found: CommandPlan, run: MeasuredRun) -> str:
    return _um(found.options.rms_of(run.size))


def _um(length: float) -> str:
    return f"{1e6 * length:.3g} um"
