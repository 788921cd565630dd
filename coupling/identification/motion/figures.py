"""What an identification from motion found: identified.json, and what its report is drawn from."""

from __future__ import annotations

import numpy as np

from coupling.identification.motion.identification import Judged, MotionIdentification
from coupling.results.motion_result import (
    LinesResult,
    MotionParameterResult,
    MotionResult,
    RecordingResult,
    TermResult,
    WindUpShareResult,
)


def motion_figures(found: MotionIdentification) -> MotionResult:
    """Return the figures of an identification; SI, None for what is infinite or not known."""
    first = found.judged[0]
    inertia = [joint.drive.inertia if joint.drive else 0.0 for joint in found.robot.joints]
    return MotionResult(
        refusal=found.refusal,
        converged=found.fit.converged,
        bandwidth_Hz=found.bandwidth,
        noise_torque_Nm=tuple((first.moved.motion.noise * inertia).tolist()),
        blocks=len(found.fit.blocks.matrices),
        remarks=found.remarks,
        joints=tuple(i + 1 for i in first.moved.recording.with_link),
        parameters=tuple(_parameters(found)),
        recordings=tuple(_recording(one) for one in found.judged),
        lines=tuple(
            LinesResult(joint=i + 1, periods=own) for i, own in enumerate(first.moved.lines) if own
        ),
        terms=tuple(
            TermResult(
                term=own.term,
                joint=own.joint + 1,
                wind_up_rad=(_known(own.wind_up[0]), _known(own.wind_up[1])),
                torque_relative=own.torque,
            )
            for own in found.terms
        ),
    )


def _parameters(found: MotionIdentification) -> list[MotionParameterResult]:
    fit, rows = found.fit, []
    half = (fit.blocks.half * fit.blocks.deviation).tolist()
    fitted = {
        p.name: (x, h) for p, x, h in zip(fit.problem.parameters, fit.x.tolist(), half, strict=True)
    }
    for p in found.first.problem.parameters:
        value = low = high = None
        if p.name in fitted:
            x, h = fitted[p.name]
            value = _known(p.outward(x))
            low, high = map(_known, sorted((p.outward(x - h), p.outward(x + h))))
        rows.append(
            MotionParameterResult(
                name=p.name,
                term=p.term,
                unit=p.unit,
                start=p.start,
                value=value,
                low=low,
                high=high,
                identified=p.name in fitted,
            )
        )
    return rows


def _recording(one: Judged) -> RecordingResult:
    recording = one.moved.recording
    linked = recording.with_link
    return RecordingResult(
        name=recording.name,
        held_out=one.held_out,
        rows=len(recording.time),
        wind_up_rad=_all(one.wind_up),
        wind_up_without_lines_rad=_all(one.without_lines),
        torque_relative=_all(one.torque),
        slow_torque_relative=_all(one.slow_torque),
        time=tuple(recording.time.tolist()),
        measured_wind_up=_columns((recording.wind_up - recording.wind_up.mean(axis=0))[:, linked]),
        left_wind_up=_columns(one.left_wind_up[:, linked]),
        shares=tuple(
            WindUpShareResult(name=name, wind_up=_columns(own - own.mean(axis=0)))
            for name, own in _shares(one).items()
        ),
        measured_torque=_columns(recording.torque),
        left_torque=_columns(recording.torque - one.predicted.torque),
    )


def _shares(one: Judged) -> dict[str, np.ndarray]:
    """Return the causes of motor less link of joints with an encoder [rad], (n, l) each."""
    recording, linked = one.moved.recording, one.moved.recording.with_link
    shares = {name: own[:, linked] for name, own in one.predicted.shares.items()}
    lines = recording.wind_up - one.predicted.wind_up - one.left_wind_up
    if any(one.moved.lines):
        shares["lines of the encoder"] = lines[:, linked]
    return shares


def _columns(values: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(np.round(column, 9).tolist()) for column in values.T)


def _all(values: np.ndarray) -> tuple[float | None, ...]:
    return tuple(map(_known, values.tolist()))


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None
