"""A run's commands as programs, each judged by what its file does to the moving robot."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from coupling.case import Case, PlacedRobot, load_case
from coupling.events import Watch, unwatched
from coupling.export.checks import (
    require_joints,
    require_limits,
    require_robots,
    require_same_robot,
    require_step,
)
from coupling.export.every_cycle import every_cycle
from coupling.export.exported import Exported, Options
from coupling.export.few_points import few_points
from coupling.export.job import Job
from coupling.files.controller_axes import ControllerAxes, controller_axes
from coupling.files.robot_file import find_robot
from coupling.inverse.joint_limits import JointLimits
from coupling.run.models import Models, cell_of
from coupling.run.stored_run import read_run


def export_run(folder: Path, options: Options, watch: Watch = unwatched) -> tuple[Exported, ...]:
    """Return the programs of a run's robots: few points, or a row on every cycle.

    Args:
        folder: The run folder.
        options: What is to be written.
        watch: Function that is told how far the work is.

    Raises:
        CouplingError: If the run cannot be read, a robot cannot do what is asked, or the language not
            say it.
    """
    run, case = read_run(folder), load_case(folder / "case.toml")
    require_robots(folder, case, run)
    cycle = options.cycle or case.controller.cycle
    program = every_cycle if options.language.dense else few_points
    require_step(options.language, cycle)
    limits = [JointLimits.of(r.description, case.controller.max_acceleration) for r in case.robots]
    for placed, limit in zip(case.robots, limits, strict=True):
        require_joints(options.language, len(placed.description.joints))
        require_limits(run.robots[placed.name].joints, limit, _who(case, placed))
    found = []
    with Models(case.fmu, watch) as models:
        cell, _ = cell_of(case.robots, models)
        for member, placed, limit in zip(cell.members, case.robots, limits, strict=True):
            require_same_robot(folder, member, run.robots[placed.name])
            job = Job(
                case,
                placed,
                member,
                run.robots[placed.name],
                _axes(case, placed),
                limit,
                replace(options, name=_name(folder, case, placed, options), cycle=cycle),
                watch,
                _who(case, placed),
            )
            found.append(program(job))
    return tuple(found)


def _axes(case: Case, placed: PlacedRobot) -> ControllerAxes:
    table = "robot" if placed.name == "forming" else "support"
    file = find_robot(case.resolved[table]["description"])
    return controller_axes(file, len(placed.description.joints))


def _name(folder: Path, case: Case, placed: PlacedRobot, options: Options) -> str:
    """Return the name of a robot's program."""
    behind = f"_{placed.name}" if len(case.robots) > 1 else ""
    if options.name is not None:
        return options.name + behind
    own = "".join(c if c.isascii() and c.isalnum() else "_" for c in folder.resolve().name)
    own = own if own[:1].isalpha() else f"P{own}"
    return own[: options.language.longest_name - len(behind)] + behind


def _who(case: Case, placed: PlacedRobot) -> str:
    return f"{placed.name} robot: " if len(case.robots) > 1 else ""
