"""elastic-robot learn: parameters of the robot one has from measured runs, and the next command."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from coupling.cli.arguments import (
    STORE,
    MeasuredRuns,
    NoStore,
    Overwrite,
    OwnFrame,
    StoreFolder,
    pairs_of,
    store_folder,
)
from coupling.cli.console import console
from coupling.cli.runs import NOT_CONVERGED, print_run
from coupling.errors import CaseError, LearnError
from coupling.files.atomic_file import write_atomically
from coupling.files.output_file import require_output


def learn(
    runs: MeasuredRuns,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Robot file, with the report in the same folder."),
    ] = None,
    own_frame: OwnFrame = False,
    next_run: Annotated[
        Path | None,
        typer.Option("--next", help="Run folder of the next command; named as the robot file."),
    ] = None,
    no_next: Annotated[bool, typer.Option("--no-next", help="Compute no next command.")] = False,
    draws: Annotated[
        int,
        typer.Option(
            min=0,
            max=1000,
            help="Number of simulated robots for the intervals; 0: those of the fit.",
        ),
    ] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of these robots.")] = 1,
    overwrite: Overwrite = False,
    store: StoreFolder = None,
    no_store: NoStore = False,
) -> None:
    """Learn backlash, stiffness and damping from measured runs, and compute the next command."""
    from coupling.cli.fitted import robot_target, write_findings, write_robot
    from coupling.conduct import conduct
    from coupling.files.toml_file import load_toml
    from coupling.identification.next.inputs import next_case_text
    from coupling.identification.runs.learning import LearnOptions
    from coupling.identification.runs.learning import learn as learned
    from coupling.identification.runs.measurement import read_measurement
    from coupling.identification.runs.results import figures, learned_text
    from coupling.identification.runs.source import read_source
    from coupling.report.learn_report import learn_page, learn_summary
    from coupling.run.console import RunView
    from coupling.run.execute import run_compensation
    from coupling.run.models import Models
    from coupling.run.new_folder import require_free
    from coupling.run.run_log import is_to_go_on

    pairs = pairs_of(runs)
    target = robot_target(output, f"{pairs[0][1].stem}_learned", LearnError)
    if draws == 1:
        raise LearnError("--draws: expected 0, or 2 or more, got 1")
    if next_run is not None and no_next:
        raise LearnError("expected either --next or --no-next, got both")
    folder = next_run or target.with_name(target.stem)
    case = target.with_name(f"{target.stem}_case.toml")
    require_output(case, ".toml", LearnError)
    if not no_next:  # before the work that would be lost
        require_free(folder, overwrite or is_to_go_on(folder, "compensate", case))
    sources = [read_source(folder, read_measurement(file)) for folder, file in pairs]
    start = sources[0].file
    if start.resolve() == target.resolve():
        raise LearnError(f"{target}: expected another file than the run's robot file")
    with RunView(console) as view, Models("native", view.watch) as models:
        learned_result = learned(sources, LearnOptions(own_frame, draws, seed), models, view.watch)
    result = figures(learned_result)
    title = f"{start.stem} learned from {' and '.join(file.name for _, file in pairs)}"
    page = learn_page(title, result)
    write_findings(target, result, learn_summary(result), page, LearnError)
    write_robot(target, learned_text(learned_result, target), LearnError)
    last = pairs[-1][0]
    text = next_case_text(load_toml(last / "case.toml", CaseError), target)
    write_atomically(case, f"# Case of {target.name}, by elastic-robot learn\n\n{text}", LearnError)
    if no_next:
        console.print(f"Next command: elastic-robot compensate {shlex.quote(str(case))}")
        return
    evaluations = store_folder(
        folder, store or (None if no_store else last.parent / STORE), no_store
    )
    with RunView(console) as view:
        finished = conduct(
            case, folder, overwrite, evaluations, "compensate", run_compensation, view.watch
        )
    print_run(finished, folder)
    if not finished.run.correction.converged:
        raise typer.Exit(NOT_CONVERGED)
