"""A folder that one command writes as a whole."""

from __future__ import annotations

from pathlib import Path

from coupling.errors import ResultError, reason_of
from coupling.files.written_files import begin_folder, is_free, is_of_kind, remove_written


def begin_result(folder: Path, kind: str, overwrite: bool) -> None:
    """Make a folder for the result of a command, in the place of an earlier one where that may be.

    Args:
        folder: The folder.
        kind: Kind of the result, such as "modes".
        overwrite: An earlier result may be replaced.

    Raises:
        ResultError: If it holds something else, a result that may not be replaced, or cannot be written.
    """
    try:
        if folder.exists() and not folder.is_dir():
            raise ResultError(f"{folder}: expected the name of a folder, got a file")
        if folder.exists() and not is_free(folder):
            if not is_of_kind(folder, kind):
                raise ResultError(
                    f"{folder}: holds files that are not of elastic-robot {kind}: name another folder"
                )
            if not overwrite:
                raise ResultError(
                    f"{folder}: holds a result already: add --overwrite to replace it"
                )
            remove_written(folder)
        begin_folder(folder, kind)
    except OSError as cause:
        raise ResultError(f"{folder}: cannot be written: {reason_of(cause)}") from cause
