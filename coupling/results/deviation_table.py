"""Tables of deviations: largest, rms, instant, and what a shift of the part removes."""

from __future__ import annotations

from collections.abc import Iterable
from math import isnan

from coupling.path.deviation import Deviation
from coupling.path.length_text import format_um
from coupling.results.section import Table


def deviation_table(rows: Iterable[tuple[str, Deviation]]) -> Table:
    """Return a table of deviations by their names."""
    return Table(
        (
            "deviation [um]",
            "max",
            "rms",
            "max across travel",
            "at t = [s]",
            "max less a constant",
            "rms less a constant",
        ),
        [
            (
                name,
                *(
                    format_um(length)
                    for length in (deviation.maximum, deviation.rms, deviation.normal_maximum)
                ),
                f"{deviation.time_of_maximum:.3f}",
                *(less_constant_um(deviation) or ("-", "-"))[:2],
            )
            for name, deviation in rows
        ],
    )


def less_constant_um(deviation: Deviation | None) -> tuple[str, ...] | None:
    """Return max and rms of a deviation less a constant [um]; None in a run of an earlier version."""
    if deviation is None or isnan(deviation.maximum_less_constant):
        return None
    return (
        format_um(deviation.maximum_less_constant),
        format_um(deviation.rms_less_constant),
        "",
    )
