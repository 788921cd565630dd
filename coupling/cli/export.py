"""The command line: elastic-robot export."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from coupling.cli.console import console
from coupling.errors import ProgramError, one_of
from coupling.path.length_text import format_um

if TYPE_CHECKING:
    from coupling.export.commands import RobotCommand
    from coupling.export.exported_program import ExportedProgram, ExportOptions
    from coupling.programs.languages import Language, Targets

# Exit status where a program loses more than it may; it is written all the same.
_LOSES = 1
# Smallest singular value of the Jacobian below which a posture is called near a singular one.
_NEAR = 0.02


def export(
    source: Annotated[
        Path, typer.Argument(help="A run folder; or, with --robot, a command as CSV: time, q1..")
    ],
    to: Annotated[
        list[str],
        typer.Option("--to", help="Language: krl, rapid, fanuc, csv; again for several."),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Folder; RUN/<language>, or the CSV's name/<language>, unless given. Of several"
            " languages, a folder each in it.",
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(help="Robot of a command as CSV: robot.toml or a shipped robot's name."),
    ] = None,
    wrench: Annotated[
        Path | None,
        typer.Option(
            help="Wrench along the command, with --robot: a CSV, time, fx, .. mz. None unless given."
        ),
    ] = None,
    command: Annotated[
        Path | None,
        typer.Option(help="Command instead of the run's, such as an edited one; CSV."),
    ] = None,
    targets: Annotated[
        str | None, typer.Option(help="cartesian or joints; csv only joints.")
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(help="Name of the program; that of the run or the CSV unless given."),
    ] = None,
    tolerance: Annotated[
        float,
        typer.Option(
            "--tolerance",
            help="Largest deviation from the command at the dynamic robot's tool, in um.",
        ),
    ] = 5.0,
    cycle_ms: Annotated[
        float | None,
        typer.Option(
            "--cycle-ms",
            min=0.1,
            max=1000.0,
            help="Cycle of the controller; the case's, or 4, unless given.",
        ),
    ] = None,
    shortest_ms: Annotated[
        float | None,
        typer.Option(
            "--shortest-ms",
            min=0.1,
            max=10000.0,
            help="Least time between targets. Unless given: krl and rapid 12, fanuc 8, or less"
            " where the tolerance takes that.",
        ),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace existing programs.")
    ] = False,
) -> None:
    """Write a command as robot programs, read them back and simulate them."""
    from coupling.export.exported_program import EXPORT_FOLDER, ExportOptions, write_export
    from coupling.export.exporting import export_commands
    from coupling.files.atomic_folder import require_free
    from coupling.run.console import RunView

    cycle = None if cycle_ms is None else 1e-3 * cycle_ms
    shortest = None if shortest_ms is None else 1e-3 * shortest_ms
    languages = {
        language: ExportOptions(
            _language(language),
            cast("Targets", targets) if targets else _language(language).targets[0],
            name,
            1e-6 * tolerance,
            cycle,
            shortest,
        )
        for language in to
    }
    read = _reader(source, robot, wrench, command)
    file = command or (None if source.is_dir() else source)
    place = source if file is None else file.parent / file.stem
    folders = {
        language: (output or place) / language if output is None or len(languages) > 1 else output
        for language in languages
    }
    for folder in folders.values():
        require_free(folder, EXPORT_FOLDER, overwrite)
    with RunView(console) as view:
        commands = read()
        exports = {
            language: export_commands(commands, options, view.watch)
            for language, options in languages.items()
        }
    for language, programs in exports.items():
        options = languages[language]
        write_export(folders[language], programs, options, overwrite)
        for program in programs:
            for line in _lines(program, options, len(programs) > 1):
                console.print(line)
        console.print(f"Programs: {folders[language]}")
    if file is None and len(commands) == 1:
        learning = ("elastic-robot", "next", str(source), "measured.csv", "-o", f"{source}_next")
        console.print(f"Run it, measure the tool's path, and go on: {shlex.join(learning)}")
    if any(
        program.figures.loss_m > languages[language].tolerance
        for language, programs in exports.items()
        for program in programs
    ):
        raise typer.Exit(_LOSES)


def _language(name: str) -> Language:
    from coupling.programs.languages import LANGUAGES

    if name not in LANGUAGES:
        raise ProgramError(f"--to: {one_of(LANGUAGES, name)}")
    return LANGUAGES[name]


def _reader(
    source: Path, robot: str | None, wrench: Path | None, command: Path | None
) -> Callable[[], tuple[RobotCommand, ...]]:
    """Return what reads the commands of a run, one in place of a run's, or one by itself."""
    from coupling.export.commands import command_in_run, command_of_table, commands_of_run

    if source.is_dir():
        for option, value in (("--robot", robot), ("--wrench", wrench)):
            if value is not None:
                raise ProgramError(
                    f"{option}: expected a command as CSV with this option, got the folder {source},"
                    " which has its own"
                )
        return (
            partial(commands_of_run, source)
            if command is None
            else partial(command_in_run, source, command)
        )
    if command is not None:
        raise ProgramError(f"--command: expected a run folder with this option, got {source}")
    if robot is None:
        what = "a file" if source.exists() else "nothing of that name"
        raise ProgramError(
            f"{source}: expected a run folder, or the CSV of a command with --robot, got {what}"
        )
    return partial(command_of_table, source, robot, wrench)


def _lines(program: ExportedProgram, options: ExportOptions, several: bool) -> Iterator[str]:
    figures = program.figures
    size, shortest = sum(file.bytes for file in figures.files), 1e3 * figures.shortest_time_s
    who = f"{figures.robot} robot: " if several else ""
    yield f"{who}{_verdict(program, options)}"
    yield (
        f"{who}{', '.join(file.name for file in program.files)}: {figures.points} points of"
        f" {figures.points_on_every_cycle}, {size} bytes, at least {shortest:.0f} ms apart"
    )
    loss = f"loss {format_um(figures.loss_m)} um"
    under_command, under_file = figures.deviation_of_command_m, figures.deviation_of_file_m
    if under_command is None or under_file is None:
        yield f"  difference of the tool's paths under the program, read back, and the command: {loss}"
    else:
        yield (
            f"  deviation: {format_um(under_command.maximum)} um under the command,"
            f" {format_um(under_file.maximum)} um under the program, read back; {loss}"
        )
    if not options.language.dense:
        yield f"  {_spacing(program)}"
    if figures.loss_on_joint_lines_m is not None:
        yield (
            f"  loss if the controller does not smooth, drives straight from set point to set point:"
            f" {format_um(figures.loss_on_joint_lines_m)} um"
        )
    if program.remark:
        yield f"  Warning: {program.remark}"
    nearest = figures.nearest_singularity
    near = (
        "Warning: near a singular posture" if nearest.value < _NEAR else "nearest singular posture"
    )
    yield f"  {near}: {nearest.kind}, {nearest.value:.2g} at {nearest.time:.3f} s (0 is singular)"
    if not figures.counted_as_controller:
        yield (
            "  joint angles, flange and base are as defined in the robot file, which has no"
            " [controller]: compare them with the controller's before use"
        )


def _verdict(program: ExportedProgram, options: ExportOptions) -> str:
    """Return whether a program does what the command does, and whether a controller can follow it."""
    loss, most = format_um(program.figures.loss_m), f"{1e6 * options.tolerance:g}"
    if program.figures.loss_m > options.tolerance:
        return (
            f"NOT KEPT: expected a loss of at most {most} um (--tolerance), got {loss} um:"
            f" {program.advice}"
        )
    usual, shortest = options.language.shortest, program.figures.shortest_time_s
    if not options.language.dense and shortest < usual - 1e-6:
        return (
            f"NOT CERTAIN: a controller may not plan targets {1e3 * shortest:.0f} ms apart in time:"
            f" --shortest-ms {1e3 * usual:.0f}"
        )
    return (
        f"KEPT: read back and simulated, the program does what the command does within {loss} um,"
        f" {most} are allowed (--tolerance)."
    )


def _spacing(program: ExportedProgram) -> str:
    """Return how close the targets are."""
    return (
        f"{100 * program.share_of_shortest:.0f} % of the targets are"
        f" {1e3 * program.figures.shortest_time_s:.0f} ms apart, the closest, the median"
        f" {1e3 * program.figures.median_time_s:.0f} ms (--shortest-ms)"
    )
