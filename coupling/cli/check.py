"""The command line: elastic-robot check."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from coupling.case import Case, load_case
from coupling.cli.arguments import CaseFile
from coupling.events import Progress
from coupling.path.histories import WrenchHistory
from coupling.process import Answer
from coupling.run.console import RunView, gear_lines
from coupling.run.gear_loads import diagnose_robot, wanted_of


def check(
    case: CaseFile,
    evaluate: Annotated[
        bool,
        typer.Option(
            "--evaluate",
            help="Evaluate the process once on the desired path; else gears carry the robot alone.",
        ),
    ] = False,
) -> None:
    """Say whether a case can be run, and which gears a wrong backlash would show of; run nothing."""
    console = Console()
    with RunView(console) as view:
        loaded = load_case(case, watch=view.watch)
        answer = loaded.process.evaluate(loaded.desired) if evaluate else None
        view.watch(Progress("looking at joints and gears", 0, 1))
        lines = list(_lines(loaded, answer))
    for line in lines:
        console.print(line, markup=False, highlight=False, soft_wrap=True)


def _lines(case: Case, answer: Answer | None) -> Iterator[str]:
    """Yield what there is to say of a case, robot by robot."""
    desired = case.desired
    wrench = WrenchHistory(desired.time, np.zeros((*desired.pose.shape[:2], 6)))
    loads = "the robot's own weight"
    if answer is not None:
        wrench = answer.wrench
        loads = f"weight and process, at most {wrench.peak_force:.0f} N"
    for placed, wanted in zip(case.robots, wanted_of(case.robots, desired, wrench), strict=True):
        way = np.linalg.norm(np.diff(wanted.path.position[0], axis=0), axis=1).sum()
        yield f"{placed.description.name}: {way:.3f} m of path in {desired.time[-1]:.1f} s"
        angles = np.rad2deg(wanted.rigid.q[0])
        for number, (low, high) in enumerate(
            zip(angles.min(axis=0), angles.max(axis=0), strict=True), start=1
        ):
            yield f"  joint {number}: {low:.1f} to {high:.1f} deg"
        at_risk = gear_lines(diagnose_robot(placed, wanted))
        none = "a wrong backlash would show of no gear at the tool"
        yield f"  under {loads}:" if at_risk else f"  under {loads} {none}"
        yield from at_risk
