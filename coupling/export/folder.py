"""The folder of exported programs, whole or not at all, with a summary beside them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from coupling.errors import ProgramError
from coupling.export.exported_program import ExportedProgram, ExportOptions
from coupling.files.atomic_folder import FolderKind, whole_folder
from coupling.files.written_files import claim, is_of_kind
from coupling.results.export_result import ExportedFileResult, ExportedProgramResult, ExportResult

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
        robots=tuple(map(_program_result, exports)),
    )
    yield SUMMARY, result.text()


def _program_result(export: ExportedProgram) -> ExportedProgramResult:
    return ExportedProgramResult(
        robot=export.robot,
        program=export.program.name,
        files=tuple(
            ExportedFileResult(name=file.name, bytes=len(file.text)) for file in export.files
        ),
        points=export.points,
        points_on_every_cycle=export.candidates,
        points_tolerance_m=export.points_tolerance,
        shortest_time_s=export.shortest,
        median_time_s=export.median,
        loss_m=export.loss,
        loss_on_joint_lines_m=export.loss_on_joint_lines,
        deviation_of_command_m=export.command,
        deviation_of_file_m=export.read_back,
        base=export.program.base,
        tool=export.program.tool,
        counted_as_controller=export.counted,
        nearest_singularity=export.nearest,
        drives=export.drives,
    )
