"""Pictures of the page on trust."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from coupling.results.identified_result import IdentifiedResult
from docs.scripts.experiment import Curve, add_curves
from docs.scripts.pictures import styled
from docs.scripts.trust_comparison import GRADES, Against, Comparison
from docs.scripts.trust_sheet import AxialForce, Plunge

# Colours that stay apart for colour-blind eyes (Okabe and Ito).
COLOURS = {Against.PROGRAM: "#0072B2", Against.MEASUREMENT: "#D55E00", Against.ROBOT: "#009E73"}
_GREYS = ("#ffffff", "#f2f2f2", "#e4e4e4", "#d2d2d2")
# Ends of the axis, as powers of ten [%]; room for the numbers beyond the bars.
_LEAST, _MOST = -13.0, 3.0
_LINE, _OTHER = "#333333", "#777777"


def bars(comparisons: Sequence[Comparison]) -> go.Figure:
    """Draw all deviations in per cent, logarithmic, over what the words for them begin with."""
    figure = go.Figure()
    shown = [found for group in Against for found in comparisons if found.against is group]
    for group in Against:
        own = [found for found in shown if found.against is group]
        figure.add_bar(
            x=[max(found.percent, 10.0**_LEAST) for found in own],
            y=[found.what for found in own],
            base=0.0,
            orientation="h",
            name=group.value,
            marker={"color": COLOURS[group]},
            text=[found.words for found in own],
            textposition="outside",
            cliponaxis=False,
        )
    _grades(figure)
    figure.update_xaxes(
        title="deviation, % of what is compared",
        type="log",
        range=[_LEAST, _MOST],
        dtick=2,
        exponentformat="power",
        showgrid=False,
    )
    names = [found.what for found in shown]
    figure.update_yaxes(categoryorder="array", categoryarray=names[::-1], ticksuffix="  ")
    styled(figure, 1280, 150 + 26 * len(shown))
    return figure.update_layout(
        margin={"l": 330, "r": 120, "t": 90, "b": 60},
        legend={"y": 1.09, "yanchor": "bottom", "x": 0.4},
        bargap=0.3,
    )


def _grades(figure: go.Figure) -> None:
    """Shade the axis by what the page calls settled, good, rough."""
    low = _LEAST
    for colour, (word, most) in zip(_GREYS, GRADES.items(), strict=True):
        high = min(float(np.log10(most)), _MOST)
        figure.add_vrect(x0=10.0**low, x1=10.0**high, fillcolor=colour, line_width=0, layer="below")
        figure.add_annotation(
            x=0.5 * (low + high),
            y=1.0,
            yref="paper",
            yanchor="bottom",
            text=word.replace("do not ", "do not<br>"),
            font={"size": 12},
            showarrow=False,
        )
        low = high


def deflections(found: dict[str, IdentifiedResult]) -> go.Figure:
    """Draw deflections of the measured robot against those predicted without their row [mm]."""
    figure = go.Figure()
    ends = [0.0, 0.0]
    marks = zip(found.items(), (_OTHER, COLOURS[Against.MEASUREMENT]), strict=True)
    for (name, own), colour in marks:
        measured = 1e3 * own.displacements("measured").ravel()
        predicted = measured - 1e3 * own.displacements("left_out_error").ravel()
        ends = [min(ends[0], measured.min()), max(ends[1], measured.max())]
        marker = {"color": colour, "size": 7, "symbol": "circle-open", "line": {"width": 1.5}}
        figure.add_scatter(x=measured, y=predicted, mode="markers", name=name, marker=marker)
    diagonal = np.array(ends)
    add_curves(figure, [Curve("", diagonal, diagonal, _LINE, 1)])
    figure.update_xaxes(title="measured deflection, x, y, z [mm]")
    figure.update_yaxes(title="predicted from the other rows [mm]")
    return styled(figure, 560, 420)


def plate(found: Plunge) -> go.Figure:
    """Draw the force of a tool that is pushed into a plate over its depth."""
    figure = go.Figure()
    for (count, force), dash in zip(found.forces.items(), ("solid", "dash"), strict=True):
        name = f"shell, {found.side / count:.3g} mm"
        curve = Curve(name, found.depths, force, COLOURS[Against.PROGRAM], 2, dash)
        add_curves(figure, [curve])
    marker = {"color": _LINE, "size": 9, "symbol": "circle-open", "line": {"width": 2}}
    figure.add_scatter(
        x=found.depths, y=found.solid, name="CalculiX, solids", mode="markers", marker=marker
    )
    figure.update_xaxes(title="depth of a tool in a clamped plate [mm]", range=[0.0, 1.05])
    figure.update_yaxes(title="force [N]", rangemode="tozero")
    return _beside(figure, 500)


def axial_force(found: AxialForce) -> go.Figure:
    """Draw the axial force on the tool of the measured cone over time."""
    figure = go.Figure()
    lines = (
        ("measured, mean and 5 to 95 %", found.measured, _LINE, "solid"),
        ("sheet-fem", found.ours, COLOURS[Against.MEASUREMENT], "solid"),
        ("solid elements of others", found.solid, COLOURS[Against.MEASUREMENT], "dot"),
    )
    for name, force, colour, dash in lines:
        y = np.column_stack([force, force, np.full_like(force, np.nan)]).ravel()
        x = np.column_stack([found.spans, found.spans[:, 1]]).ravel()
        add_curves(figure, [Curve(name, x, y, colour, 3, dash)])
    for (start, end), (low, high) in zip(found.spans, found.spread, strict=True):
        figure.add_shape(
            x0=start, x1=end, y0=low, y1=high, fillcolor="#bbbbbb", line_width=0, layer="below"
        )
    law = np.full(2, found.law)
    add_curves(
        figure, [Curve("Aerens' law", found.spans[-1], law, COLOURS[Against.ROBOT], 2, "dash")]
    )
    figure.update_xaxes(title="time [s]", range=[0.0, 1350.0])
    figure.update_yaxes(title="axial force [N]", rangemode="tozero")
    return _beside(figure, 600)


def _beside(figure: go.Figure, width: int) -> go.Figure:
    """Return a figure of a row of them, with room for its legend."""
    styled(figure, width, 460)
    return figure.update_layout(margin={"t": 110}, legend={"y": 1.03, "yanchor": "bottom"})
