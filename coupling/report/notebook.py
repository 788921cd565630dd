"""Results in a notebook: the first screen and the view in space, as their reports have them."""

from __future__ import annotations

import html
from dataclasses import replace

from coupling.path.length_text import in_words
from coupling.report.compare_report import comparison_report
from coupling.report.comparison import Comparison
from coupling.report.document import document
from coupling.report.run_scene import track, tracks_of
from coupling.report.stored_result import KINDS, StoredResult, read_result, report_of
from coupling.results.base import html_of
from coupling.results.run_result import RunResult
from coupling.results.scene import Scene
from coupling.results.section import Answer, KeyFigure
from coupling.run.execute import Run
from coupling.run.stored_run import StoredRobot

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
    return framed(comparison_report(comparison).first_screen)


def _of_result(result: StoredResult) -> str:
    return framed(report_of(result).first_screen)


for _kind in KINDS.values():
    html_of.register(_kind.type, _of_result)
