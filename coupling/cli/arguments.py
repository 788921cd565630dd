"""Arguments and options that several commands have."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from coupling.errors import LearnError, StoreError

if TYPE_CHECKING:
    from coupling.identification.runs.recorded_columns import ColumnChoice

# Name of the store beside the run folders.
STORE = "store"
# Beyond ten turns an angle is a mistake [deg].
_MOST_TURNED = 3600.0

CaseFile = Annotated[
    Path, typer.Argument(help="The case file, for example examples/cases/cone.toml.")
]
Output = Annotated[
    Path | None, typer.Option("-o", "--output", help="Run folder; results/<case> unless given.")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing result.")]
StoreFolder = Annotated[
    Path | None,
    typer.Option("--store", help="Store of evaluations; 'store' beside the run folder."),
]
NoStore = Annotated[
    bool, typer.Option("--no-store", help="Evaluate the process every time, store nothing.")
]
DespiteChatter = Annotated[
    bool,
    typer.Option(
        "--despite-chatter", help="Compute a milling cut as well that is found to chatter at once."
    ),
]
Verbose = Annotated[
    bool, typer.Option("-v", "--verbose", help="Print all that the report says, too.")
]
MeasuredRuns = Annotated[
    list[Path],
    typer.Argument(
        metavar="RUN MEASURED",
        help="Run folder of a command and a file of the tool's measured path under it: CSV, what a"
        " laser tracker exports, a KUKA trace, a bag of ROS; then later measured runs.",
    ),
]
Columns = Annotated[
    str | None,
    typer.Option(
        metavar="QUANTITY=COLUMN,..",
        help="Columns of a device's file for time, x, y, z, qx .. qw, or a bag's topic; by their names"
        " unless given.",
    ),
]
Unit = Annotated[
    str | None,
    typer.Option(
        metavar="UNIT,..", help="Units of its columns that state none, such as mm or mm,ms."
    ),
]
OwnFrame = Annotated[
    bool, typer.Option("--own-frame", help="The pose of the measuring frame is unknown.")
]


def numbers_of(
    option: str, text: str, error: type[Exception], count: int | None = None
) -> list[float]:
    """Return the numbers of an option, between commas.

    Args:
        count: Number of them; None: any.

    Example:
        >>> numbers_of("--posture-deg", "0, 10,-20.5", ValueError)
        [0.0, 10.0, -20.5]
    """
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError as cause:
        raise error(f"{option}: expected numbers between commas, got {text!r}") from cause
    if not all(map(math.isfinite, numbers)):
        raise error(f"{option}: expected finite numbers, got {text!r}")
    if count is not None and len(numbers) != count:
        raise error(f"{option}: expected {count} numbers, got {len(numbers)}")
    return numbers


def posture_of(text: str, error: type[Exception], count: int | None = None) -> list[float]:
    """Return the joint angles of a posture [deg].

    Args:
        text: Value of --posture-deg.
        error: Raised if it is something else, or turned more often than any joint can be.
        count: Number of them; None: any.
    """
    angles = numbers_of("--posture-deg", text, error, count)
    for angle in angles:
        require_angle("--posture-deg", angle, error)
    return angles


def require_angle(option: str, angle: float, error: type[Exception]) -> None:
    """Refuse an angle [deg] that is none of a machine."""
    if not abs(angle) <= _MOST_TURNED:
        raise error(f"{option}: expected at most {_MOST_TURNED:g} deg, got {angle:g}")


def column_choice(columns: str | None, unit: str | None) -> ColumnChoice | None:
    """Return the columns that options name; None where they name none."""
    from coupling.identification.runs.recorded_columns import ColumnChoice

    return ColumnChoice.of(columns, unit) if columns or unit else None


def pairs_of(runs: Sequence[Path]) -> list[tuple[Path, Path]]:
    """Return each run folder with the file of what was measured."""
    if len(runs) % 2:
        raise LearnError(
            f"expected pairs of a run folder and a measured path, got {len(runs)} names"
        )
    return list(zip(runs[::2], runs[1::2], strict=True))


def store_folder(run_folder: Path, store: Path | None, no_store: bool) -> Path | None:
    """Return the folder of the store of a run, None where it is to have none.

    Raises:
        StoreError: If the options contradict each other, or the store would be lost with the run.
    """
    from coupling.run.run_log import is_run

    if no_store:
        if store is not None:
            raise StoreError("expected either --store or --no-store, got both")
        return None
    folder = store or run_folder.parent / STORE
    if folder.resolve().is_relative_to(run_folder.resolve()):
        raise StoreError(
            f"{folder}: the store is in the run folder, which --overwrite replaces: name another folder"
            " with --store"
        )
    if is_run(folder):
        raise StoreError(f"{folder}: expected a store of evaluations, got a run folder")
    return folder
