"""A milling case with the coefficients and the run-out that slots have identified."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import tomlkit

from coupling.errors import CaseError
from coupling.files.toml_file import document
from coupling.identification.cutting.fit import COEFFICIENTS
from coupling.identification.cutting.slots import SlotCutter
from coupling.results.cutting_result import CuttingIdentified

# What states a material otherwise.
_OTHER_SOURCES = ("material", "kc11_Pa", "kienzle_exponent", "radial_ratio", "axial_ratio")


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
