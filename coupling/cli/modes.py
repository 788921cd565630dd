"""The command line: elastic-robot modes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupling.cli.arguments import Overwrite, Verbose, numbers_of, posture_of
from coupling.cli.console import console
from coupling.errors import StabilityError
from coupling.events import Progress

# No tool is pushed harder [N].
_MOST_FORCE = 1e9


def modes(
    case_or_robot: Annotated[
        str, typer.Argument(help="A case file, a shipped robot's name or a robot file.")
    ],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder; results/<case>_modes unless given."),
    ] = None,
    posture_deg: Annotated[
        str | None,
        typer.Option(metavar="Q1,..,Qn", help="Joint angles [deg]; of a case its path's."),
    ] = None,
    force_N: Annotated[
        str | None,
        typer.Option(
            "--force-n",
            metavar="X,Y,Z",
            help="Force on the tool [N], base axes, with --posture-deg; it presses gears to a flank.",
        ),
    ] = None,
    measured: Annotated[
        Path | None,
        typer.Option(
            help="Measured frequency responses, CSV or UFF58, or a hammer test, beside the model's."
        ),
    ] = None,
    overwrite: Overwrite = False,
    verbose: Verbose = False,
) -> None:
    """Eigenfrequencies, damping and compliance of a robot along a case's path or in a posture."""
    import numpy as np

    from coupling.case.file import load_case
    from coupling.case.robots import resolved_description
    from coupling.files.atomic_folder import FolderKind, require_free, whole_folder
    from coupling.files.robot_file import find_robot, load_robot
    from coupling.files.toml_file import load_toml
    from coupling.files.written_files import REPORT, begin_folder, claimed_folder
    from coupling.modes.analysis import modes_in_posture, modes_of_case
    from coupling.modes.hammer_test import read_measured
    from coupling.modes.state_space import NamedStateSpace
    from coupling.modes.swinging_robot import swinging_robot
    from coupling.path.frame import AT_THE_ORIGIN
    from coupling.report.modes_report import modes_report
    from coupling.report.report_file import name_path
    from coupling.report.stored_result import write_figures
    from coupling.report.terminal import print_report
    from coupling.results.modes_result import FIGURES
    from coupling.run.console import RunView

    file = Path(case_or_robot)
    folder = output or Path("results", f"{file.stem}_modes")
    require_free(folder, kind := FolderKind.of_results("modes"), overwrite)
    responses = () if measured is None else read_measured(measured)
    is_case = file.suffix == ".toml" and "tool_path" in load_toml(file, StabilityError)
    case = load_case(file) if is_case else None
    if posture_deg is None and case is None:
        raise StabilityError(
            f"{case_or_robot}: a robot alone has no posture: add --posture-deg, or name a case file"
        )
    if force_N is not None and posture_deg is None:
        raise StabilityError("--force-n: expected it beside --posture-deg")
    if posture_deg is None:
        assert case is not None
        with RunView(console) as view:
            view.watch(Progress("modes along the path and over the part", 0, 1))
            analyses = [
                modes_of_case(case, () if number else responses, number)
                for number in range(len(case.robots))
            ]
    else:
        force = numbers_of("--force-n", force_N or "0,0,0", StabilityError, 3)
        if np.abs(force).max() > _MOST_FORCE:
            raise StabilityError(f"--force-n: expected at most {_MOST_FORCE:g} N, got {force_N}")
        robot, curve = (
            (load_robot(find_robot(case_or_robot)), "backlash")
            if case is None
            else (case.robots[0].description, case.robots[0].torque_curve)
        )
        posture = np.deg2rad(posture_of(posture_deg, StabilityError))
        wrench = np.append(force, np.zeros(3))
        analyses = [modes_in_posture(robot, curve, posture, wrench, responses)]
    if case is None:
        robots = [("", resolved_description(case_or_robot, Path()), robot, AT_THE_ORIGIN)]
    else:
        # The second robot of a cell is written in a folder of its name.
        robots = [
            (
                placed.name if number else "",
                case.resolved[placed.table]["description"],
                placed.description,
                placed.world_from_base,
            )
            for number, placed in enumerate(case.robots[: len(analyses)])
        ]
    results = []
    with whole_folder(folder, kind, overwrite) as draft:
        for (name, description, robot, base), analysis in zip(robots, analyses, strict=True):
            place = draft
            if name:
                place = claimed_folder(draft / name)
                begin_folder(place, kind.name)
            softest = analysis.softest
            swinging = swinging_robot(robot, description, softest.q, softest.linear.modes, base)
            source = name_path(file) if file.exists() else case_or_robot
            result = analysis.result.model_copy(update={"swinging": swinging, "source": source})
            results.append((place.relative_to(draft), result))
            NamedStateSpace.of(softest.linear).write(place)
            write_figures(place / FIGURES, result)
    for part, result in results:
        print_report(console, modes_report(result), verbose)
        console.print(f"Modes: {folder / part}  (report: {folder / part / REPORT})")
