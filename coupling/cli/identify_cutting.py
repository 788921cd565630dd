"""The command line: elastic-robot identify, of cutting coefficients."""

from __future__ import annotations

import shlex
from functools import partial
from pathlib import Path

import numpy as np

from coupling.cli.fitted import fitted_target, write_fitted
from coupling.errors import IdentifyError
from coupling.identification.cutting.case_text import case_text
from coupling.identification.cutting.results import identify_cutting, keys_text
from coupling.identification.cutting.slots import MeasuredSlots, SlotCutter
from coupling.report.cutting_report import cutting_sections
from coupling.report.identify_answers import cutting_answer
from coupling.report.result_report import ResultReport

_OPTIONS = ("--diameter-mm", "--teeth", "--helix-deg", "--rpm", "--depth-mm")


def identify_from_cuts(
    file: Path,
    options: tuple[float | None, ...],
    case: Path | None,
    output: Path | None,
    is_verbose: bool,
) -> None:
    """Identify cutting coefficients and run-out from slots under a dynamometer.

    Args:
        options: Diameter [mm], teeth, helix [deg], speed [1/min] and depth [mm].
        case: Milling case that is written anew with what is identified; None for a file of keys alone.
        output: File to write, beside the case if that is given; None for one beside it, or in the
            folder results.
    """
    numbers = [np.nan if value is None else value for value in options]
    if missing := [name for name, value in zip(_OPTIONS, options, strict=True) if value is None]:
        raise IdentifyError(
            f"{file}: {', '.join(missing)}: expected the cutter and the cut of the slots, got none: give"
            " them"
        )
    diameter, teeth, helix, rpm, depth = numbers
    cutter = SlotCutter(1e-3 * diameter, round(teeth), float(np.deg2rad(helix)), rpm, 1e-3 * depth)
    target = fitted_target(_beside(case, output), f"{file.stem}_coefficients")
    slots = MeasuredSlots.read(file, cutter)
    result = identify_cutting(cutter, slots)
    answer = cutting_answer(result, shlex.quote(str(target)), is_case=case is not None)
    keys = keys_text(result, file.name)
    text = keys if case is None else case_text(case, cutter, result, file.name)
    report = ResultReport(
        "identify", f"{file.name}: cutting coefficients", answer, partial(cutting_sections, result)
    )
    write_fitted(target, report, result, lambda: text, is_verbose)


def _beside(case: Path | None, output: Path | None) -> Path | None:
    """Return the file to write: beside a case, whose paths are relative to it."""
    if case is None:
        return output
    target = output or case.with_name(f"{case.stem}_identified.toml")
    if target.resolve().parent != case.resolve().parent:
        raise IdentifyError(
            f"--output: expected a file in {case.resolve().parent}, from where {case.name} names its"
            f" files, got {target}"
        )
    return target
