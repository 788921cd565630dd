"""What measured deflections have identified: figures in identified.json, and the robot file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coupling.errors import IdentifyError
from coupling.identification.evidence import Evidence
from coupling.identification.robot_file import FileEntry, fitted_text
from coupling.identification.separability import WeakDirection
from coupling.identification.static.found import (
    CandidateTest,
    Identification,
    IdentifiedParameter,
    rms,
    warnings,
)
from coupling.identification.static.prediction import positions
from coupling.results.base import finite
from coupling.results.identified_result import (
    AlikeResult,
    CommonLossResult,
    DirectionResult,
    EvidenceResult,
    FurtherResult,
    IdentifiedParameterResult,
    IdentifiedResult,
    LoopResult,
    MeasuredRowResult,
    RmsResult,
)
from coupling.results.run_result import three
from coupling.robot.parameters import unit_of


def figures(found: Identification) -> IdentifiedResult:
    """Return an identification's figures; SI, None for what is infinite or not known."""
    measured, fit, separable = found.measured, found.fit, found.separability
    predicted = fit.prediction.deflection
    places = positions(fit.elasticity.robot, measured)
    return IdentifiedResult(
        converged=fit.converged,
        reason=fit.reason,
        refusal=found.refusal,
        rows=measured.count,
        rms_m=RmsResult(
            measured=finite(rms(measured.deflection)),
            start=finite(found.rms_start),
            fit=finite(rms(found.residual)),
            left_out=finite(rms(found.left_out)),
            written=finite(found.rms_written),
        ),
        residual_over_deviation=finite(found.intervals.scale),
        parameters=tuple(
            _parameter(parameter, value, parameter.name in found.added)
            for parameter, value in zip(
                found.parameters, fit.elasticity.in_units(found.written).tolist(), strict=True
            )
        ),
        further=tuple(map(_further, found.further)),
        condition=finite(separable.condition),
        without_effect=separable.without_effect,
        unseen=tuple(map(_direction, separable.unseen)),
        weak=tuple(map(_direction, separable.weak)),
        alike=tuple(
            AlikeResult(names=(first, second), cosine=cosine)
            for first, second, cosine in separable.pairs
        ),
        common_loss=None
        if found.loss is None
        else CommonLossResult(
            value_m=found.loss.value, half_m=found.loss.half, probability=found.loss.probability
        ),
        warnings=tuple(warnings(found)),
        measurements=tuple(
            MeasuredRowResult(
                name=name,
                position_m=three(places[k]),
                force_N=three(measured.wrench[k, :3]),
                measured=measured.deflection[k].tolist(),
                predicted=predicted[k].tolist(),
                left_out_error=found.left_out[k].tolist(),
                weight=float(fit.weight[k] ** 2),
            )
            for k, name in enumerate(measured.names)
        ),
        worst=tuple(measured.names[k] for k in found.worst()),
        loops=tuple(
            LoopResult(
                number=loop.number,
                fit_m=finite(loop.fit),
                left_out_m=finite(loop.left_out),
                without_hysteresis_m=finite(loop.without),
            )
            for loop in found.loops
        ),
    )


def _parameter(
    parameter: IdentifiedParameter, written: float, is_added: bool
) -> IdentifiedParameterResult:
    """Return the figures of a parameter, whose written value is in its unit."""
    return IdentifiedParameterResult(
        name=parameter.name,
        unit=unit_of(parameter.name),
        start=None if is_added else finite(parameter.start),
        value=finite(parameter.value),
        low=finite(parameter.low),
        high=finite(parameter.high),
        written=finite(written),
        identified=parameter.identifiable,
        added=is_added,
        reason=parameter.reason,
        support=None if parameter.support is None else _evidence(parameter.support),
    )


def _evidence(evidence: Evidence) -> EvidenceResult:
    return EvidenceResult(
        F=finite(evidence.statistic),
        probability=finite(evidence.probability),
        left_out_change=finite(evidence.change),
        left_out_change_without_worst=finite(evidence.trimmed),
        supported=evidence.supported,
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


def identified_text(found: Identification, start: Path, target: Path, source: str) -> str:
    """Return the robot file with the identified values.

    Args:
        start: The start file.
        target: Path of the new one.
        source: Words on what was measured, for [sources].

    Raises:
        IdentifyError: If the identification refuses to be written.
        RobotFileError: If the start file cannot be read.
    """
    if found.refusal:
        raise IdentifyError(f"{target}: not written: {found.refusal}")
    written = found.fit.elasticity.in_units(found.written).tolist()
    entries = [
        FileEntry(
            parameter.name,
            value if parameter.identifiable else None,
            _remark(parameter) + _shape(found, parameter),
            parameter.name in found.added,
            (parameter.low, parameter.high),
        )
        for parameter, value in zip(found.parameters, written, strict=True)
        if parameter.parameter.kind != "slip_angle"
        and (parameter.identifiable or parameter.name not in found.added)
    ]
    left = (
        f"Residual {1e3 * rms(found.residual):.4f} mm rms over all components, leave-one-out of"
        f" {'loops' if found.loops else 'rows'} {1e3 * rms(found.left_out):.4f} mm; this file"
        f" {1e3 * found.rms_written:.4f} mm, the start file {1e3 * found.rms_start:.4f} mm."
    )
    return fitted_text(start, found.robot, entries, "identify", source, left, target)


def _shape(found: Identification, parameter: IdentifiedParameter) -> str:
    """Return how sure the slip angles are that go with a slip torque; "" for what has none."""
    own = parameter.name.replace("hysteresis", "slip_angle")
    for other in found.parameters:
        if other.parameter.kind == "slip_angle" and other.name == own:
            return f"; largest slip angle: {_remark(other).replace('start value kept', 'assumed')}"
    return ""


def _remark(parameter: IdentifiedParameter) -> str:
    bounded = parameter.parameter.kind == "stiffness" and 0.0 < parameter.low < np.inf
    if parameter.identifiable or not bounded:
        return parameter.remark
    return f"{parameter.remark}; 95 %: {parameter.low:.4g} or more"
