"""The report of a study: bands along the path, distribution, significant parameters."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from coupling.files.written_files import REPORT
from coupling.path.length_text import in_unit, in_words, length_unit
from coupling.report.bars import bars
from coupling.report.colours import AFTER, BEFORE, DESIRED
from coupling.report.expected import expected_sentence, expected_words
from coupling.report.lengths import judged, state_tolerance
from coupling.report.result_report import ResultReport
from coupling.report.style import Keys, drawn, rule, style
from coupling.results.outlook import EXPECTED_SHARE
from coupling.results.section import Answer, KeyFigure, NextStep, Note, Section, Table
from coupling.results.study_result import StudyResult
from coupling.robot.parameter_table import VARIED
from coupling.study.findings import StoredStudy
from coupling.study.folder import RUN
from coupling.study.robot_pool import PARTS

# Names of varied parameters in sentences, by their keys in [study].
_VARIED = {variation.key: variation.in_words for _, variation in VARIED.values()}
_BAND = "rgba(0, 114, 178, 0.22)"
_AS_USUAL = " and usual values of what their files leave out"
# Parameters that are drawn against the deviation, the most important ones.
_DRAWN = 6


def study_report(study: StoredStudy) -> ResultReport:
    """Return what is told of a study."""
    figures = study.figures
    return ResultReport(
        "study",
        figures.case,
        study_answer(study),
        partial(_sections, study),
    )


def _sections(study: StoredStudy) -> list[Section]:
    figures, run_page = study.figures, f"{RUN}/{REPORT}"
    link = [Note("The run of the command", run_page)] if (study.folder / run_page).exists() else []
    sections = [
        _verdict(figures),
        _quantiles(figures),
        _parameters(figures),
        Section("", link),
        Section("Deviation along the path", (_bands_note(figures),), "bands", (bands(study),)),
        Section("Largest deviation", (_DISTRIBUTION,), "distribution", (distribution(study),)),
    ]
    if figures.ordered:
        sections += [
            Section("Deviation by parameter", (_SCATTER,), "scatter", (scatter(study),)),
        ]
    return sections


def study_answer(study: StoredStudy) -> Answer:
    """Return the first screen of a study."""
    figures, source, tolerance = study.figures, study.figures.source, study.figures.tolerance_m
    most, expected = figures.quantile("maximum", EXPECTED_SHARE), figures.expected
    share = f"{100 * EXPECTED_SHARE:g} %"
    good = None if tolerance is None or expected is None else expected.fits(tolerance)
    reasons = []
    if figures.chosen:
        if tolerance is not None and most > tolerance:
            good = False
        names = " and ".join(
            dict.fromkeys(parameter_words(entry.name.split("[")[0]) for entry in figures.parameters)
        )
        sentence = judged(
            f"of the robots that differ in {names} alone, as [study] chooses it, {share} stay within"
            f" {in_words(most)} of the path",
            good,
            tolerance,
        )
        if expected is not None:
            reasons.append(f"On the real robot expect {expected_words(expected)}.")
    elif expected is not None:
        sentence = expected_sentence(expected, tolerance)
        reasons.append(
            f"{share} of {figures.samples} robots to expect stay within {in_words(most)}."
        )
        few, least = min(figures.quantiles_m["maximum"].items(), key=lambda item: float(item[0]))
        if least > 0.5 * most:
            reasons.append(
                f"All but {100 * float(few):g} % leave more than {in_words(least)}: most of it is common"
                " to them, from usual values of what the robot file does not state."
            )
    else:
        sentence = judged(f"{share} of the robots stay within {in_words(most)}", good, tolerance)
    if not figures.command.converged:
        good = False
        sentence = (
            "NOT FINISHED: the command of this study keeps its path on no robot: do not send it."
        )
    elif figures.failed:
        good = False
        sentence = (
            f"NOT GOOD ENOUGH: {len(figures.failed)} of {figures.samples} robots cannot"
            f" follow the command at all; {share} of the others stay within"
            f" {in_words(most)}."
        )
    if figures.ordered:
        worst, shares = figures.ordered[0]
        reasons.append(
            f"The largest part of the scatter, {100 * shares['maximum'].share:.0f} %, comes from the"
            f" {parameter_words(worst.name)} alone."
        )
    if figures.chosen:
        reasons.append("What the robot file leaves out is not in it.")
    third = KeyFigure("Robots", f"{figures.samples}", f"{len(figures.failed)} cannot be simulated")
    if tolerance is not None:
        within = 100.0 * np.sum(study.measures["maximum"] <= tolerance) / figures.samples
        third = KeyFigure(
            "Keep your tolerance",
            f"{within:.0f} %",
            f"of {figures.samples} robots",
        )
    steps = [] if tolerance is not None else [state_tolerance(source.case)]
    if not figures.command.converged:
        purpose = "See whether robot and path fit each other:"
        steps = [NextStep.by(purpose, "check", source.case)]
    elif good:
        steps.append(
            NextStep.export("Write the robot program:", source.run, Path(source.robot).name)
        )
    else:
        plan = ("identify", "--plan", "--robot", source.robot, "-o", "plan.csv")
        steps.append(NextStep.by("Measure the robot; this plans it:", *plan))
        steps.append(NextStep.by("Or place the part where it matters less:", "place", source.case))
    return Answer(
        sentence=sentence,
        reason=" ".join(reasons),
        good=good,
        figures=(
            KeyFigure(f"{share} of robots", in_words(most), "largest deviation, at most"),
            KeyFigure(
                "If the file is right",
                in_words(figures.command.deviation_m.maximum),
                "on a robot exactly as its file says",
            ),
            third,
        ),
        steps=steps,
        picture=bars(
            [
                ("if the file is right", figures.command.deviation_m.maximum),
                *(
                    (f"{100 * float(part):g} % of robots", length)
                    for part, length in figures.quantiles_m["maximum"].items()
                ),
            ],
            tolerance,
        ),
    )


def parameter_words(name: str) -> str:
    """Return what an uncertain parameter is called in sentences.

    Args:
        name: Its name in a study: a key, with a joint's number, and after the name of a robot of two.

    Example:
        >>> parameter_words("stiffness_factor[2]"), parameter_words("support backlash_factor[1]")
        ('stiffness of joint 2', 'backlash of joint 1 of the support robot')
        >>> parameter_words("force_factor"), parameter_words("payload_kg")
        ('force', 'payload')
    """
    robot, _, key = name.rpartition(" ")
    key, _, joint = key.partition("[")
    words = _VARIED.get(key, key.rpartition("_")[0].replace("_", " "))
    words += f" of joint {joint.rstrip(']')}" if joint else ""
    return f"{words} of the {robot} robot" if robot else words


def _with_unit(name: str) -> str:
    """Return what an uncertain parameter is called, with its unit."""
    unit = name.partition("[")[0].rpartition("_")[2]
    words = parameter_words(name)
    return f"{words}, times the model's" if unit == "factor" else f"{words} [{unit}]"


def bands(study: StoredStudy) -> go.Figure:
    """Quantiles of the deviation along the path."""
    time, share = study.time, study.figures.coverage
    lines = [study.band[name] for name in ("low", "median", "high", "everywhere")]
    factor, unit = length_unit(*(float(line.max()) for line in lines))
    low, median, high, everywhere = (factor * line for line in lines)
    band = {
        "fill": "tonexty",
        "fillcolor": _BAND,
        "line": {"width": 0},
        "name": f"{100 * share:g} % of robots, at each place",
    }
    together = {
        "name": f"{100 * share:g} % of robots stay below, everywhere at once",
        "line": {"color": BEFORE, "dash": "dot", "width": 1.5},
    }
    traces: list[Keys] = [
        {"x": time, "y": low, "line": {"width": 0}, "showlegend": False, "hoverinfo": "skip"},
        {"x": time, "y": high, **band},
        {"x": time, "y": median, "name": "median", "line": {"color": AFTER}},
        {"x": time, "y": everywhere, **together},
    ]
    up = {"title": f"distance [{unit}]", "rangemode": "tozero"}
    return drawn(traces, 440, xaxis={"title": "time [s]"}, yaxis=up)


def distribution(study: StoredStudy) -> go.Figure:
    """Share of robots whose largest deviation stays below a limit."""
    traces = []
    factor, unit = length_unit(float(study.measures["maximum"].max()))
    for name, words, color in (("maximum", "max", AFTER), ("rms", "rms", DESIRED)):
        values = np.sort(factor * study.measures[name])
        shares = np.arange(1, len(values) + 1) / (len(values) + 1)
        line = {"color": color, "shape": "hv"}
        traces.append({"x": values, "y": 100.0 * shares, "name": words, "line": line})
    level = rule("y", 100.0 * study.figures.coverage, color=DESIRED, dash="dash", width=1)
    across = {"title": f"deviation [{unit}]", "rangemode": "tozero"}
    up = {"title": "robots below [%]", "range": [0, 100]}
    return drawn(traces, xaxis=across, yaxis=up, shapes=[level])


def scatter(study: StoredStudy, most: int = _DRAWN) -> go.Figure:
    """Largest deviation of every sample over the parameters that matter most, so many at most."""
    shown = [entry.name for entry, _ in study.figures.ordered[:most]]
    columns = min(len(shown), 2)
    rows = -(-len(shown) // columns)
    figure = make_subplots(rows, columns, shared_yaxes=True, vertical_spacing=0.28 / rows)
    factor, unit = length_unit(float(study.measures["maximum"].max()))
    values = factor * study.measures["maximum"]
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
        figure.update_xaxes(title=_with_unit(name), nticks=4, **place)
        if place["col"] == 1:
            figure.update_yaxes(title=f"max [{unit}]", rangemode="tozero", **place)
    return style(figure, 90 + 250 * rows)


def _verdict(figures: StudyResult) -> Section:
    command = figures.command
    text = [] if command.converged else [f"The command is NOT CONVERGED: {command.reason}."]
    if figures.failed:
        number, reason = next(iter(figures.failed.items()))
        text.append(
            f"Warning: {len(figures.failed)} of {figures.samples} robots could not be simulated and are"
            f" omitted, for example number {number}: {reason}"
        )
    if figures.not_coupled:
        text.append(
            f"Warning: {len(figures.not_coupled)} robots did not converge with their process."
        )
    return Section("", text, good=command.converged if text else None)


def _quantiles(figures: StudyResult) -> Section:
    quantiles = figures.quantiles_m
    shares = list(quantiles["maximum"])
    model = figures.command.deviation_m
    _, unit = length_unit(*quantiles["maximum"].values())
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
            # Of a run of an earlier version there is none of some.
            in_unit(getattr(model, name), unit),
            *(in_unit(quantiles[name][share], unit) for share in shares),
        )
        for name, words in names
    ]
    below = (f"{100 * float(share):g} % of robots below" for share in shares)
    how = (
        f"process evaluated for each of them, {figures.process_evaluations} times in all"
        if figures.wrench == "coupled"
        else "wrench of the process on the model, times the factor of the force"
    )
    text = (
        f"Command as written, simulated with inertia on {figures.samples} robots with sampled uncertain"
        f" parameters{_AS_USUAL if not figures.chosen else ''}; {how}."
    )
    return Section("", (text, Table((f"deviation [{unit}]", "if the file is right", *below), rows)))


def _parameters(figures: StudyResult) -> Section:
    shares_of = {entry.name: shares["maximum"] for entry, shares in figures.ordered}
    rows = [
        (
            _with_unit(entry.name),
            entry.distribution,
            f"{100 * shares_of[entry.name].share:.0f} %" if shares_of else "",
            f"{shares_of[entry.name].rank_correlation:+.2f}" if shares_of else "",
        )
        for entry in [entry for entry, _ in figures.ordered] or figures.parameters
    ]
    header = ("parameter", "distribution", "share of the variance of max", "rank correlation")
    silent = ", ".join(map(parameter_words, figures.silent))
    notes = [f"Without effect in this case: {silent}."] if silent else []
    few = [] if shares_of else ["Too few samples for the sensitivity to each parameter."]
    return Section("Uncertain parameters", (Table(header, rows), *notes, *few))


_DISTRIBUTION = Note(
    "Share of robots whose deviation, the largest along the path or its rms, stays below a limit."
)
_SCATTER = Note("Each dot is a sampled robot; only the most important parameters are shown.")


def _bands_note(figures: StudyResult) -> Note:
    share = figures.coverage
    return Note(
        f"Band: in each interval by itself, {100 * share:g} % of robots are expected in it and"
        f" {50 * (1 - share):.3g} % on each side. Dotted line: {100 * share:g} % of robots stay below it"
        f" along the whole path. Largest deviation in each of {PARTS} equal intervals of time."
    )
