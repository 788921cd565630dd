"""A hash of what an FMU will do."""

from __future__ import annotations

import hashlib
from pathlib import Path

_READ_BY_THE_MODEL = (".py", ".json", ".txt")
# What stands beside the model in an installed package: a file in a checkout, a folder in a wheel.
_DESK_SIDE = ("coupling.py", "coupling")


def model_files(folder: Path) -> list[Path]:
    """Return the files under a folder that belong to the model, which is what FMUs hold of it."""
    return [
        file
        for file in sorted(folder.rglob("*"))
        if file.is_file()
        and "__pycache__" not in file.parts
        and file.relative_to(folder).parts[0] not in _DESK_SIDE
    ]


def fingerprint(folder: Path) -> str:
    """Return a hash of the model's sources and descriptions under a folder, 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for file in model_files(folder):
        if file.suffix in _READ_BY_THE_MODEL:
            for part in (file.relative_to(folder).as_posix().encode(), file.read_bytes()):
                digest.update(len(part).to_bytes(8, "big"))
                digest.update(part)
    return digest.hexdigest()[:16]
