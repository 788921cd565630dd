"""The report of cutting coefficients from slots."""

from __future__ import annotations

from coupling.report.parameter_table import parameter_table
from coupling.results.identified_result import CuttingIdentified
from coupling.results.section import Note, Section, Table

_WORDS = {
    "mean": "mean",
    "once": "amplitude once a revolution",
    "passing": "amplitude of the teeth",
}
_NOTE = Note(
    "Held out: predicted by a fit of all other feeds. Intervals are Student's. A feed outside the range"
    " of the others is an extrapolation."
)


def cutting_sections(result: CuttingIdentified) -> list[Section]:
    """Return what slots said."""
    across, along, axial = result.axes
    once, passing = result.shown[:3], result.shown[3:]
    forces = [
        (
            f"{6e4 * row.feed_m_s:.0f}",
            f"{_WORDS[row.quantity]}, {row.axis}",
            f"{row.measured_N:.1f}",
            f"{row.fitted_N:.1f}",
            "" if row.held_out_N is None else f"{row.held_out_N:.1f}",
            "" if row.held_out_N is None else _error(row.held_out_N, row.measured_N, row.quantity),
        )
        for row in result.predictions
    ]
    shown = ", ".join(f"{value:.2f}" for value in (*once, *passing))
    return [
        Section(
            "",
            [
                f"Across the feed is {across}, along it {along}, axial {axial} of the table.",
                f"The dynamometer shows of amplitudes, over those of a rigid one: {shown}"
                " (once a revolution across, along, axial; teeth across, along).",
                "The edge force of the tooth that reaches furthest is"
                f" {100.0 * abs(result.edge_difference):.0f} %"
                f" {'above' if result.edge_difference >= 0.0 else 'below'} the mean of all teeth.",
                *_roundness(result),
            ],
        ),
        Section("Parameters", [parameter_table(result.parameters)]),
        Section(
            "Forces [N]",
            [
                Table(("feed [mm/min]", "force", "measured", "fit", "held out", "error"), forces),
                _NOTE,
            ],
        ),
    ]


def _roundness(result: CuttingIdentified) -> list[str]:
    """Return at which chips the edge force rises."""
    if result.roundness_m is None:
        return []
    return [
        "Half of the edge force acts where no chip is left, three quarters at a chip of"
        f" {1e6 * result.roundness_m:.0f} um."
    ]


def _error(predicted: float, measured: float, quantity: str) -> str:
    """Return the error of a prediction, of a mean in newtons, of an amplitude by itself."""
    if quantity == "mean" or measured == 0.0:
        return f"{predicted - measured:+.1f} N"
    return f"{100.0 * (predicted / measured - 1.0):+.0f} %"
