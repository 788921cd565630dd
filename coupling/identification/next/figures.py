"""How the next command was found: next.json, and in words for terminal and page."""

from __future__ import annotations

import numpy as np

from coupling.errors import sentence
from coupling.identification.next.command import CommandPlan
from coupling.identification.next.measured_run import MeasuredRun
from coupling.identification.next.options import FrameAccuracy
from coupling.results.forecast import RunForecast
from coupling.results.next_result import (
    CauseResult,
    MoveResult,
    NextResult,
    NextRunResult,
    PathCorrectionResult,
)
from coupling.results.run_result import three


def figures(found: CommandPlan, forecast: RunForecast | None = None) -> NextResult:
    """Return the figures of a plan; SI.

    Args:
        found: Plan of the next command.
        forecast: Deviation that it is expected to leave; None before it is computed.
    """
    return NextResult(
        absolute=found.options.absolute,
        sentences=tuple(sentences(found)),
        runs=tuple(map(_run, found.history.runs)),
        judgement=found.judgement,
        move=found.move.kind,
        robot=found.move.model.name,
        moves=tuple(
            MoveResult(
                kind=step.kind, robot=step.model.name, predicted=step.predicted, left_m=step.size
            )
            for step in found.moves
        ),
        parameters_refused="" if found.learned is None else found.learned.refusal,
        contraction=found.contraction,
        correction=_correction(found),
        causes=tuple(
            CauseResult(
                kind=cause.kind,
                joint=cause.joint,
                waves=cause.waves,
                rms_m=cause.size,
                text=str(cause),
            )
            for cause in found.causes
        ),
        forecast=forecast,
    )


def _correction(found: CommandPlan) -> PathCorrectionResult | None:
    """Return the correction along the path; None where there is none."""
    part = found.repeating
    if part is None:
        return None
    return PathCorrectionResult(
        cutoff_Hz=part.cutoff,
        weights=part.weights,
        new_m=found.hypotheses.rms,
        left_m=part.left,
        time=part.time.tolist(),
        deviation_m=part.deviation[:, :3].tolist(),
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
        forecast=forecast and forecast.model_copy(update={"robots": ()}),
        distance_m=np.linalg.norm(run.deviation[thin], axis=1).tolist(),
    )


def sentences(found: CommandPlan) -> list[str]:
    """Return what there is to say of a plan, the most important first."""
    lines = [_verdict(found)]
    lines.append(f"Next: {_move(found)}.")
    for run in found.history.runs:
        lines += filter(None, (frame_sentence(run, found.options.known), clock_sentence(run)))
    if found.learned is not None and found.learned.refusal:
        lines.append(sentence(f"No parameters are learned: {found.learned.refusal}"))
    if found.move.learns_path:
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
    runs, judgement = found.history.runs, found.judgement
    last, best = runs[judgement.last], runs[judgement.best]
    if judgement.worse:
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
    """Return which move is taken, and why."""
    move = found.move
    if found.judgement.again:
        best = found.history.runs[found.judgement.best]
        return (
            f"the command of {best.source.folder.name} again, as no other is expected to be better: the"
            " rest is due to gears in their backlash, to noise, or does not repeat"
        )
    if found.judgement.worse:
        return f"{move.words}, with half the correction, from the best run"
    others = [own for own in found.moves if own is not move]
    left = found.left(move.size)
    if len(found.history.runs) > 1 and move.predicted:
        why = (
            f"fitted to the earlier runs it predicts the last one with an error of {_um(left)} rms"
        )
    else:
        why = f"of the last run it would leave {_um(left)} rms"
    compared = ", ".join(f"{own.words} {_um(found.left(own.size))}" for own in others)
    return f"{move.words}; {why}" + (f" ({compared})" if compared else "")


def _rms(found: CommandPlan, run: MeasuredRun) -> str:
    return _um(found.left(run.size))


def _um(length: float) -> str:
    return f"{1e6 * length:.3g} um"
