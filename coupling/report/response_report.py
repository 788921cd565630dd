"""The report of an identification from frequency responses: errors, parameters, responses by posture."""

from __future__ import annotations

from coupling.report.modes_report import response_figure
from coupling.report.parameter_table import parameter_table
from coupling.results.identified_result import (
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
    "95 % intervals are those of noise, and wider by what the model does not describe: where more is"
    " left than noise, simulated ones hold 89 % of the gears' stiffness. Stiffness is known to a factor"
    " of 2.2 before, damping to a factor of 7 around a ratio of 0.04."
)
# A residual so many times as large as noise is of what the model does not describe.
_UNEXPLAINED = 1.05


def _responses(result: ResponseFitResult) -> list[Section]:
    """Return the responses of every posture, measured and identified."""
    sections = []
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
    return sections


def response_sections(result: ResponseFitResult) -> list[Section]:
    """Return what was identified from frequency responses."""
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
        Section("Error of the responses", [_ERRORS, errors]),
        Section("Parameters", [_INTERVALS, parameter_table(result.parameters)]),
        Section("Modes with motors locked, as written", [modes]),
        *_responses(result),
    ]


def _row(words: str, error: LogErrorResult) -> tuple[str, ...]:
    return (words, *(f"{value:.3f}" for value in (error.start, error.fit, error.written)))


def _modes(posture: PostureResponseResult) -> str:
    pairs = zip(posture.modes_Hz, posture.damping_ratios, strict=True)
    return ", ".join(f"{frequency:.1f} ({100.0 * ratio:.1f})" for frequency, ratio in pairs)


def response_warnings(result: ResponseFitResult) -> list[str]:
    """Return what the user should look at: gears without load, and what the model does not describe."""
    unloaded: dict[str, list[str]] = {}
    for posture in result.postures:
        if posture.unloaded_joints:
            joints = ", ".join(map(str, posture.unloaded_joints))
            unloaded.setdefault(joints, []).append(posture.name)
    warnings = [
        f"{', '.join(names)}: the gears of joint {joints} hang free in their backlash, where nothing"
        " tells of their stiffness: pull the tool to one side, or use --torque-curve linear."
        for joints, names in unloaded.items()
    ]
    if result.residual > _UNEXPLAINED * result.noise:
        warnings.append(
            f"The fit leaves {100.0 * result.residual:.2g} %, noise alone would be"
            f" {100.0 * result.noise:.2g} %: something gives way that the robot file has not (links,"
            " base, tool) and is taken for gears and tilts. Stiffness is that of a gear with what gives"
            " way beside it, most often less than the gear's alone; the intervals are wider for that."
        )
    return warnings
