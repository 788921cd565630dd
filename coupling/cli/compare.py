"""The command line: elastic-robot compare."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupling.cli.arguments import Columns, OwnFrame, Unit, Verbose, column_choice
from coupling.cli.console import console
from coupling.errors import ResultError
from coupling.events import Progress
from coupling.files.output_file import require_output

_FILE = Path("comparison.html")


def compare(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN [MEASURED]",
            help="Run folders of the same robots, each followed by the file of the path that was"
            " measured under it, if any.",
        ),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="The HTML file.")] = _FILE,
    own_frame: OwnFrame = False,
    columns: Columns = None,
    unit: Unit = None,
    verbose: Verbose = False,
) -> None:
    """Compare runs, and what was measured under them: results, commands and inputs that differ."""
    from coupling.report.compare_report import comparison_report
    from coupling.report.comparison import Comparison
    from coupling.report.report_file import write_page
    from coupling.report.terminal import print_report
    from coupling.run.console import RunView

    with RunView(console) as view:
        require_output(output, ".html", ResultError)
        view.watch(Progress("reading runs and measurements", 0, 1))
        comparison = Comparison.of(runs, own_frame, column_choice(columns, unit))
        view.watch(Progress("drawing the page", 0, 1))
        report = comparison_report(comparison)
        write_page(output, report.page, ResultError)
    print_report(console, report, verbose)
    for _, measured in sorted(comparison.measured.items()):
        if measured.run.measured.understood is not None:
            console.print(f"{measured.file}: {measured.run.measured.understood.sentence}.")
    console.print(f"Page: {output}")
