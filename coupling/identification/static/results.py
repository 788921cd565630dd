"""What measured deflections have identified: figures in identified.json, and the robot file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coupling.errors import IdentifyError
from coupling.identification.robot_file import FileEntry, fitted_text
from coupling.identification.static.found import (
    CandidateTest,
    Identification,
    IdentifiedParameter,
    rms,
    warnings,
)
from coupling.identification.static.prediction import positions
from coupling.results.identified_result import (
    AlikeResult,
    FurtherResult,
    IdentifiedParameterResult,
    IdentifiedResult,
    MeasuredRowResult,
    RmsResult,
)
from coupling.robot.parameters import unit_of


def figures(found: Identification) -> IdentifiedResult:
    """Return an identification's figures; SI, None for what is infinite or not known."""
    measured, predicted = found.measured, found.fit.prediction.deflection
    written = found.fit.elasticity.in_units(found.written)
    places = positions(found.fit.elasticity.robot, measured)
    return IdentifiedResult.of(
        found,
        found.fit,
        found.separability,
        rms_m=RmsResult.of(
            measured=rms(measured.deflection),
            start=found.rms_start,
            fit=rms(found.residual),
            left_out=rms(found.left_out),
            written=found.rms_written,
        ),
        parameters=[
            IdentifiedParameterResult.of(
                parameter,
                start=None if parameter.name in found.added else parameter.start,
                written=value,
                added=parameter.name in found.added,
            )
            for parameter, value in zip(found.parameters, written, strict=True)
        ],
        further=[_further(own) for own in found.further],
        alike=[
            AlikeResult(names=(first, second), cosine=cosine)
            for first, second, cosine in found.separability.pairs
        ],
        warnings=warnings(found),
        measurements=[
            MeasuredRowResult.of(
                measured,
                name=name,
                position_m=places[k],
                force_N=measured.wrench[k, :3],
                measured=measured.deflection[k],
                predicted=predicted[k],
                left_out_error=found.left_out[k],
                weight=found.fit.weight[k] ** 2,
            )
            for k, name in enumerate(measured.names)
        ],
        worst=[measured.names[k] for k in found.worst()],
    )


def _further(own: CandidateTest) -> FurtherResult:
    name, value = own.candidate.name, own.value
    if own.candidate.axis is None:
        return FurtherResult.of(own.support, name=name, unit=unit_of(name), value=value)
    stiffness = 1.0 / value if value > 0.0 else np.inf
    return FurtherResult.of(own.support, name=name, unit="N m/rad", value=stiffness)


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
