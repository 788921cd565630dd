"""The page of how a next command was found: measured runs, convergence, forecast."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import plotly.graph_objects as go

from coupling.errors import sentence
from coupling.identification.next.measured_run import MeasuredRun
from coupling.path.length_text import format_um, in_unit, in_words, length_unit
from coupling.report.background import case_content, case_of, real_part
from coupling.report.bars import bars
from coupling.report.colours import JOINTS
from coupling.report.learn_report import learned_figures, learned_summary
from coupling.report.lengths import judged, words_if_known
from coupling.report.result_report import ResultReport
from coupling.report.run_scene import part_frame, run_scene, track
from coupling.report.style import DrawnLine, over_time
from coupling.results.learned_result import LearnedResult
from coupling.results.next_result import NextResult, PathCorrectionResult
from coupling.results.scene import Scene
from coupling.results.section import UM, Answer, KeyFigure, NextStep, Note, Section, Table, warned
from coupling.run.stored_run import read_run

_TIME = "time of the run [s]"


def next_report(
    name: str,
    result: NextResult,
    learned: LearnedResult | None,
    answer: Answer,
    runs: Sequence[MeasuredRun],
) -> ResultReport:
    """Return what is told of a next command.

    Args:
        name: Name of the command, and what it was learned from.
        result: Its figures, the content of next.json.
        learned: Parameters that were learned for it, the content of learned.json.
        answer: First screen.
        runs: The measured runs.
    """
    return ResultReport(
        "next",
        name,
        answer,
        partial(_sections, result, learned),
        warnings=warned(
            [*result.warnings, *map(sentence, () if learned is None else learned.warnings)]
        ),
        scene=partial(next_scene, runs),
    )


def next_scene(runs: Sequence[MeasuredRun]) -> Scene:
    """Return the tool in space as it was measured in all runs, on the robot of the last one.

    The first and the last are seen at first.
    """
    stored = read_run(runs[-1].source.folder)
    frame = part_frame(real_part(stored.figures, case_of(stored)))
    scene = run_scene(stored, frame, case_content(stored))
    first, *others = (
        track(f"run {number}, measured", *run.paths) for number, run in enumerate(runs, start=1)
    )
    return replace(scene, tracks=[first, *reversed(others)])


def _sections(result: NextResult, learned: LearnedResult | None) -> list[Section]:
    sections = [
        *next_summary(result, learned),
        Section("What was measured", [_MEASURED], "measured-runs", [_distances(result)]),
    ]
    if result.correction is not None:
        heading = "Correction along the path"
        sections.append(Section(heading, [], "correction", [_correction(result.correction)]))
    if learned is not None:
        sections += learned_figures(learned)
    return sections


def next_answer(result: NextResult, folder: str, robot: str, next_words: Sequence[str]) -> Answer:
    """Return the first screen of a next command.

    Args:
        result: Its figures.
        folder: Its run folder, or before it is computed its case file, as commands name it.
        robot: Name of the robot.
        next_words: Words of the command that goes on from it.
    """
    forecast, runs, last = result.forecast, result.runs, result.runs[-1].size_m
    steps = [
        NextStep.export("Write the robot program:", folder, robot),
        NextStep.by("Run it, measure again, and go on:", *next_words),
    ]
    good = None
    if forecast is None:
        sentence = f"Measured: {in_words(last.maximum)}. A next command has not been computed."
        steps = [NextStep.by("Compute it:", "compensate", folder)]
    else:
        if result.tolerance_m is not None:
            good = forecast.maximum <= result.tolerance_m
        words = (
            f"expect the tool within at most about {in_words(forecast.maximum)} of its path in the next"
            " run"
        )
        sentence = judged(words, good, result.tolerance_m)
    if forecast is not None and forecast.rms >= forecast.before:
        tolerance = result.tolerance_m
        good = None if tolerance is None else last.maximum <= tolerance
        in_tolerance = (
            f", which keeps your tolerance of {in_words(tolerance)}" if tolerance and good else ""
        )
        sentence = (
            f"NO BETTER IS EXPECTED: {in_words(forecast.rms)} on average in the next run, after"
            f" {in_words(forecast.before)} in the last one: keep the last command{in_tolerance}."
        )
        steps = [NextStep(f"Keep the program of {runs[-1].run}.")]
    if result.step.worse:
        good = False
        sentence = (
            f"WORSE THAN BEFORE: the last command left {in_words(last.maximum)}, more than an earlier"
            " one, from which this one goes on."
        )
    return Answer(
        sentence=sentence,
        reason=_against_forecast(result),
        good=good,
        figures=(
            KeyFigure("Measured last", in_words(last.maximum), "largest, noise taken off"),
            KeyFigure(
                "Expected next",
                words_if_known(None if forecast is None else forecast.maximum),
                "at most about, on your robot",
            ),
            KeyFigure(
                "On average",
                words_if_known(None if forecast is None else forecast.rms),
                f"after {in_words(last.rms)} in the last run",
            ),
        ),
        steps=steps,
        picture=bars(
            [
                *(
                    (f"measured, run {k}", run.size_m.maximum)
                    for k, run in enumerate(runs, start=1)
                ),
                ("expected next", None if forecast is None else forecast.maximum),
            ],
            result.tolerance_m,
        ),
    )


def refused_answer(result: NextResult, path_words: Sequence[str]) -> Answer:
    """Return the first screen where no parameter could be learned.

    Args:
        result: The figures.
        path_words: Words of the command that learns along the path alone.
    """
    last = result.runs[-1].size_m
    return Answer(
        sentence=(
            "NO NEXT COMMAND: backlash, stiffness and damping of this robot cannot be learned from what"
            " was measured."
        ),
        reason=sentence(f"{result.parameters_refused[:1].upper()}{result.parameters_refused[1:]}"),
        good=False,
        figures=(
            KeyFigure("Measured last", in_words(last.maximum), "largest, noise taken off"),
            KeyFigure("On average", in_words(last.rms), "in the last run"),
            KeyFigure("Noise", in_words(result.runs[-1].noise_m), "of the measurement"),
        ),
        steps=[NextStep.by("Correct the path alone:", *path_words)],
    )


def _against_forecast(result: NextResult) -> str:
    """Return how the last run compares with what was expected of it, and what is not corrected."""
    last, forecast, sentences = result.runs[-1], result.runs[-1].forecast, []
    if forecast is not None:
        average = last.size_m.rms if forecast.absolute else last.size_m.rms_less_constant
        state = "as much as" if forecast.low <= average <= forecast.high else "more than"
        sentences.append(
            f"The last run left {'less than' if average < forecast.low else state} was expected:"
            f" {in_words(average)} on average, expected {in_words(forecast.low)} to"
            f" {in_words(forecast.high)}."
        )
    if not result.absolute:
        sentences.append(
            "A shift of the whole path is not counted: the frame of the measuring device is not known."
        )
    return " ".join(sentences)


def next_summary(result: NextResult, learned: LearnedResult | None) -> list[Section]:
    """Return how a next command is computed, and what to expect of it once that is known."""
    forecast = [] if result.forecast is None else [f"{result.forecast.sentence}."]
    told = [words for words in result.sentences if words not in result.warnings]
    return [
        Section("How it was computed", [*forecast, *told]),
        Section("Measured runs", _runs(result)),
        *([] if learned is None else learned_summary(learned)),
    ]


def _runs(result: NextResult) -> list[Table]:
    sizes, devices = [], []
    _, unit = length_unit(*(run.size_m.maximum for run in result.runs))

    def in_column(*lengths: float, between: str = " / ") -> str:
        return between.join(in_unit(length, unit) for length in lengths)

    for number, run in enumerate(result.runs, start=1):
        size, forecast = run.size_m, run.forecast
        expected = (
            "" if forecast is None else in_column(forecast.low, forecast.high, between=" to ")
        )
        sizes.append(
            (
                f"{number}",
                f"{run.measured} under {run.run}",
                in_column(size.rms, size.maximum),
                in_column(size.rms_less_constant, size.maximum_less_constant),
                in_column(size.fast),
                expected,
            )
        )
        devices.append(
            (
                f"{number}",
                format_um(run.noise_m),
                ", ".join(f"{round(UM * value) + 0}" for value in run.frame_shift_m),
                ", ".join(f"{1e3 * value:.2f}" for value in run.frame_turn_rad),
                ", ".join(format_um(value) for value in run.tip_m),
                f"{1e3 * run.clock_s:+.1f}",
                f"{run.left_out}",
            )
        )
    columns = (
        *("run", "measured", f"rms / largest [{unit}]", f"less a constant [{unit}]"),
        *(f"faster than 15 Hz [{unit}]", f"forecast of the rms [{unit}]"),
    )
    off = (
        *("run", "noise [um]", "offset of frame [um]", "and [mrad]", "offset of tip [um]"),
        *("offset of clock [ms]", "samples left out"),
    )
    return [Table(columns, sizes), Table(off, devices)]


def _distances(result: NextResult) -> go.Figure:
    lines = []
    factor, unit = length_unit(*(max(run.distance_m) for run in result.runs))
    for number, run in enumerate(result.runs, start=1):
        # The colour of the last run is always the same.
        color = JOINTS[(len(result.runs) - number) % len(JOINTS)]
        distance = factor * np.array(run.distance_m)
        lines.append(DrawnLine(f"run {number}: {run.measured}", color, run.time, distance, 1.2))
    label = f"distance from the desired path [{unit}]"
    return over_time(lines, label, 380, _TIME, {"rangemode": "tozero"})


def _correction(correction: PathCorrectionResult) -> go.Figure:
    factor, unit = length_unit(float(np.abs(correction.deviation_m).max()))
    deviation = factor * np.array(correction.deviation_m)
    lines = [
        DrawnLine(axis, color, correction.time, values)
        for axis, color, values in zip("xyz", JOINTS, deviation.T, strict=False)
    ]
    return over_time(lines, f"beyond the model, base axes [{unit}]", 320, _TIME)


_MEASURED = Note(
    "Distance of the measured tool from its desired path, noise of the measurement included."
)
