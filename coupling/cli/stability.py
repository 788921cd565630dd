"""The command line: elastic-robot stability."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from coupling.cli.arguments import CaseFile, Overwrite, Verbose, posture_of, require_angle
from coupling.cli.console import console
from coupling.errors import StabilityError

if TYPE_CHECKING:
    from coupling.results.stability_result import StabilityResult


def stability(
    case: CaseFile,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder; results/<case>_stability unless given."),
    ] = None,
    posture_deg: Annotated[
        str | None,
        typer.Option(metavar="Q1,..,Qn", help="Judge one cut in this posture [deg] alone."),
    ] = None,
    feed_deg: Annotated[
        float | None,
        typer.Option(
            help="Direction of its feed, about the part's z axis from its x axis [deg]; 0."
        ),
    ] = None,
    rpm: Annotated[
        float | None, typer.Option(help="Its speed of the spindle [1/min]; that of the case.")
    ] = None,
    depth_mm: Annotated[
        float | None, typer.Option(help="Its axial depth [mm]; needed beside --posture-deg.")
    ] = None,
    march: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=120.0,
            help="March the cut, or the worst one, in time for so many seconds as well.",
        ),
    ] = 0.0,
    overwrite: Overwrite = False,
    verbose: Verbose = False,
) -> None:
    """Does a milling robot chatter: limiting depth, frequency and growth along its path."""
    import numpy as np

    from coupling.case.file import load_case
    from coupling.case.stability import FASTEST_SPINDLE
    from coupling.files.atomic_folder import FolderKind, require_free, whole_folder
    from coupling.report.report_file import name_path
    from coupling.report.stored_result import write_figures
    from coupling.results.stability_result import FIGURES
    from coupling.run.console import RunView
    from coupling.run.mistaken_units import remark
    from coupling.stability.analysis import stability_along_path, stability_in_posture
    from coupling.stability.case_cut import CaseCuts

    if posture_deg is None and (feed_deg, rpm, depth_mm) != (None, None, None):
        raise StabilityError(
            "--feed-deg, --rpm and --depth-mm: expected them beside --posture-deg, which names one cut"
        )
    for name, number, most in (("--rpm", rpm, FASTEST_SPINDLE), ("--depth-mm", depth_mm, np.inf)):
        if number is not None and not 0.0 < number < np.inf:
            raise StabilityError(f"{name}: expected a number > 0, got {number:g}")
        if number is not None and number > most:
            raise StabilityError(f"{name}: expected at most {most:g} 1/min, got {number:g}")
    if feed_deg is not None:
        require_angle("--feed-deg", feed_deg, StabilityError)
    folder = output or Path("results", f"{case.stem}_stability")
    require_free(folder, kind := FolderKind.of_results("stability"), overwrite)
    with RunView(console) as view:
        cuts = CaseCuts(load_case(case, watch=view.watch))
        if posture_deg is None:
            result = stability_along_path(cuts, view.watch, march)
        else:
            if depth_mm is None:
                raise StabilityError(
                    "--depth-mm: expected the depth of the cut beside --posture-deg"
                )
            posture = np.deg2rad(posture_of(posture_deg, StabilityError))
            speed = cuts.milling.cutter.speed * 30.0 / np.pi if rpm is None else rpm
            feed = np.deg2rad(feed_deg or 0.0)
            placed = cuts.in_posture(posture, float(feed), float(speed), 1e-3 * depth_mm)
            result = stability_in_posture(cuts, placed, view.watch, march)
            said = remark("--rpm", "process.spindle_speed_rpm", float(speed))
            result = result.model_copy(update={"remarks": (*result.remarks, *filter(None, [said]))})
    result = result.model_copy(update={"case_file": name_path(case)})
    with whole_folder(folder, kind, overwrite) as draft:
        write_figures(draft / FIGURES, result)
    print_stability(result, folder, verbose)


def print_stability(result: StabilityResult, folder: Path, verbose: bool) -> None:
    """Say whether a cut chatters and where that stands."""
    from coupling.files.written_files import REPORT
    from coupling.report.stability_report import stability_report
    from coupling.report.terminal import print_report

    print_report(console, stability_report(result), verbose)
    console.print(f"Stability: {folder}  (report: {folder / REPORT})")
