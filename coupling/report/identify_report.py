"""The report of an identification: arrows, residuals by pose, intervals, further parameters."""

from __future__ import annotations

from math import hypot

from coupling.report.identify_figures import (
    amplification,
    arrows,
    residuals,
)
from coupling.report.parameter_table import in_digits, parameter_table
from coupling.results.identified_result import IdentifiedResult
from coupling.results.section import Note, Section, Table

_MM = 1e3


def deflection_sections(result: IdentifiedResult) -> list[Section]:
    """Return what was identified from deflections."""
    factor = amplification(result)
    enlarged = Note(f"Deflections at each pose of the tool, enlarged {factor} times.")
    return [
        _sizes(result),
        *_loops(result),
        Section("Parameters", [_parameters(result)]),
        _separability(result),
        *_further(result),
        Section(
            "Deflections, measured and predicted",
            [enlarged],
            "arrows",
            scene=arrows(result, factor),
        ),
        Section("Residuals by pose", [_RESIDUALS], "residuals", [residuals(result)]),
    ]


def _sizes(result: IdentifiedResult) -> Section:
    words = {
        "measured": "measured deflections",
        "start": "residual of the start file",
        "fit": "residual of the fit",
        "left_out": f"leave-one-out: {'loops' if result.loops else 'rows'} predicted by a fit of all"
        " others",
        "written": "residual of the robot file as written",
    }
    rows = [(text, _size(getattr(result.rms_m, key))) for key, text in words.items()]
    worst = ", ".join(_worst(result, name) for name in result.worst)
    sizes = Table((f"{result.rows} measurements", "rms over all components [mm]"), rows)
    return Section("", [sizes, f"Largest leave-one-out errors: {worst}."])


def _loops(result: IdentifiedResult) -> list[Section]:
    """Return the errors of loading loops, and what hysteresis is worth."""
    if not result.loops:
        return []
    rows = [
        (str(loop.number), *map(_size, (loop.fit_m, loop.left_out_m, loop.without_hysteresis_m)))
        for loop in result.loops
    ]
    columns = ("loop", "fit", "leave-one-out", "leave-one-out without hysteresis")
    return [Section("Loops, rms over all components [mm]", [_LOOPS, Table(columns, rows)])]


def _worst(result: IdentifiedResult, name: str) -> str:
    (first, *_) = (row for row in result.measurements if row.name == name)
    return f"{name} ({_MM * hypot(*first.left_out_error[:3]):.4g} mm)"


def _size(length: float | None) -> str:
    return "no equilibrium" if length is None else f"{_MM * length:.4f}"


def _parameters(result: IdentifiedResult) -> Table:
    supports = [parameter.support for parameter in result.parameters]
    remarks = [support.in_words if support else "" for support in supports]
    return parameter_table(result.parameters, remarks)


def _separability(result: IdentifiedResult) -> Section:
    lines = [f"Condition number of the normalised sensitivities: {in_digits(result.condition)}."]
    lines += [f"{name}: no effect on any measurement." for name in result.without_effect]
    lines += [
        f"Not identifiable: {d.in_words} has no effect on any measurement." for d in result.unseen
    ]
    lines += [
        f"Poorly identifiable (condition index {d.index:.0f}): {d.in_words}."
        for d in result.weak
        if d.index
    ]
    lines += [
        f"Correlated: {' and '.join(pair.names)}, cosine {pair.cosine:.4f}."
        for pair in result.alike
    ]
    return Section("Identifiability", lines)


def _further(result: IdentifiedResult) -> list[Section]:
    """Return tilts and backlashes that were tested, those that the data support first."""
    if not result.further:
        return []
    tested = sorted(result.further, key=lambda f: (not f.supported, f.left_out_change or 0.0))
    rows = [
        (entry.name, f"{in_digits(entry.value)} {entry.unit}", entry.in_words) for entry in tested
    ]
    count = sum(entry.supported for entry in tested)
    table = Table(("", "fit", "tests"), rows)
    if result.loops:
        return [Section("Further parameters", [_NO_HYSTERESIS, table])]
    text = f"The data support {count} of {len(rows)}, one by one (--add NAME, or --add supported)."
    return [Section("Further parameters", [text, _FURTHER, table])]


_RESIDUALS = Note(
    "Distance of the measured point from its prediction by the fit of all rows, and by a fit of all"
    " other rows."
)
_LOOPS = Note(
    "Leave-one-out: predicted by a fit of all other loops; last column: with gears without hysteresis."
)
_NO_HYSTERESIS = "Gears whose loops show no hysteresis get no elements."
_FURTHER = Note(
    "Tilts and backlashes that the start file does not have, each added alone. Supported: a significant"
    " F test (5 % over the number of tests) and a smaller leave-one-out error."
)
