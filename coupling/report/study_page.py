"""The report of a study: bands along the path, distribution, what matters."""

from __future__ import annotations

import html
from math import isnan
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from coupling.errors import StudyError
from coupling.files.whole_file import write_whole
from coupling.report.colours import AFTER, BEFORE, DESIRED
from coupling.report.document import document
from coupling.report.style import style
from coupling.report.tables import table
from coupling.results.study_result import StudyResult
from coupling.study.bench import PARTS
from coupling.study.folder import REPORT, RUN
from coupling.study.stored_study import StoredStudy, read_study

_UM = 1e6
_BAND = "rgba(0, 114, 178, 0.22)"
# Parameters that are drawn against the deviation, the most important ones.
_DRAWN = 6


def write_study_report(folder: Path, file: Path | None = None) -> Path:
    """Write the report of a finished study.

    Args:
        folder: The study.
        file: File to write; report.html in the folder unless given.

    Returns:
        The file.

    Raises:
        StudyError: If the study cannot be read or the report not written.
    """
    target = file or folder / REPORT
    page = study_page(read_study(folder), (folder / RUN / REPORT).exists())
    write_whole(target, page, StudyError)
    return target


def study_page(study: StoredStudy, with_run: bool) -> str:
    """Return the page of a study as one self-contained HTML text.

    Args:
        study: The study.
        with_run: Whether the report of its run is beside it.
    """
    figures = study.figures
    sections = [
        ("Deviation along the path", "bands", bands(study), _bands_text(figures)),
        ("Largest deviation", "distribution", distribution(study), _DISTRIBUTION_TEXT),
    ]
    if figures.ordered:
        sections.append(("What matters", "influence", influence(study), _influence_text(figures)))
        sections.append(("Deviation by parameter", "scatter", scatter(study), _SCATTER_TEXT))
    link = f'<p><a href="{RUN}/{REPORT}">The run of the command</a></p>' if with_run else ""
    title = f"{figures.case}: study"
    head = f"{_verdict(figures)}{_quantiles(figures)}{_parameters(figures)}{link}"
    return document(title, head, sections)


def bands(study: StoredStudy) -> go.Figure:
    """Quantiles of the deviation along the path."""
    figure, time, share = go.Figure(), study.time, study.figures.coverage
    low, median, high, everywhere = (
        _UM * study.band[name] for name in ("low", "median", "high", "everywhere")
    )
    figure.add_scatter(x=time, y=low, line={"width": 0}, showlegend=False, hoverinfo="skip")
    figure.add_scatter(
        x=time,
        y=high,
        fill="tonexty",
        fillcolor=_BAND,
        line={"width": 0},
        name=f"{100 * share:g} % of robots, at each place",
    )
    figure.add_scatter(x=time, y=median, name="median", line={"color": AFTER})
    figure.add_scatter(
        x=time,
        y=everywhere,
        name=f"{100 * share:g} % of robots stay below, everywhere at once",
        line={"color": BEFORE, "dash": "dot", "width": 1.5},
    )
    figure.update_xaxes(title="time [s]")
    figure.update_yaxes(title="distance [um]", rangemode="tozero")
    return style(figure, 440)


def distribution(study: StoredStudy) -> go.Figure:
    """Share of robots whose largest deviation stays below a limit."""
    figure = go.Figure()
    for name, words, color in (("maximum", "max", AFTER), ("rms", "rms", DESIRED)):
        values = np.sort(_UM * study.measures[name])
        shares = np.arange(1, len(values) + 1) / (len(values) + 1)
        line = {"color": color, "shape": "hv"}
        figure.add_scatter(x=values, y=100.0 * shares, name=words, line=line)
    share = study.figures.coverage
    figure.add_hline(y=100.0 * share, line={"color": DESIRED, "dash": "dash", "width": 1})
    figure.update_xaxes(title="deviation [um]", rangemode="tozero")
    figure.update_yaxes(title="robots below [%]", range=[0, 100])
    return style(figure)


def influence(study: StoredStudy) -> go.Figure:
    """Share of each parameter in the variance of the deviation."""
    figure = go.Figure()
    entries = study.figures.ordered[::-1]
    for name, words, color in (("rms", "rms", DESIRED), ("maximum", "max", AFTER)):
        figure.add_bar(
            y=[entry.name for entry, _ in entries],
            x=[100.0 * shares[name].share for _, shares in entries],
            orientation="h",
            name=words,
            marker={"color": color},
        )
    figure.update_xaxes(title="share of the variance [%]", range=[0, 100])
    figure.update_layout(legend_traceorder="reversed", barmode="group")
    style(figure, 170 + 46 * len(entries)).update_layout(margin_l=10)
    figure.update_yaxes(automargin=True)
    return figure


def scatter(study: StoredStudy, most: int = _DRAWN) -> go.Figure:
    """Largest deviation of every sample over the parameters that matter most, so many at most."""
    shown = [entry.name for entry, _ in study.figures.ordered[:most]]
    columns = min(len(shown), 2)
    rows = -(-len(shown) // columns)
    figure = make_subplots(rows, columns, shared_yaxes=True, vertical_spacing=0.28 / rows)
    values = _UM * study.measures["maximum"]
    for k, name in enumerate(shown):
        place = {"row": k // columns + 1, "col": k % columns + 1}
        figure.add_scatter(
            x=study.points[:, study.names.index(name)],
            y=values,
            mode="markers",
            marker={"size": 5, "color": AFTER, "opacity": 0.6},
            name=name,
            showlegend=False,
            **place,
        )
        figure.update_xaxes(title=name, nticks=4, **place)
        if place["col"] == 1:
            figure.update_yaxes(title="max [um]", rangemode="tozero", **place)
    return style(figure, 90 + 250 * rows)


def _verdict(figures: StudyResult) -> str:
    command, share = figures.command, figures.coverage
    limit = figures.quantile("maximum", share)
    state = "yes" if command.converged else "no"
    text = f"<b>{100 * share:g} % of further robots stay below {_UM * limit:.1f} um</b>"
    text += " along the whole path."
    if not command.converged:
        text += f" <b>The command is not converged</b>: {html.escape(command.reason)}"
    if figures.failed:
        number, reason = next(iter(figures.failed.items()))
        text += (
            f" {len(figures.failed)} of {figures.samples} robots could not be simulated and are"
            f" left out, such as number {number}: {html.escape(reason)}."
        )
    if figures.not_coupled:
        text += f" {len(figures.not_coupled)} robots did not converge with their process."
    return f'<p class="verdict {state}">{text}</p>'


def _quantiles(figures: StudyResult) -> str:
    found = figures.quantiles_m
    shares = list(found["maximum"])
    model = figures.command.deviation_m
    names = (
        ("maximum", "max"),
        ("rms", "rms"),
        ("normal_maximum", "max across travel"),
        ("maximum_less_constant", "max less a constant"),
        ("rms_less_constant", "rms less a constant"),
    )
    rows = [
        (
            words,
            # Its run may be an earlier version's.
            "-" if isnan(getattr(model, name)) else f"{_UM * getattr(model, name):.2f}",
            *(f"{_UM * found[name][share]:.2f}" for share in shares),
        )
        for name, words in names
    ]
    below = (f"{100 * float(share):g} % of robots below" for share in shares)
    header = ("deviation [um]", "model", *below)
    how = (
        f"the process evaluated for each of them, {figures.process_evaluations} times in all"
        if figures.wrench == "coupled"
        else "the wrench that of the process on the model, times the factor of the force"
    )
    return (
        f"<p>{figures.samples} robots sampled from what is uncertain run the command as written,"
        f" with inertia; {how}.</p>{table(header, rows)}"
    )


def _parameters(figures: StudyResult) -> str:
    rows = []
    for entry in figures.parameters:
        found = entry.influence.maximum
        told = (
            ("", "")
            if found is None
            else (f"{100 * found.share:.0f} %", f"{found.rank_correlation:+.2f}")
        )
        rows.append((html.escape(entry.name), html.escape(entry.distribution), *told))
    header = ("uncertain", "distribution", "share in the variance of max", "rank correlation")
    silent = figures.silent
    left = f"<p>Without effect here, left out: {', '.join(silent)}.</p>" if silent else ""
    few = "" if figures.ordered else "<p>Too few samples to tell which parameter matters.</p>"
    return f"<h2>What is uncertain</h2>{table(header, rows)}{left}{few}"


_DISTRIBUTION_TEXT = (
    "Share of robots whose deviation, the largest along the path or its rms, stays below a limit."
)
_SCATTER_TEXT = "A dot is a sampled robot; of several parameters the most important ones."


def _bands_text(figures: StudyResult) -> str:
    share = figures.coverage
    return (
        f"At each place by itself, {100 * share:g} % of further robots lie in the band and"
        f" {50 * (1 - share):.3g} % on each side of it, in the mean over studies. Below the dotted"
        f" line {100 * share:g} % of robots stay all along the path. A place is one of {PARTS} equal"
        " parts of the time, with the largest deviation in it."
    )


def _influence_text(figures: StudyResult) -> str:
    maximum, rms = (
        100.0 * max(1.0 - sum(shares[name].share for _, shares in figures.ordered), 0.0)
        for name in ("maximum", "rms")
    )
    return (
        "First-order Sobol indices: the share of the variance that goes back to a parameter by itself."
        f" The rest, {maximum:.0f} % of max and {rms:.0f} % of rms, is of several"
        " together."
    )
