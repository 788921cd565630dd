"""The command line: elastic-robot study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupling.cli.arguments import DespiteChatter, NoStore, StoreFolder, Verbose, store_folder
from coupling.cli.console import console
from coupling.cli.runs import NOT_CONVERGED, ended_by_chatter
from coupling.events import Progress, Watch


def study(
    case: Annotated[Path, typer.Argument(help="The case file; [study] says what is uncertain.")],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder; results/<case>_study unless given."),
    ] = None,
    run: Annotated[
        Path | None,
        typer.Option(help="Run folder with the command; computed first unless given."),
    ] = None,
    samples: Annotated[int | None, typer.Option(help="Number of robots; as in the case.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the design; as in the case.")] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes of the local cluster; one for each core.")
    ] = None,
    scheduler: Annotated[str, typer.Option(help="Dask cluster to use, tcp://host:port.")] = "",
    couple: Annotated[
        bool, typer.Option("--couple", help="Evaluate the process for every robot as well.")
    ] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Start a study anew.")] = False,
    store: StoreFolder = None,
    no_store: NoStore = False,
    despite_chatter: DespiteChatter = False,
    verbose: Verbose = False,
) -> None:
    """Sample uncertain robots and simulate the command on each; an interrupted study is resumed."""
    from coupling.case.file import load_case
    from coupling.files.written_files import REPORT
    from coupling.report.report_file import name_path
    from coupling.report.study_report import study_report
    from coupling.report.terminal import print_report
    from coupling.run.console import RunView
    from coupling.run_to_folder import limits_to_folder
    from coupling.study.conduct import changed_table, open_study, simulate_samples
    from coupling.study.findings import read_study, write_findings
    from coupling.study.folder import RUN, lock_folder
    from coupling.study.robot_pool import Workers

    folder = output or Path("results", f"{case.stem}_study")
    crew = Workers(scheduler=scheduler) if workers is None else Workers(workers, scheduler)
    evaluations = store_folder(folder, store, no_store)
    loaded = load_case(case)
    table = changed_table(loaded.study, samples=samples, seed=seed)
    with (
        ended_by_chatter(folder / RUN, verbose),
        lock_folder(folder, overwrite),
        RunView(console, verbose) as view,
    ):
        if not despite_chatter:
            words = ("study", name_path(case))
            limits_to_folder(case, folder / RUN, True, "compensate", words, view.watch)
        place = run or _own_run(case, folder / RUN, evaluations, view.watch)
        study_folder = open_study(folder, loaded, table, place, couple, evaluations)
        result = simulate_samples(study_folder, crew, view.watch)
        view.watch(Progress("writing the report", 1, 2))
        write_findings(study_folder, result)
        stored = read_study(folder)
        report = study_report(stored)
        report.write(folder)
    print_report(console, report, verbose)
    console.print(f"Study: {folder}  (report: {folder / REPORT})")
    if not stored.figures.command.converged:
        raise typer.Exit(NOT_CONVERGED)


def _own_run(file: Path, folder: Path, store: Path | None, watch: Watch) -> Path:
    """Return the run folder of a study, whose command is computed unless it was before."""
    from coupling.run.execute import run_compensation
    from coupling.run.stored_run import RESULT
    from coupling.run_to_folder import run_to_folder

    if not (folder / RESULT).exists():
        # What may be there are the limits of a cut that chattered.
        run_to_folder(file, folder, True, store, "compensate", run_compensation, watch)
    return folder
