"""What an identification found, as plain data: identified.json, and what its report is drawn from."""

from __future__ import annotations

from typing import Any

import numpy as np

from coupling.identify.found import CandidateTest, Identification, rms
from coupling.identify.prediction import positions
from coupling.identify.separable import WeakDirection
from coupling.identify.support import Evidence
from coupling.identify.warnings import warnings


def figures(found: Identification) -> dict[str, Any]:
    """Return an identification's figures; SI, None for what is infinite or not known."""
    measured, telling, loss = found.measured, found.separability, found.loss
    written = found.fit.elasticity.in_units(found.written)
    places = positions(found.fit.elasticity.robot, measured)
    return {
        "converged": found.fit.converged,
        "reason": found.fit.reason,
        "refusal": found.refusal,
        "rows": measured.count,
        "rms_m": {
            "measured": _number(rms(measured.deflection)),
            "start": _number(found.rms_start),
            "fit": _number(rms(found.residual)),
            "left_out": _number(rms(found.left_out)),
            "written": _number(found.rms_written),
        },
        "residual_over_deviation": _number(found.intervals.scale),
        "parameters": [
            {
                "name": parameter.name,
                "unit": "rad" if parameter.is_backlash else "N m/rad",
                "start": None if parameter.name in found.added else _number(parameter.start),
                "value": _number(parameter.value),
                "low": _number(parameter.low),
                "high": _number(parameter.high),
                "written": _number(float(written[j])),
                "identified": parameter.identifiable,
                "added": parameter.name in found.added,
                "reason": parameter.reason,
                "support": None if parameter.support is None else _support(parameter.support),
            }
            for j, parameter in enumerate(found.parameters)
        ],
        "further": [_further(further) for further in found.further],
        "condition": _number(telling.condition),
        "without_effect": list(telling.silent),
        "unseen": [_direction(direction) for direction in telling.unseen],
        "weak": [_direction(direction) for direction in telling.weak],
        "alike": [
            {"names": [first, second], "cosine": cosine} for first, second, cosine in telling.pairs
        ],
        "common_loss": None
        if loss is None
        else {"value_m": loss.value, "half_m": loss.half, "probability": loss.probability},
        "warnings": warnings(found),
        "measurements": [
            {
                "name": measured.names[k],
                "position_m": places[k].tolist(),
                "force_N": measured.wrench[k, :3].tolist(),
                "measured": measured.deflection[k].tolist(),
                "predicted": found.fit.prediction.deflection[k].tolist(),
                "left_out_error": found.left_out[k].tolist(),
                "weight": float(found.fit.weight[k] ** 2),
            }
            for k in range(measured.count)
        ],
        "worst": [measured.names[k] for k in found.worst()],
    }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _support(tested: Evidence) -> dict[str, Any]:
    return {
        "F": _number(tested.statistic),
        "probability": _number(tested.probability),
        "left_out_change": _number(tested.change),
        "left_out_change_without_worst": _number(tested.trimmed),
        "supported": tested.supported,
        "in_words": tested.in_words(),
    }


def _further(further: CandidateTest) -> dict[str, Any]:
    if further.candidate.axis is None:
        unit, value = "rad", further.value
    else:
        unit, value = "N m/rad", 1.0 / further.value if further.value > 0.0 else np.inf
    return {
        "name": further.candidate.name,
        "unit": unit,
        "value": _number(value),
        **_support(further.support),
    }


def _direction(direction: WeakDirection) -> dict[str, Any]:
    return {
        "names": list(direction.names),
        "parts": list(direction.parts),
        "index": _number(direction.index),
        "in_words": direction.in_words(),
    }
