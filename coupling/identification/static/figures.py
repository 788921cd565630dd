"""What an identification found: identified.json, and what its report is drawn from."""

from __future__ import annotations

import numpy as np

from coupling.identification.static.found import CandidateTest, Identification, rms
from coupling.identification.static.prediction import positions
from coupling.identification.static.warnings import warnings
from coupling.results.identified_result import (
    AlikeResult,
    FurtherResult,
    IdentifiedParameterResult,
    IdentifiedResult,
    MeasuredRowResult,
    RmsResult,
)

_UNITS = {"stiffness": "N m/rad", "backlash": "rad", "hysteresis": "N m", "slip_angle": "rad"}


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
                own,
                unit=_UNITS[own.parameter.kind],
                start=None if own.name in found.added else own.start,
                written=value,
                identified=own.identifiable,
                added=own.name in found.added,
            )
            for own, value in zip(found.parameters, written, strict=True)
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
    unit, value = _UNITS.get(own.candidate.name.rpartition(".")[2], "rad"), own.value
    if own.candidate.axis is not None:
        unit, value = "N m/rad", 1.0 / own.value if own.value > 0.0 else np.inf
    return FurtherResult.of(own.support, name=own.candidate.name, unit=unit, value=value)
