"""Commands as programs, each judged by what its file does to the moving robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from coupling.events import Watch, unwatched
from coupling.export.checks import require_joints, require_limits, require_step
from coupling.export.commands import RobotCommand, commands_of_run
from coupling.export.every_cycle import every_cycle
from coupling.export.exported import ExportedProgram, ExportOptions
from coupling.export.few_points import few_points
from coupling.export.job import ExportJob
from coupling.inverse.joint_limits import JointLimits
from coupling.run.models import Models, cell_of


def export_run(
    folder: Path, options: ExportOptions, watch: Watch = unwatched
) -> tuple[ExportedProgram, ...]:
    """Return the programs of a run's robots.

    Args:
        folder: The run folder.
        options: What is to be written.
        watch: Function that is told how far the work is.

    Raises:
        CouplingError: If the run cannot be read, or as `export_commands`.
    """
    return export_commands(commands_of_run(folder), options, watch)


def export_commands(
    commands: Sequence[RobotCommand], options: ExportOptions, watch: Watch = unwatched
) -> tuple[ExportedProgram, ...]:
    """Return the programs of robots that move at the same time: few points, or a row on every cycle.

    Args:
        commands: The command of each robot.
        options: What is to be written.
        watch: Function that is told how far the work is.

    Raises:
        CouplingError: If a robot cannot do what is asked, or the language not say it.
    """
    first = commands[0]
    cycle = options.cycle or first.controller.cycle
    program = every_cycle if options.language.dense else few_points
    require_step(options.language, cycle)
    robots = [own.placed for own in commands]
    limits = [
        JointLimits.of(own.placed.description, own.controller.max_acceleration) for own in commands
    ]
    for own, limit in zip(commands, limits, strict=True):
        require_joints(options.language, len(own.placed.description.joints))
        require_limits(own.joints, limit, own.who)
    found = []
    with Models(first.fmu, watch) as models:
        cell, _ = cell_of(robots, models)
        for own, member, limit in zip(commands, cell.members, limits, strict=True):
            name = _name(own, options, len(commands) > 1)
            job = ExportJob(own, member, limit, replace(options, name=name, cycle=cycle), watch)
            found.append(program(job))
    return tuple(found)


def _name(own: RobotCommand, options: ExportOptions, several: bool) -> str:
    """Return the name of a robot's program."""
    behind = f"_{own.placed.name}" if several else ""
    if options.name is not None:
        return options.name + behind
    word = "".join(c if c.isascii() and c.isalnum() else "_" for c in own.name)
    word = word if word[:1].isalpha() else f"P{word}"
    return word[: options.language.longest_name - len(behind)] + behind
