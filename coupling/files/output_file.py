"""Files that a command writes under a name that is given: of its ending, and no file of the user's."""

from __future__ import annotations

import re
import zipfile
from contextlib import suppress
from pathlib import Path

from coupling.files.atomic_file import require_writable_place

# What a text says in its first line, and an archive of its tool; what init writes becomes the user's.
_SIGN = re.compile(
    rb"#.*by elastic-robot (identify|learn)\b|.*<meta name=\"generator\" content=\"elastic-robot"
)
_TOOL = b'generationTool="elastic-robot'
_DESCRIPTIONS = ("modelDescription.xml", "SystemStructure.ssd")
# Length of the beginning, and of a description, in which that stands [bytes].
_BEGINNING, _DESCRIPTION = 2048, 1 << 16


def require_output(file: Path, ending: str, error: type[Exception]) -> None:
    """Refuse a name of another ending, a place that cannot be written, and a file of somebody else.

    Example:
        >>> require_output(Path("case.toml"), ".html", ValueError)
        Traceback (most recent call last):
        ValueError: case.toml: expected a name that ends in .html, got 'case.toml'
    """
    if file.suffix != ending:
        raise error(f"{file}: expected a name that ends in {ending}, got {file.name!r}")
    require_writable_place(file, error)
    if file.is_file() and not is_output(file):
        raise error(
            f"{file}: holds what no elastic-robot command has written there: give another name"
            " (--output), or remove it"
        )


def is_output(file: Path) -> bool:
    """Return whether a command has written a file, by what it says of its origin, or it is empty."""
    with suppress(OSError, zipfile.BadZipFile, NotImplementedError, RuntimeError, ValueError):
        with file.open("rb") as stream:
            beginning = stream.read(_BEGINNING)
        if not beginning.startswith(b"PK"):
            return not beginning or _SIGN.match(beginning) is not None
        with zipfile.ZipFile(file) as archive:
            for name in set(_DESCRIPTIONS) & set(archive.namelist()):
                with archive.open(name) as stream:
                    return _TOOL in stream.read(_DESCRIPTION)
    return False
