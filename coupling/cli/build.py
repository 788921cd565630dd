"""elastic-robot build | ssp: what goes to other masters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupling.cli.arguments import CaseFile
from coupling.cli.console import console
from coupling.errors import BuildError
from coupling.files.output_file import require_output

Platforms = Annotated[
    str | None,
    typer.Option(
        help="linux64,win64,... or all; what the installation has or this one, unless given."
    ),
]


def build(
    robot: Annotated[str, typer.Option(help="robot.toml or a shipped robot's name.")] = "icme2008",
    output: Annotated[Path, typer.Option("-o", "--output", help="The FMU.")] = Path(
        "ElasticRobot.fmu"
    ),
    kind: Annotated[
        str,
        typer.Option(help="native: in C, without dependencies; or python, the readable reference."),
    ] = "native",
    platforms: Platforms = None,
    sources: Annotated[bool, typer.Option(help="Pack the C sources of a native FMU.")] = False,
    fmi: Annotated[str, typer.Option(help="Version of FMI; 3 for a native FMU.")] = "2",
    arrays: Annotated[
        bool, typer.Option("--arrays", help="One array for what belongs together, in FMI 3.")
    ] = False,
    dependencies: Annotated[
        str,
        typer.Option(
            help="Dependencies of outputs on inputs: point, at one instant (none); step,"
            " over a step."
        ),
    ] = "point",
    name: Annotated[
        str, typer.Option(help="Name of the model and its identifier: letters, digits, _.")
    ] = "ElasticRobot",
) -> None:
    """Build the FMU of a robot."""
    from coupling.files.robot_file import find_robot, load_robot
    from coupling.fmu_export.build import BuildOptions, build_fmu, remarks

    require_output(output, ".fmu", BuildError)  # before the work that would be lost
    described = load_robot(find_robot(robot))
    options = BuildOptions(
        kind, _require_platforms(platforms, kind), sources, fmi, arrays, name, dependencies
    )
    for line in remarks(build_fmu(described, output, options), name):
        console.print(line)
    if kind == "native" and platforms is None and len(options.platforms) == 1:
        console.print("This machine's platform alone: --platforms all for the others, too")


def ssp(
    case: CaseFile,
    output: Annotated[Path, typer.Option("-o", "--output", help="The archive.")] = Path(
        "system.ssp"
    ),
    platforms: Platforms = None,
    force_only: Annotated[
        bool,
        typer.Option("--force-only", help="Leave the robot's contact spring unconnected."),
    ] = False,
    step: Annotated[
        float | None,
        typer.Option(help="Communication step [s]; the longest safe one unless given."),
    ] = None,
) -> None:
    """Pack robot and process as one system for a co-simulation master (SSP 1.0)."""
    from coupling.case.file import load_case
    from coupling.fmu_export.ssp import SspSystem
    from coupling.run.execute import coupled_path

    require_output(output, ".ssp", BuildError)  # before the work that would be lost
    loaded = load_case(case)
    system = SspSystem.of(loaded, "force" if force_only else "spring", step)
    file = system.write(output, _require_platforms(platforms, loaded.fmu))
    for line in (f"{file}: built", *system.remarks()):
        console.print(line)
    console.print("Simulating what the step costs")
    for line in system.costs(coupled_path(loaded)):
        console.print(line)


def _require_platforms(platforms: str | None, kind: str) -> tuple[str, ...]:
    """Return the platforms to build for, and say which libraries have to be compiled first."""
    from coupling.fmu_export.build import platform_names
    from coupling.native.core_library import is_ready, platforms_named, usual_platforms

    if kind != "native":
        return platform_names(platforms or "")
    chosen = usual_platforms() if platforms is None else platforms_named(platform_names(platforms))
    waiting = [p.name for p in chosen if not is_ready(p)]
    if waiting:
        text = f"compiling the C core for {', '.join(waiting)}: once, for all robots"
        console.print(text)
    return tuple(p.name for p in chosen)
