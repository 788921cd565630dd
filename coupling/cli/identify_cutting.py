"""The command line: elastic-robot identify, of cutting coefficients."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np

from coupling.cli.fitted import Findings, fitted_target
from coupling.errors import IdentifyError
from coupling.identification.cutting.results import identify_cutting, keys_text
from coupling.identification.cutting.slots import MeasuredSlots, SlotCutter
from coupling.report.cutting_report import cutting_page, cutting_summary
from coupling.report.identify_answers import cutting_answer

_OPTIONS = ("--diameter-mm", "--teeth", "--helix-deg", "--rpm", "--depth-mm")


def identify_from_cuts(
    file: Path, options: tuple[float | None, ...], output: Path | None, is_verbose: bool
) -> None:
    """Identify cutting coefficients and run-out from slots under a dynamometer.

    Args:
        file: Table of forces.
        options: Diameter [mm], teeth, helix [deg], speed [1/min] and depth [mm].
        output: File of keys to write; None for one in the folder results.
        is_verbose: Whether all that the report says is printed.
    """
    numbers = [np.nan if value is None else value for value in options]
    if missing := [name for name, value in zip(_OPTIONS, options, strict=True) if value is None]:
        raise IdentifyError(
            f"{file}: {', '.join(missing)}: expected the cutter and the cut of the slots, got none: give"
            " them"
        )
    diameter, teeth, helix, rpm, depth = numbers
    cutter = SlotCutter(1e-3 * diameter, round(teeth), float(np.deg2rad(helix)), rpm, 1e-3 * depth)
    target = fitted_target(output, f"{file.stem}_coefficients")
    slots = MeasuredSlots.read(file, cutter)
    result = identify_cutting(cutter, slots)
    answer = cutting_answer(result, shlex.quote(str(target)))
    findings = Findings(
        result,
        answer,
        (),
        cutting_summary(result),
        cutting_page(f"{file.name}: cutting coefficients", result, answer),
        lambda: keys_text(result, file.name),
    )
    findings.write(target, is_verbose)
