"""The command line: elastic-robot init."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from coupling.cli.console import console
from coupling.errors import CaseError


def _robots() -> list[str]:
    from coupling.files.robot_file import shipped_robots

    return list(shipped_robots())


def _processes() -> list[str]:
    from coupling.check.new_case import STARTS

    return list(STARTS)


def init(
    folder: Annotated[
        Path | None, typer.Argument(help="Folder to create; optional with --list.")
    ] = None,
    robot: Annotated[
        str,
        typer.Option(
            help="A shipped robot, a robot file, or a URDF, xacro or MJCF file or a name of"
            " robot_descriptions, for which a robot file is written.",
            autocompletion=_robots,
        ),
    ] = "icme2008",
    process: Annotated[
        str, typer.Option(help="Process, as listed by --list.", autocompletion=_processes)
    ] = "isf-force-law",
    two_robots: Annotated[
        bool, typer.Option("--two-robots", help="A second robot supports the sheet from behind.")
    ] = False,
    tip: Annotated[
        str | None, typer.Option(help="Link behind the last joint of a URDF; guessed unless given.")
    ] = None,
    base: Annotated[
        str | None, typer.Option(help="Link before its first joint; guessed unless given.")
    ] = None,
    payload_class: Annotated[
        str | None,
        typer.Option(
            help="Class of its gears: light, small, medium or heavy; guessed by its size unless given."
        ),
    ] = None,
    tolerance_mm: Annotated[
        float | None,
        typer.Option(help="How far the tool may be off its path [mm]; reports judge by it."),
    ] = None,
    listed: Annotated[
        bool,
        typer.Option("--list", help="List available processes and robots, create nothing."),
    ] = False,
) -> None:
    """Create a folder with a case that runs as it is, to be changed into your own."""
    from coupling.check.new_case import CASE, new_case, write_case
    from coupling.check.new_robot import RobotChoice

    if listed:
        for line in _list():
            console.print(line)
        return
    if folder is None:
        raise typer.BadParameter("expected the folder to create, or --list, got neither")
    if tolerance_mm is None and _can_ask():
        tolerance_mm = asked_tolerance(typer.prompt(_ASKED, default="", show_default=False))
    links = RobotChoice(base, tip, payload_class)
    case = new_case(robot, process, two_robots, folder, links, tolerance_mm)
    file = write_case(case, folder)
    has_case = CASE in case.texts
    command = "check" if has_case else "robots"
    for line in (
        f"{file}: {case.about}",
        *(f"{folder / name}: used by it" for name in case.texts if name != file.name),
        *case.remarks,
        *([] if tolerance_mm is not None or not has_case else [_QUESTION]),
        f"Next: elastic-robot {command} {shlex.quote(str(file))}",
    ):
        console.print(line)
    if not has_case:
        raise typer.Exit(1)


def _can_ask() -> bool:
    """Return whether somebody can answer; a notebook's terminal takes no answers."""
    return sys.stdin is not None and sys.stdin.isatty() and "JPY_PARENT_PID" not in os.environ


_ASKED = "How far may the tool be off its path [mm]? Reports judge by it (Enter: not known yet)"
_QUESTION = (
    "How far may the tool be off its path? State it as tolerance_mm in [part] (or by --tolerance-mm):"
    " reports judge by it."
)


def asked_tolerance(text: str) -> float | None:
    """Return the tolerance [mm] that was typed; None for an empty line.

    Example:
        >>> asked_tolerance(" 0,2 mm"), asked_tolerance("")
        (0.2, None)
    """
    number = text.strip().removesuffix("mm").strip().replace(",", ".")
    try:
        return float(number) if number else None
    except ValueError as cause:
        raise CaseError(f"tolerance: expected a length [mm] such as 0.2, got {text!r}") from cause


def _list() -> Iterator[str]:
    from coupling.check.new_case import STARTS
    from coupling.files.robot_file import robot_numbers, shipped_robots

    yield "--process:"
    for name, start in STARTS.items():
        cell = "; also with --two-robots" if start.cell else ""
        yield f"  {name}: {start.about}{cell}"
    yield "--robot:"
    for name, file in shipped_robots().items():
        yield f"  {name}: {robot_numbers(file)[0]}"
