"""The folder of exported programs, whole or not at all, with a summary beside them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from coupling.errors import ProgramError
from coupling.export.exported_program import ExportedProgram, ExportOptions
from coupling.files.atomic_folder import FolderKind, whole_folder
from coupling.files.written_files import claim, is_of_kind
from coupling.results.export_result import ExportResult

SUMMARY = "export.json"
# Kind of the folder.
_FOLDER_KIND = "export"


def is_export(folder: Path) -> bool:
    """Return whether a folder holds exported programs."""
    return is_of_kind(folder, _FOLDER_KIND) or (folder / SUMMARY).is_file()


EXPORT_FOLDER = FolderKind(_FOLDER_KIND, "an export", ProgramError, is_export)


def write_export(
    folder: Path, exports: Sequence[ExportedProgram], options: ExportOptions, overwrite: bool
) -> None:
    """Write programs and their summary, in the place of those that are there."""
    contents = dict(_contents(exports, options))
    with whole_folder(folder, EXPORT_FOLDER, overwrite) as draft:
        claim(draft, contents)
        for name, text in contents.items():
            (draft / name).write_bytes(text.encode())


def _contents(
    exports: Sequence[ExportedProgram], options: ExportOptions
) -> Iterator[tuple[str, str]]:
    for program in exports:
        for file in program.files:
            yield file.name, file.text
    result = ExportResult(
        language=options.language.name,
        targets=options.targets,
        tolerance_m=options.tolerance,
        robots=tuple(program.figures for program in exports),
    )
    yield SUMMARY, result.text()
