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
    beyond = found.repeating
    return NextResult.of(
        found,
        found.options,
        sentences=sentences(found),
        runs=[_run(run) for run in found.history.runs],
        parameters_refused="" if found.learned is None else found.learned.refusal,
        correction=beyond
        and PathCorrectionResult.of(
            beyond, new_m=found.hypotheses.rms, deviation_m=beyond.deviation[:, :3]
        ),
        forecast=forecast,
    )


def _run(run: MeasuredRun) -> NextRunResult:
    forecast, time = run.source.forecast, run.measured.time
    thin = slice(None, None, max(1, len(time) // 2000))
    return NextRunResult.of(
        run,
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
        lines.append(sentence(f"Parameters are not learned: {found.learned.refusal}"))
    if found.move.learns_path:
        lines.append(f"Converges: {found.contraction.sentence}.")
    if not found.options.absolute:
        lines.append(
            "The constant of the deviation is left as the robot file has it: give --frame-known where"
            " the measuring frame is known, and the position is corrected too."
        )
    return lines


def frame_sentence(run: MeasuredRun, known: FrameAccuracy) -> str:
    """Return that a frame is doubted which is said to be known; "" where it is not."""
    if known.explains(run.offset):
        return ""
    off = ", ".join(f"{1e3 * value:+.2g}" for value in run.offset)
    return (
        f"CHECK THE FRAME: {run.measured.name} is off the robot's model by a constant of {off} mm (x, y,"
        f" z of the base), more than a frame known to {1e3 * known.shift:.2g} mm and an industrial robot"
        " are; it is corrected as the robot's: if it is the frame's, the next run is off by that, and"
        " no measurement in this frame shows it."
    )


def clock_sentence(run: MeasuredRun) -> str:
    """Return what a clock that was moved leaves open; "" where it was taken for the command's."""
    if run.clock == 0.0:
        return ""
    path = run.desired
    steps = np.linalg.norm(np.diff(path.position[0], axis=0), axis=1)
    speed = float((steps / np.diff(path.time)).max())
    return (
        f"The clock of {run.measured.name} was moved by {1e3 * run.clock:+.2g} ms, to where it fits"
        " best: a robot that is late by a part of that is not distinguishable, is not corrected, and is"
        f" not in any figure here, at up to {speed:.2g} m/s {_um(1e-3 * speed)} along the path for each"
        " ms: measure on the controller's clock, to a cycle, and it is corrected."
    )


def _verdict(found: CommandPlan) -> str:
    """Return how the last run was, beside the best one and its forecast."""
    runs, judgement = found.history.runs, found.judgement
    last, best = runs[judgement.last], runs[judgement.best]
    if judgement.worse:
        return (
            f"WORSE: {last.source.folder.name} left {_rms(found, last)} rms, {best.source.folder.name}"
            f" only {_rms(found, best)}: back to the command of {best.source.folder.name}, with half of"
            " what was measured under it taken off"
        )
    forecast = last.source.forecast
    if forecast is None:
        return f"The last command left {_rms(found, last)} rms."
    left = last.size.rms if forecast.absolute else last.size.rms_less_constant
    state = "as forecast" if forecast.low <= left <= forecast.high else "not as forecast"
    better = "better" if left < forecast.low else "worse"
    word = state if state == "as forecast" else f"{better} than forecast"
    ends = f"{_um(forecast.low)} to {_um(forecast.high)}"
    return f"The last command left {_um(left)} rms, {word} ({ends})."


def _move(found: CommandPlan) -> str:
    """Return which move is taken, and why."""
    move = found.move
    if found.judgement.again:
        best = found.history.runs[found.judgement.best]
        return (
            f"the command of {best.source.folder.name} once more, since no other is expected to leave"
            " less: what is left are gears in their backlash, noise, or what does not repeat"
        )
    if found.judgement.worse:
        return f"{move.words}, by half, from the best run"
    others = [own for own in found.moves if own is not move]
    left = found.left(move.size)
    if len(found.history.runs) > 1 and move.predicted:
        why = f"forecast the last run before it was measured to {_um(left)} rms"
        compared = ", ".join(f"{own.words} to {_um(found.left(own.size))}" for own in others)
    else:
        why = f"would have left {_um(left)} rms of the last run"
        compared = ", ".join(f"{own.words} {_um(found.left(own.size))}" for own in others)
    return f"{move.words}, which {why}" + (f" ({compared})" if compared else "")


def _rms(found: CommandPlan, run: MeasuredRun) -> str:
    return _um(found.left(run.size))


def _um(length: float) -> str:
    return f"{1e6 * length:.3g} um"
