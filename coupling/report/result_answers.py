"""First screens of what is no run: identification, next command, placement, study and stability."""

from __future__ import annotations

import shlex

import numpy as np

from coupling.path.length_text import format_um
from coupling.report.lengths import in_words
from coupling.results.identified_result import IdentifiedResult
from coupling.results.next_result import NextResult
from coupling.results.placement_result import PlacementResult, SettingResult
from coupling.results.section import Answer, KeyFigure, NextStep
from coupling.results.stability_result import StabilityResult
from coupling.results.study_result import StudyResult


def identify_answer(result: IdentifiedResult, file: str) -> Answer:
    """Return the first screen of an identification, whose robot file is `file`."""
    sizes = result.rms_m
    fit, start, left_out = sizes.fit, sizes.start, sizes.left_out
    known = sum(parameter.identified for parameter in result.parameters)
    count = f"{known} of {len(result.parameters)}"
    if result.refusal:
        sentence = f"No robot file was written: {result.refusal}."
        steps = [
            NextStep(
                "Plan measurements that tell more:",
                f"elastic-robot identify --plan -o {shlex.quote('plan.csv')}",
            )
        ]
    else:
        typical = fit if left_out is None else left_out
        error = "an unknown error" if typical is None else in_words(typical)
        sentence = (
            f"The robot file was written: it predicts a deflection that was not used to within {error}"
            f" (typically); {count} parameters are identified."
        )
        steps = [
            NextStep(f"Name {file} as description in [robot] of your case."),
            NextStep("Correct the command:", "elastic-robot compensate case.toml"),
        ]
        if known < len(result.parameters):
            plan = f"elastic-robot identify --plan --robot {shlex.quote(file)} -o plan.csv"
            steps.append(NextStep("Plan measurements for what is still open:", plan))
    return Answer(
        sentence=sentence,
        good=not result.refusal,
        figures=(
            KeyFigure("Start file", _length(start), "typical error of its deflections"),
            KeyFigure("New file", _length(left_out), "typical error of rows that were left out"),
            KeyFigure("Measured deflection", _length(sizes.measured), "typical size"),
        ),
        steps=steps,
    )


def _length(length: float | None) -> str:
    return "not known" if length is None else in_words(length)


def next_answer(result: NextResult, folder: str) -> Answer:
    """Return the first screen of a next command, whose run folder is `folder`."""
    forecast, last = result.forecast, result.runs[-1].size_m
    if result.step.worse:
        sentence = (
            f"The last command left more than an earlier one ({in_words(last.maximum)}): this one goes"
            " on from the better one."
        )
    elif forecast is None:
        sentence = f"Measured: {in_words(last.maximum)}. A next command has not been computed yet."
    else:
        sentence = (
            f"Expect {in_words(forecast.rms)} on average in the next run, and at most about"
            f" {in_words(forecast.maximum)}; measured in the last one: {in_words(last.rms)} and"
            f" {in_words(last.maximum)}."
        )
    name = shlex.quote(folder)
    return Answer(
        sentence=sentence,
        reason=result.sentences[0],
        good=not result.step.worse,
        figures=(
            KeyFigure("Measured last", in_words(last.maximum), "largest, noise taken off"),
            KeyFigure(
                "Expected next",
                _length(None if forecast is None else forecast.maximum),
                "at most about, on your robot",
            ),
            KeyFigure(
                "On average",
                "not known" if forecast is None else in_words(forecast.rms),
                f"after {in_words(last.rms)} in the last run",
            ),
        ),
        steps=[
            NextStep("Write the robot program:", f"elastic-robot export {name} --to krl"),
            NextStep(
                "Run it, measure again, and go on:",
                f"elastic-robot next {name} measured.csv -o {shlex.quote(f'{folder}_next')}",
            ),
        ],
    )


def place_answer(figures: PlacementResult, folder: str) -> Answer:
    """Return the first screen of a placement in a folder."""
    best, present = figures.best[0], figures.present
    left = in_words(best.exposure_m)
    if present is None:
        sentence = (
            f"The robot cannot follow the path as it is. Placed as below it can: {left} are open"
        )
    else:
        sentence = (
            f"Placed as below, unknown gears cost {left} instead of {in_words(present.exposure_m)}"
        )
    chatters = best.stability is not None and not best.stability.stable
    return Answer(
        sentence=f"{sentence}.",
        reason=f"{best.stability.sentence}." if chatters and best.stability is not None else "",
        good=best.admitted and not chatters,
        figures=(
            KeyFigure("By the process", _by(present, best), "displacement, as it is and there"),
            KeyFigure("By unknown gears", left, f"there, with {figures.unknown}"),
            KeyFigure(
                "To the nearest joint limit",
                f"{np.rad2deg(best.limit_margin_rad):.3g} deg"
                if np.isfinite(best.limit_margin_rad)
                else "no limit",
                "there",
            ),
        ),
        steps=[
            NextStep("Check robot, tool and part for collisions there."),
            NextStep(
                "Correct the command:",
                f"elastic-robot compensate {shlex.quote(f'{folder}/{best.file}')}",
            ),
        ],
    )


def _by(present: SettingResult | None, best: SettingResult) -> str:
    before = "-" if present is None else f"{format_um(present.moved_m)}"
    return f"{before} / {format_um(best.moved_m)} um"


def study_answer(figures: StudyResult, case: str) -> Answer:
    """Return the first screen of a study of a case, by its file's name."""
    most = figures.quantile("maximum", figures.coverage)
    share = f"{100 * figures.coverage:g} %"
    exact = figures.command.deviation_m.maximum
    ordered = figures.ordered
    reason = ""
    if ordered:
        worst, shares = ordered[0]
        reason = (
            f"{worst.name} decides most: {100 * shares['maximum'].share:.0f} % of the scatter comes from"
            " it alone."
        )
    return Answer(
        sentence=f"{share} of the robots that are possible stay within {in_words(most)} of the path.",
        reason=reason,
        good=None if not figures.failed else False,
        figures=(
            KeyFigure(f"{share} of robots", in_words(most), "largest deviation"),
            KeyFigure(
                "If the file is right", in_words(exact), "on a robot exactly as its file says"
            ),
            KeyFigure("Robots", f"{figures.samples}", f"{len(figures.failed)} cannot be simulated"),
        ),
        steps=[
            NextStep("Measure what decides most:", "elastic-robot identify --plan -o plan.csv"),
            NextStep(
                "Or place the part where it matters less:",
                f"elastic-robot place {shlex.quote(case)}",
            ),
        ],
    )


def stability_answer(result: StabilityResult, case: str) -> Answer:
    """Return the first screen of a case's stability, by its file's name."""
    worst = result.points[result.worst]
    is_stable = all(point.stable for point in result.points)
    limit = f"{1e3 * worst.limit_m:.3g} mm" if np.isfinite(worst.limit_m) else "no limit"
    name = shlex.quote(case)
    steps = [NextStep("Correct the command:", f"elastic-robot compensate {name}")]
    if not is_stable:
        rpm = ", ".join(f"{low:.0f} to {high:.0f}" for low, high in result.stable_rpm[:3])
        speeds = f", or a speed of {rpm} 1/min" if rpm else ""
        steps = [
            NextStep(f"Cut less than {limit} deep{speeds}."),
            NextStep(
                "Or find a place where it is stable:",
                f"elastic-robot place {name} --optimise stability",
            ),
        ]
    return Answer(
        sentence="This cut will not chatter."
        if is_stable
        else "This cut will chatter: do not run it.",
        reason=f"{result.sentence}.",
        good=is_stable,
        figures=(
            KeyFigure(
                "Programmed depth", f"{1e3 * worst.depth_m:.3g} mm", f"{worst.rpm:.0f} 1/min"
            ),
            KeyFigure("Limit", limit, "where it is worst"),
            KeyFigure("Vibration", f"{worst.frequency_Hz:.3g} Hz", "the slowest to decay"),
        ),
        steps=steps,
    )
