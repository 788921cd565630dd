"""The report of planned measurements: the robot in its poses, loads, and what they will tell."""

from __future__ import annotations

from functools import partial

import numpy as np

from coupling.identification.static.plan import MeasurementPlan
from coupling.path.length_text import in_words
from coupling.report.colours import BEFORE
from coupling.report.result_report import ResultReport
from coupling.report.run_scene import scene_robot
from coupling.results.scene import Scene, SceneLine, SceneMotion
from coupling.results.section import Answer, KeyFigure, NextStep, Note, Section, Table
from coupling.run.robot_results import chain_of
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.kinematics import base_from_tool

# Half width of an interval below which a number is called known [1].
_KNOWN = 0.2
# Length of a drawn load, as a part of the extent of all places of the tool.
_ARROW = 0.15
_NOTE = Note(
    "In the picture: the robot in one pose after the other, a second each; lines are the loads on the"
    " tool. Collisions are not checked."
)


def plan_report(plan: MeasurementPlan, robot: Robot, name: str, file: str) -> ResultReport:
    """Return what is told of planned measurements.

    Args:
        robot: The robot that is to be measured.
        name: Its file or its name, as commands name it.
        file: File of the plan, as commands name it.
    """
    return ResultReport(
        "measurement plan",
        robot.name,
        _answer(plan, name, file),
        partial(_sections, plan),
        scene=partial(_scene, plan, robot, name),
    )


def _answer(plan: MeasurementPlan, name: str, file: str) -> Answer:
    count, parameters = plan.measurements.count, len(plan.expected)
    before, after = (
        sum(half <= _KNOWN for half in halves)
        for halves in (
            [interval.before for interval in plan.expected],
            [interval.after for interval in plan.expected],
        )
    )
    deflections = np.linalg.norm(plan.measurements.deflection, axis=1)
    loads = np.linalg.norm(plan.measurements.wrench[:, :3], axis=1)
    more = (
        "" if after == parameters else "More measurements tell more: --count, or a larger --force."
    )
    return Answer(
        sentence=f"{count} poses and loads are planned: they are expected to tell {after} of"
        f" {parameters} numbers of the gears to within {100.0 * _KNOWN:.0f} %.",
        reason=more,
        figures=(
            KeyFigure("Known then", f"{after} of {parameters}", f"{before} so far"),
            KeyFigure("Smallest deflection", in_words(deflections.min()), "to be measured"),
            KeyFigure("Largest", in_words(deflections.max()), f"under {loads.max():.3g} N"),
        ),
        steps=[
            NextStep("Check every pose for collisions before you move the robot there."),
            NextStep(f"Load it there, and fill in dx, dy, dz [m] in {file}."),
            NextStep.by("Identify the robot from them:", "identify", file, "--robot", name),
        ],
    )


def _sections(plan: MeasurementPlan) -> list[Section]:
    rows = [
        (
            interval.name,
            f"{interval.start:.4g}",
            *(
                "unknown" if not np.isfinite(half) else f"{100.0 * half:.3g} %"
                for half in (interval.before, interval.after)
            ),
        )
        for interval in plan.expected
    ]
    text = (
        "Expected 95 % interval of each compliance or backlash relative to its value (+- %), if the"
        " start file is right."
    )
    table = Table(("parameter", "start", "so far", "then"), rows)
    return [Section("What the measurements will tell", [text, table, _NOTE])]


def _scene(plan: MeasurementPlan, robot: Robot, name: str) -> Scene:
    planned = plan.measurements
    motion = SceneMotion(np.arange(float(planned.count)), planned.q)
    chain = build_chain(robot)
    data = chain.model.createData()
    place = np.array([base_from_tool(chain, data, chain.theta(q)).translation for q in planned.q])
    force = planned.wrench[:, :3]
    scale = (
        _ARROW * max(float(np.ptp(place, axis=0).max()), 0.1) / np.linalg.norm(force, axis=1).max()
    )
    gaps = np.full_like(place, np.nan)
    lines = np.stack([place, place + scale * force, gaps], axis=1).reshape(-1, 3)
    return Scene(
        robots=[scene_robot(robot.name, chain_of(robot), motion, description=name)],
        lines=[SceneLine("loads", BEFORE, lines)],
    )
