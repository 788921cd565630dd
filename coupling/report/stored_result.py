"""Results by their folders, told apart by the files that hold their figures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from coupling.errors import ResultError
from coupling.files.atomic_folder import unfinished_name
from coupling.place.folder import FIGURES as PLACED
from coupling.place.folder import StoredPlacement, read_placement
from coupling.results.modes_result import FIGURES as MODES
from coupling.results.modes_result import ModesResult
from coupling.results.stability_result import FIGURES as STABILITY
from coupling.results.stability_result import StabilityResult
from coupling.run.run_log import is_run
from coupling.run.stored_run import RESULT, StoredRun, read_run
from coupling.study.folder import FIGURES as STUDIED
from coupling.study.stored_study import StoredStudy, read_study

StoredResult = StoredRun | StoredStudy | StoredPlacement | StabilityResult | ModesResult

_READERS: dict[str, Callable[[Path], StoredResult]] = {
    STUDIED: read_study,
    PLACED: read_placement,
    STABILITY: lambda folder: StabilityResult.read(folder / STABILITY, ResultError),
    MODES: lambda folder: ModesResult.read(folder / MODES, ResultError),
    RESULT: read_run,
}


def figures_file(folder: Path) -> Path | None:
    """Return the file with the figures of a folder's result; None where there is none."""
    return next((file for name in _READERS if (file := folder / name).is_file()), None)


def is_result(folder: Path) -> bool:
    """Return whether a folder is that of a result, finished or not."""
    return figures_file(folder) is not None or is_run(folder)


def read_result(folder: str | Path) -> StoredResult:
    """Return a result by its folder: a run, a study, a placement, stability or modes.

    Args:
        folder: The folder.

    Raises:
        CouplingError: If there is none, or it is damaged.
    """
    folder = Path(folder)
    file = figures_file(folder)
    if file is None and (is_run(folder) or is_run(unfinished_name(folder.resolve()))):
        return read_run(folder)  # says why there is no result yet
    if file is None:
        raise ResultError(
            f"{folder}: expected the folder of a run, a study, a placement, of stability or modes"
        )
    return _READERS[file.name](folder)
