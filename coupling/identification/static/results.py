"""What measured deflections have identified: figures in identified.json, and the robot file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coupling.identification.evidence import Evidence
from coupling.identification.robot_file import FileEntry, fitted_text, require_written
from coupling.identification.separability import WeakDirection
from coupling.identification.static.measurements import rms
from coupling.identification.static.prediction import RigidPostures
from coupling.identification.static.verdicts import (
    CandidateTest,
    Identification,
    IdentifiedParameter,
    warnings,
)
from coupling.results.base import finite
from coupling.results.identified_result import (
    AlikeResult,
    CommonLossResult,
    DirectionResult,
    FurtherResult,
    IdentifiedResult,
    LoopResult,
    MeasuredRowResult,
    RmsResult,
)
from coupling.results.parameter_result import EvidenceResult
from coupling.results.run_result import three
from coupling.robot.parameters import unit_of


def figures(identification: Identification) -> IdentifiedResult:
    """Return an identification's figures; SI, None for what is infinite or not known."""
    measured, fit, separable = (
        identification.measured,
        identification.fit,
        identification.fit.separability,
    )
    predicted = fit.at.prediction.deflection
    places = RigidPostures.of(fit.elasticity.robot, measured).point
    return IdentifiedResult(
        converged=fit.converged,
        reason=fit.reason,
        refusal=identification.refusal,
        rows=measured.count,
        rms_m=RmsResult(
            measured=finite(rms(measured.deflection)),
            start=finite(identification.rms_start),
            fit=finite(rms(identification.residual)),
            left_out=finite(rms(identification.left_out)),
            written=finite(identification.rms_written),
        ),
        residual_over_deviation=finite(identification.intervals.scale),
        parameters=tuple(
            parameter.result(
                value,
                is_added=parameter.name in identification.added,
                support=None if parameter.support is None else _evidence(parameter.support),
            )
            for parameter, value in zip(
                identification.parameters,
                fit.elasticity.in_units(identification.written).tolist(),
                strict=True,
            )
        ),
        further=tuple(map(_further, identification.further)),
        condition=finite(separable.condition),
        without_effect=separable.without_effect,
        unseen=tuple(map(_direction, separable.unseen)),
        weak=tuple(map(_direction, separable.weak)),
        alike=tuple(
            AlikeResult(names=(first, second), cosine=cosine)
            for first, second, cosine in separable.pairs
        ),
        common_loss=None
        if identification.loss is None
        else CommonLossResult(
            value_m=identification.loss.value,
            half_m=identification.loss.half,
            probability=identification.loss.probability,
        ),
        warnings=tuple(warnings(identification)),
        measurements=tuple(
            MeasuredRowResult(
                name=name,
                position_m=three(places[k]),
                force_N=three(measured.wrench[k, :3]),
                measured=measured.deflection[k].tolist(),
                predicted=predicted[k].tolist(),
                left_out_error=identification.left_out[k].tolist(),
                weight=float(fit.at.weight[k] ** 2),
            )
            for k, name in enumerate(measured.names)
        ),
        worst=tuple(measured.names[k] for k in identification.worst()),
        loops=tuple(
            LoopResult(
                number=loop.number,
                fit_m=finite(loop.fit),
                left_out_m=finite(loop.left_out),
                without_hysteresis_m=finite(loop.without),
            )
            for loop in identification.loops
        ),
    )


def _evidence(evidence: Evidence) -> EvidenceResult:
    return EvidenceResult(
        F=finite(evidence.statistic),
        probability=finite(evidence.probability),
        left_out_change=finite(evidence.change),
        left_out_change_without_worst=finite(evidence.trimmed),
        supported=evidence.is_supported,
        in_words=evidence.in_words(),
    )


def _direction(direction: WeakDirection) -> DirectionResult:
    return DirectionResult(
        names=direction.names,
        parts=direction.parts,
        index=finite(direction.index),
        in_words=direction.in_words(),
    )


def _further(test: CandidateTest) -> FurtherResult:
    """Return the test of a parameter; that of a tilt has its stiffness, not its compliance."""
    name, value, unit = test.candidate.name, test.value, "N m/rad"
    if test.candidate.axis is None:
        unit = unit_of(name)
    else:
        value = 1.0 / value if value > 0.0 else np.inf
    return FurtherResult(**dict(_evidence(test.support)), name=name, unit=unit, value=finite(value))


def identified_text(fitted: Identification, start: Path, target: Path, source: str) -> str:
    """Return the robot file with the identified values.

    Args:
        start: The start file.
        target: Path of the new one.
        source: Words on what was measured, for [sources].

    Raises:
        IdentifyError: If the fitted refuses to be written.
        RobotFileError: If the start file cannot be read.
    """
    require_written(fitted.refusal, target)
    written = fitted.fit.elasticity.in_units(fitted.written).tolist()
    entries = [
        FileEntry(
            parameter.name,
            value if parameter.identifiable else None,
            _remark(parameter) + _shape(fitted, parameter),
            parameter.name in fitted.added,
            (parameter.low, parameter.high),
        )
        for parameter, value in zip(fitted.parameters, written, strict=True)
        if parameter.parameter.kind != "slip_angle"
        and (parameter.identifiable or parameter.name not in fitted.added)
    ]
    words = (
        f"Residual {1e3 * rms(fitted.residual):.4f} mm rms over all components, leave-one-out of"
        f" {'loops' if fitted.loops else 'rows'} {1e3 * rms(fitted.left_out):.4f} mm; this file"
        f" {1e3 * fitted.rms_written:.4f} mm, the start file {1e3 * fitted.rms_start:.4f} mm."
    )
    return fitted_text(start, fitted.robot, entries, "identify", source, words, target)


def _shape(fitted: Identification, parameter: IdentifiedParameter) -> str:
    """Return how sure the slip angles are that go with a slip torque; "" for what has none."""
    name = parameter.name.replace("hysteresis", "slip_angle")
    for other in fitted.parameters:
        if other.parameter.kind == "slip_angle" and other.name == name:
            return f"; largest slip angle: {_remark(other).replace('start value kept', 'assumed')}"
    return ""


def _remark(parameter: IdentifiedParameter) -> str:
    bounded = parameter.parameter.kind == "stiffness" and 0.0 < parameter.low < np.inf
    if parameter.identifiable or not bounded:
        return parameter.remark
    return f"{parameter.remark}; 95 %: {parameter.low:.4g} or more"
