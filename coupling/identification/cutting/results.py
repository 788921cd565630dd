"""From slots to figures: the fit, and each feed predicted by a fit of the others."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal, get_args

import numpy as np
import tomlkit

from coupling.errors import CaseError
from coupling.files.toml_file import document
from coupling.identification.cutting.fit import COEFFICIENTS, fitted_slots
from coupling.identification.cutting.slots import MeasuredSlots, SlotCutter
from coupling.identification.evidence import poor_prediction, predict_left_out
from coupling.results.identified_result import (
    CuttingIdentified,
    SlotPrediction,
)
from coupling.results.parameter_result import ParameterResult

Quantity = Literal["mean", "once", "passing"]
Axis = Literal["across", "along", "axial"]
_UNITS = ("Pa",) * 3 + ("N/m",) * 3 + ("m",)
# Fewer feeds than these leave none to hold out.
_HELD_OUT = 4
# What states a material otherwise.
_OTHER_SOURCES = ("material", "kc11_Pa", "kienzle_exponent", "radial_ratio", "axial_ratio")


def identify_cutting(cutter: SlotCutter, slots: MeasuredSlots) -> CuttingIdentified:
    """Return the figures of an identification from slots.

    Raises:
        IdentifyError: If they say nothing.
    """
    fit = fitted_slots(cutter, slots)
    count = len(slots.feed)

    def predict(fitted: list[int], row: int) -> MeasuredSlots:
        return fitted_slots(cutter, slots.only(fitted)).predicted(cutter, slots.feed[[row]])

    fitted_forces = fit.predicted(cutter, slots.feed)
    held_out = predict_left_out(count, predict) if count >= _HELD_OUT else []
    predictions = [
        SlotPrediction(
            feed_m_s=float(slots.feed[row]),
            quantity=quantity,
            axis=axis,
            measured_N=_force(slots, quantity, row, number),
            fitted_N=_force(fitted_forces, quantity, row, number),
            held_out_N=_force(held_out[row], quantity, 0, number) if held_out else None,
        )
        for row in range(count)
        for quantity in get_args(Quantity)
        for number, axis in enumerate(get_args(Axis))
        if (quantity, axis) != ("passing", "axial")
    ]
    values = [*fit.values.tolist(), fit.run_out]
    halves = [*fit.half.tolist(), fit.run_out_half]
    return CuttingIdentified(
        axes=slots.axes,
        parameters=tuple(
            ParameterResult.judged(
                name, unit, None, value, (max(value - half, 0.0), value + half), ""
            )
            for name, unit, value, half in zip(
                (*COEFFICIENTS, "runout_m"), _UNITS, values, halves, strict=True
            )
        ),
        shown=tuple(fit.shown.tolist()),
        edge_difference=fit.edge_difference,
        roundness_m=fit.roundness,
        predictions=tuple(predictions),
        refusal=_refusal(predictions),
    )


def _force(slots: MeasuredSlots, quantity: Quantity, row: int, axis: int) -> float:
    forces: np.ndarray = getattr(slots, quantity)
    return float(forces[row, axis])


def keys_text(result: CuttingIdentified, source: str) -> str:
    """Return the coefficients and the run-out as keys of [process], with where they are from."""
    lines = [f"# Keys of [process], identified from {source}, 95 % intervals behind them."]
    lines += [
        f"{row.name:8s} = {row.value:.4g}    # {row.low:.3g} to {row.high:.3g}"
        for row in result.parameters
    ]
    return "\n".join([*lines, "runout_deg = 0.0    # towards a tooth"]) + "\n"


def _refusal(predictions: Sequence[SlotPrediction]) -> str:
    """Return why no keys should be written, in words; "" where they may be."""
    means = [
        (abs(row.held_out_N - row.measured_N), abs(row.measured_N))
        for row in predictions
        if row.quantity == "mean" and row.held_out_N is not None
    ]
    if not means:
        return ""
    errors, sizes = np.transpose(means)
    words = poor_prediction("mean forces", "other feeds", errors, sizes, "N")
    advice = "check columns, feeds, depth, teeth and speed, and that every row is a full slot"
    return words and f"{words}: {advice}"


def case_text(case: Path, cutter: SlotCutter, result: CuttingIdentified, source: str) -> str:
    """Return a case file with identified keys in [process]; its comments and its order stay.

    Args:
        case: The case file.
        cutter: Cutter of the slots, which must be that of the case.
        result: Figures of the identification.
        source: Name of the measurement.

    Raises:
        CaseError: If the file cannot be read, mills nothing, or with another cutter.
    """
    content = document(case, CaseError)
    process = content.get("process", {})
    if process.get("model") != "milling-force":
        raise CaseError(
            f"{case}: process.model: expected 'milling-force', got {process.get('model')!r}: give the"
            " case of a milling process"
        )
    for key, value in (
        ("cutter_diameter_m", cutter.diameter),
        ("teeth", cutter.teeth),
        ("helix_deg", float(np.rad2deg(cutter.helix))),
    ):
        stated = process.get(key)
        if not isinstance(stated, (int, float)) or not np.isclose(stated, value, rtol=1e-3):
            raise CaseError(
                f"{case}: process.{key}: expected {value:g}, as of the slots, got {stated}: cutting"
                " coefficients and run-out are those of one cutter in its holder"
            )
    for key in _OTHER_SOURCES:
        process.pop(key, None)
    for row in result.parameters:
        assert row.value is not None
        process[row.name] = float(f"{row.value:.4g}")
        process[row.name].comment(f"identified, {source}, 95 %: {row.low:.3g} to {row.high:.3g}")
        if row.name not in COEFFICIENTS:
            process["runout_deg"] = 0.0  # towards a tooth, as it is identified
    return tomlkit.dumps(content)
