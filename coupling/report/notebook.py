"""Results in a notebook: the first screen and the view in space, as their reports have them."""

from __future__ import annotations

import html
from dataclasses import replace

from coupling.place.folder import StoredPlacement
from coupling.report.background import case_content, case_of, real_part
from coupling.report.compare_answer import comparison_answer
from coupling.report.compare_report import comparison_scene
from coupling.report.comparison import Comparison
from coupling.report.document import document
from coupling.report.lengths import in_words
from coupling.report.result_answers import (
    modes_answer,
    place_answer,
    stability_answer,
    study_answer,
)
from coupling.report.run_report import answer_of
from coupling.report.run_scene import part_frame, run_scene, track, tracks_of
from coupling.report.stored_result import read_result
from coupling.results.modes_result import ModesResult
from coupling.results.run_result import RunResult
from coupling.results.scene import Scene
from coupling.results.section import Answer, KeyFigure
from coupling.results.shown import html_of
from coupling.results.stability_result import StabilityResult
from coupling.run.execute import Run
from coupling.run.stored_run import StoredRobot, StoredRun
from coupling.study.stored_study import StoredStudy

# A notebook imports both from here: reading a result and showing it.
__all__ = ["framed", "read_result"]

# Height of a first screen with and without a view in space [px].
_WITH_SCENE, _ALONE = 680, 360


def framed(answer: Answer) -> str:
    """Return a first screen as HTML that stands by itself within another page."""
    height = _ALONE if answer.scene is None else _WITH_SCENE
    page = html.escape(document("", [], answer))
    return (
        f'<iframe srcdoc="{page}" style="width: 100%; height: {height}px; border: 0" loading="lazy">'
        "</iframe>"
    )


html_of.register(Answer, framed)


@html_of.register
def _of_scene(scene: Scene) -> str:
    return framed(Answer("", scene=scene))


@html_of.register
def _of_stored_run(run: StoredRun) -> str:
    frame = part_frame(real_part(run.figures, case_of(run)))
    return framed(answer_of(run, run_scene(run, frame, case_content(run))))


@html_of.register
def _of_stored_robot(robot: StoredRobot) -> str:
    scene = Scene(tracks=tracks_of(robot))
    return framed(replace(_deviations(robot.figures), scene=scene))


def _deviations(figures: RunResult) -> Answer:
    """Return the deviations of one robot, which no case judges."""
    return Answer(
        f"{figures.case}, {figures.robots[0].title}",
        figures=[
            KeyFigure(stage, in_words(deviation.maximum), "largest, with this robot file")
            for stage, deviation in zip(figures.stages, figures.deviations, strict=False)
        ],
    )


@html_of.register
def _of_run(run: Run) -> str:
    stages = {"before": run.before}
    if run.kind == "compensate":
        stages["after"] = run.correction.achieved
    figures = [
        KeyFigure(stage, in_words(run.deviation(path).maximum), "largest, with this robot file")
        for stage, path in stages.items()
    ]
    tracks = [
        replace(track(stage, desired, actual), robot=name if len(run.robots) > 1 else "")
        for stage, path in stages.items()
        for name, desired, actual in zip(run.robots, run.desired.tools, path.tools, strict=True)
    ]
    sentence = f"{run.kind}: {run.correction.reason}"
    good = None if run.correction.converged else False
    return framed(Answer(sentence, good=good, figures=figures, scene=Scene(tracks=tracks)))


@html_of.register
def _of_comparison(comparison: Comparison) -> str:
    return framed(replace(comparison_answer(comparison), scene=comparison_scene(comparison)))


@html_of.register
def _of_study(study: StoredStudy) -> str:
    return framed(study_answer(study))


@html_of.register
def _of_placement(placement: StoredPlacement) -> str:
    return framed(place_answer(placement.figures, "placed"))


@html_of.register
def _of_stability(result: StabilityResult) -> str:
    return framed(stability_answer(result))


@html_of.register
def _of_modes(result: ModesResult) -> str:
    return framed(modes_answer(result))
