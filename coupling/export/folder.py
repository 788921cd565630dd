"""The folder of exported programs, whole or not at all, with a summary beside them.

Programs are written beside their folder, in `.<name>.unfinished`, and change places with those that are
there when they are complete and on the disk.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from coupling.errors import ProgramError
from coupling.export.exported import ExportedProgram, ExportOptions
from coupling.files.atomic_file import AtomicFile, require_writable_place, writing
from coupling.files.atomic_folder import (
    exclusively,
    finish_replacement,
    replace_folder,
    replaced_name,
)
from coupling.files.written_files import begin_folder, claim, is_free, is_of_kind, remove_written
from coupling.results.export_result import ExportResult

SUMMARY = "export.json"
# Kind of the folder.
_KIND = "export"


def is_export(folder: Path) -> bool:
    """Return whether a folder holds exported programs."""
    return is_of_kind(folder, _KIND) or (folder / SUMMARY).is_file()


def require_writable(folder: Path, overwrite: bool) -> None:
    """Refuse a folder that holds something else, or programs that may not be replaced.

    Raises:
        ProgramError: With the folder.
    """
    # Programs that a killed export had put aside are still those of the folder.
    place = folder if folder.exists() else replaced_name(folder.resolve())
    if not place.exists():
        require_writable_place(folder, ProgramError)
        return
    if not place.is_dir():
        raise ProgramError(f"{folder}: expected the name of a folder, got a file")
    if is_free(place):
        return
    if not is_export(place):
        raise ProgramError(f"{folder}: holds files that are no export: name another folder")
    if not overwrite:
        raise ProgramError(f"{folder}: holds programs already: add --overwrite to replace them")


def write_export(
    folder: Path, exports: Sequence[ExportedProgram], options: ExportOptions, overwrite: bool
) -> None:
    """Write programs and their summary, in the place of those that are there.

    Raises:
        ProgramError: If the folder may not be replaced or cannot be written.
    """
    target = folder.resolve()
    draft = target.with_name(f".{target.name}.unfinished")
    with exclusively(folder, ProgramError), writing(folder, ProgramError):
        finish_replacement(target)
        require_writable(folder, overwrite)
        remove_written(draft)  # of an export that was killed
        try:
            contents = dict(_contents(exports, options))
            begin_folder(draft, _KIND)
            claim(draft, contents)
            for name, text in contents.items():
                AtomicFile(draft / name).write([text.encode()])
            replace_folder(draft, target)
        finally:
            remove_written(draft)


def _contents(
    exports: Sequence[ExportedProgram], options: ExportOptions
) -> Iterator[tuple[str, str]]:
    """Yield names and texts of all files."""
    for program in exports:
        for file in program.files:
            yield file.name, file.text
    yield SUMMARY, ExportResult.of(options, robots=exports).text()
