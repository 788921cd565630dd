"""A folder that one command writes as a whole, such as that of modes."""

from __future__ import annotations

from coupling.errors import ResultError
from coupling.files.atomic_folder import FolderKind
from coupling.files.written_files import is_of_kind


def result_folder_kind(kind: str) -> FolderKind:
    """Return the kind of the folder that a command writes."""
    return FolderKind(kind, "a result", ResultError, lambda folder: is_of_kind(folder, kind))
