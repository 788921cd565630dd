"""elastic-robot build | ssp: what goes to other masters."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from coupling.case import load_case
from coupling.cli.arguments import CaseFile
from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu_export.build import (
    DEFAULT_KIND,
    BuildOptions,
    build_fmu,
    platform_names,
    remarks,
)
from coupling.fmu_export.core_library import is_ready, platforms_named
from coupling.run.ssp import write_ssp


def build(
    robot: Annotated[str, typer.Option(help="robot.toml or a shipped robot's name.")] = "icme2008",
    output: Annotated[Path, typer.Option("-o", "--output", help="The FMU.")] = Path(
        "ElasticRobot.fmu"
    ),
    kind: Annotated[
        str, typer.Option(help="native: in C, needs nothing; or python, the readable reference.")
    ] = DEFAULT_KIND,
    platforms: Annotated[
        str | None,
        typer.Option(help="linux64,win64,... or all, as native is unless given; python: this one."),
    ] = None,
    sources: Annotated[bool, typer.Option(help="Pack the C sources of a native FMU.")] = False,
    fmi: Annotated[str, typer.Option(help="Version of FMI; 3 for a native FMU.")] = "2",
) -> None:
    """Build the FMU of a robot."""
    unless_given = "all" if kind == "native" else ""
    names = platform_names(unless_given if platforms is None else platforms)
    options = BuildOptions(kind, names, sources, fmi)
    described = load_robot(find_robot(robot))
    if kind == "native":
        _tell_what_is_compiled(names)
    for line in remarks(build_fmu(described, output, options)):
        Console().print(line, soft_wrap=True)


def _tell_what_is_compiled(names: Iterable[str]) -> None:
    waiting = [p.name for p in platforms_named(names) if not is_ready(p)]
    if waiting:
        text = f"compiling the C core for {', '.join(waiting)}: once, for all robots"
        Console().print(text, soft_wrap=True)


def ssp(
    case: CaseFile,
    output: Annotated[Path, typer.Option("-o", "--output", help="The archive.")] = Path(
        "system.ssp"
    ),
) -> None:
    """Pack robot and process as one system for a co-simulation master (SSP 1.0)."""
    file = write_ssp(load_case(case), output)
    Console().print(f"{file}: built")
