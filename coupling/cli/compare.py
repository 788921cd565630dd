"""The command line: elastic-robot compare."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupling.cli.console import console
from coupling.errors import ResultError
from coupling.files.output_file import require_output

_FILE = Path("comparison.html")


def compare(
    first: Annotated[Path, typer.Argument(metavar="A", help="A run folder.")],
    second: Annotated[Path, typer.Argument(metavar="B", help="Another one, of the same robots.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The HTML file.")] = _FILE,
) -> None:
    """Compare two run folders: results, commands and inputs that differ."""
    from coupling.report.compare_report import comparison_summary, write_comparison
    from coupling.report.comparison import Comparison
    from coupling.report.terminal import print_sections

    require_output(output, ".html", ResultError)
    comparison = Comparison.of(first, second)
    page = write_comparison(comparison, output)
    print_sections(console, comparison_summary(comparison))
    console.print(f"Page: {page}")
