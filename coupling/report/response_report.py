"""The report of an identification from frequency responses: errors, parameters, responses by posture."""

from __future__ import annotations

from coupling.errors import sentence
from coupling.report.document import document
from coupling.report.modes_report import response_figure
from coupling.report.parameter_table import parameter_table
from coupling.results.response_result import (
    LogErrorResult,
    PostureResponseResult,
    ResponseFitResult,
)
from coupling.results.section import Note, Section, Table

_ERRORS = Note(
    "Median of |log(model / measurement)|: 0.1 is a tenth in magnitude, or 6 degrees in phase. Motors"
    " are taken for locked, gears for on the flank that gravity presses them to."
)
_INTERVALS = Note(
    "95 % intervals hold errors of the model within a third of an octave; stiffness is known to a factor"
    " of 2.2 before, damping to a factor of 7 around a ratio of 0.04."
)


def response_page(title: str, result: ResponseFitResult) -> str:
    """Return the page of an identification from frequency responses as one self-contained HTML text.

    Args:
        title: Title of the page.
        result: Its figures, the content of identified.json.
    """
    sections = response_summary(result)
    for number, posture in enumerate(result.postures, start=1):
        words = "predicted" if posture.held_out else "fitted"
        for by in "xyz":
            of_force = [
                (f", {name}", [r for r in responses if r.name[1] == by], mode)
                for name, responses, mode in (
                    ("measured", posture.measured, "markers"),
                    ("identified", posture.written, "lines"),
                )
            ]
            if of_force[0][1]:
                heading = f"{posture.name}, {words}: motion by a force along {by}"
                figure = response_figure(of_force)
                sections.append(Section(heading, [], f"response-{number}-{by}", [figure]))
    return document(title, sections)


def response_summary(result: ResponseFitResult) -> list[Section]:
    """Return what was identified from frequency responses."""
    words = sentence(f"NOT WRITTEN: {result.refusal}") if result.refusal else "Identified."
    if not result.converged:
        words += " The fit has not converged: its values may still change."
    rows = [_row("all that are fitted", result.error)]
    if result.held_out is not None:
        rows.append(_row("all that are held out", result.held_out))
    rows += [_row(posture.name, posture.error) for posture in result.postures]
    errors = Table(("responses", "start file", "fit", "as written"), rows)
    modes = Table(
        ("posture", "modes [Hz] (damping ratio [%])"),
        [(posture.name, _modes(posture)) for posture in result.postures],
    )
    return [
        Section("", [words], good=not result.refusal and result.converged),
        Section("Error of the responses", [_ERRORS, errors]),
        Section("Parameters", [_INTERVALS, parameter_table(result.parameters)]),
        Section("Modes with motors locked, as written", [modes, *_remarks_on_unloaded(result)]),
    ]


def _row(words: str, error: LogErrorResult) -> tuple[str, ...]:
    return (words, *(f"{value:.3f}" for value in (error.start, error.fit, error.written)))


def _modes(posture: PostureResponseResult) -> str:
    pairs = zip(posture.modes_Hz, posture.damping_ratios, strict=True)
    return ", ".join(f"{frequency:.1f} ({100.0 * ratio:.1f})" for frequency, ratio in pairs)


def _remarks_on_unloaded(result: ResponseFitResult) -> list[str]:
    return [
        f"{posture.name}: gears of joints {', '.join(map(str, posture.unloaded_joints))} are unloaded in"
        " their backlash, where nothing tells of their stiffness: pull the tool to one side, or use"
        " --torque-curve linear."
        for posture in result.postures
        if posture.unloaded_joints
    ]
