"""What measured deflections have identified: figures in identified.json, and the robot file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coupling.identification.robot_file import fitted_text, require_written
from coupling.identification.static.measurements import rms
from coupling.identification.static.prediction import RigidPostures
from coupling.identification.static.verdicts import (
    CandidateTest,
    Identification,
    warnings,
)
from coupling.results.base import finite
from coupling.results.identified_result import (
    FurtherResult,
    IdentifiedResult,
    MeasuredRowResult,
    RmsResult,
)
from coupling.results.parameter_result import ParameterResult
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
        parameters=identification.parameters,
        further=tuple(map(_further, identification.further)),
        condition=finite(separable.condition),
        without_effect=separable.without_effect,
        unseen=separable.unseen,
        weak=separable.weak,
        alike=separable.pairs,
        common_loss=identification.loss,
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
        loops=identification.loops,
    )


def _further(test: CandidateTest) -> FurtherResult:
    """Return the test of a parameter; that of a tilt has its stiffness, not its compliance."""
    name, value, unit = test.candidate.name, test.value, "N m/rad"
    if test.candidate.axis is None:
        unit = unit_of(name)
    else:
        value = 1.0 / value if value > 0.0 else np.inf
    return FurtherResult(**dict(test.support), name=name, unit=unit, value=finite(value))


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
    parameters = [
        parameter
        for parameter in fitted.parameters
        if parameter.kind != "slip_angle" and (parameter.identified or not parameter.added)
    ]
    remarks = {p.name: _lower_bound(p) + _shape(fitted, p) for p in parameters}
    words = (
        f"Residual {1e3 * rms(fitted.residual):.4f} mm rms over all components, leave-one-out of"
        f" {'loops' if fitted.loops else 'rows'} {1e3 * rms(fitted.left_out):.4f} mm; this file"
        f" {1e3 * fitted.rms_written:.4f} mm, the start file {1e3 * fitted.rms_start:.4f} mm."
    )
    return fitted_text(start, fitted.robot, parameters, "identify", source, words, target, remarks)


def _shape(fitted: Identification, parameter: ParameterResult) -> str:
    """Return how sure the slip angles are that go with a slip torque; "" for what has none."""
    name = parameter.name.replace("hysteresis", "slip_angle")
    for other in fitted.parameters:
        if other.kind == "slip_angle" and other.name == name:
            return f"; largest slip angle: {other.remark.replace('start value kept', 'assumed')}"
    return ""


def _lower_bound(parameter: ParameterResult) -> str:
    """Return what is known of a stiffness that is not identified, in words; "" for others."""
    is_bounded = parameter.kind == "stiffness" and (parameter.low or 0.0) > 0.0
    if parameter.identified or not is_bounded:
        return ""
    return f"; 95 %: {parameter.low:.4g} or more"
