"""The command line: elastic-robot build | ssp | couple | compensate | study | report."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

# Small matrices: more BLAS threads only wait for each other.  Set before NumPy is loaded.
for _library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_library, "1")

import typer
from rich.console import Console

from coupling.case import Case, load_case
from coupling.cli_study import study
from coupling.errors import CouplingError
from coupling.events import Progress, Watch
from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu_export.build import BuildOptions, build_fmu, platform_names, remark
from coupling.report import write_report
from coupling.report.study_page import write_study_report
from coupling.run.console import RunView, print_summary
from coupling.run.folder import new_run_folder, write_run
from coupling.run.ssp import write_ssp
from coupling.run.study import Run, run_compensation, run_coupling
from coupling.study.folder import FIGURES
from elastic_robot.errors import ElasticRobotError

CONVERGED, NOT_CONVERGED, BAD_INPUT = 0, 1, 2

app = typer.Typer(
    help="Elastic robot: build its FMU, couple it with a process, compensate its path.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
CaseFile = Annotated[
    Path, typer.Argument(help="The case file, for example examples/cases/cone.toml.")
]
Output = Annotated[
    Path | None, typer.Option("-o", "--output", help="Run folder; results/<case> unless given.")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace a result that is there.")]


@app.command()
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


@app.command()
def ssp(
    case: CaseFile,
    output: Annotated[Path, typer.Option("-o", "--output", help="The archive.")] = Path(
        "system.ssp"
    ),
) -> None:
    """Pack robot and process as one system for a co-simulation master (SSP 1.0)."""
    file = write_ssp(load_case(case), output)
    Console().print(f"{file}: built")


@app.command()
def couple(case: CaseFile, output: Output = None, overwrite: Overwrite = False) -> None:
    """Iterate robot and process until the path they agree on no longer changes."""
    _run(case, output, overwrite, run_coupling)


@app.command()
def compensate(case: CaseFile, output: Output = None, overwrite: Overwrite = False) -> None:
    """Correct the command until the tool follows the desired path."""
    _run(case, output, overwrite, run_compensation)


app.command()(study)


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(help="A run folder, or that of a study.")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="The HTML file.")] = None,
) -> None:
    """Write the report of a run folder or a study anew."""
    write = write_study_report if (folder / FIGURES).exists() else write_report
    Console().print(f"report: {write(folder, output)}", soft_wrap=True)


def _run(
    file: Path, output: Path | None, overwrite: bool, work: Callable[[Case, Watch], Run]
) -> None:
    folder = output or Path("results", file.stem)
    with new_run_folder(folder, overwrite) as scratch, RunView(Console()) as view:
        case = load_case(file, scratch, view.watch)
        run = work(case, view.watch)
        view.watch(Progress("writing the run folder", 0, 2))
        write_run(scratch, case, run)
        view.watch(Progress("writing the report", 1, 2))
        write_report(scratch)
    print_summary(Console(), case, run, folder)
    if not run.correction.converged:
        raise typer.Exit(NOT_CONVERGED)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; exit status 0 converged, 1 not converged, 2 bad input."""
    try:
        app(arguments)
    except (CouplingError, ElasticRobotError) as error:
        text = "\n".join([f"error: {error}", *_notes(error)])
        Console(stderr=True).print(text, style="red", soft_wrap=True, markup=False)
        sys.exit(BAD_INPUT)
    except KeyboardInterrupt as stop:
        kept = _notes(stop) or ["nothing was written"]
        Console(stderr=True).print(f"stopped; {kept[0]}", soft_wrap=True, markup=False)
        sys.exit(130)


def _notes(error: BaseException) -> list[str]:
    """Return what was added to an error on its way here."""
    return getattr(error, "__notes__", [])


if __name__ == "__main__":
    main()
