"""Where a page is written: into a folder of a command, or under a name that the user gives."""

from __future__ import annotations

from pathlib import Path

from coupling.files.atomic_file import make_folder_of, write_atomically
from coupling.files.atomic_folder import UNFINISHED
from coupling.files.output_file import require_output
from coupling.files.written_files import LIST, claim_file


def name_path(path: Path) -> str:
    """Return a path as a user would name it: from the working folder, and as it is once complete."""
    whole = path.resolve()
    whole = whole.with_name(whole.name.removesuffix(UNFINISHED))
    return str(whole.relative_to(Path.cwd()) if whole.is_relative_to(Path.cwd()) else whole)


def write_page(file: Path, text: str, error: type[Exception]) -> None:
    """Write a page, in the place of one that a command has written, and of nothing else.

    Args:
        file: The HTML file.
        text: Its content.
        error: Raised with the file's name if it cannot be written, or is no page.
    """
    is_in_folder = (file.parent / LIST).is_file()
    if file.suffix != ".html" or not is_in_folder:
        require_output(file, ".html", error)
    make_folder_of(file, error)
    write_atomically(claim_file(file) if is_in_folder else file, text, error)
