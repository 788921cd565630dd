"""elastic-robot build | ssp: what goes to other masters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from coupling.case import load_case
from coupling.cli.arguments import CaseFile
from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu_export.build import BuildOptions, build_fmu, platform_names, remark
from coupling.run.ssp import write_ssp


def build(
    robot: Annotated[str, typer.Option(help="robot.toml or a shipped robot's name.")] = "icme2008",
    output: Annotated[Path, typer.Option("-o", "--output", help="The FMU.")] = Path(
        "ElasticRobot.fmu"
    ),
    kind: Annotated[str, typer.Option(help="python, or native: in C, needs nothing.")] = "python",
    platforms: Annotated[
        str, typer.Option(help="To compile for: linux64,win64,... or all; this machine.")
    ] = "",
    sources: Annotated[bool, typer.Option(help="Pack the C sources of a native FMU.")] = False,
    fmi: Annotated[str, typer.Option(help="Version of FMI; 3 for a native FMU.")] = "2",
) -> None:
    """Build the FMU of a robot."""
    options = BuildOptions(kind, platform_names(platforms), sources, fmi)
    file = build_fmu(load_robot(find_robot(robot)), output, options)
    for line in filter(None, (f"{file}: built", remark(file))):
        Console().print(line, soft_wrap=True)


def ssp(
    case: CaseFile,
    output: Annotated[Path, typer.Option("-o", "--output", help="The archive.")] = Path(
        "system.ssp"
    ),
) -> None:
    """Pack robot and process as one system for a co-simulation master (SSP 1.0)."""
    file = write_ssp(load_case(case), output)
    Console().print(f"{file}: built")
