"""A hash of what an FMU will do."""

from __future__ import annotations

import hashlib
from pathlib import Path

_READ_BY_THE_MODEL = (".py", ".json", ".txt")


def fingerprint(folder: Path) -> str:
    """Return a hash of the sources and descriptions under a folder, 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for file in sorted(folder.rglob("*")):
        if file.suffix in _READ_BY_THE_MODEL:
            for part in (file.relative_to(folder).as_posix().encode(), file.read_bytes()):
                digest.update(len(part).to_bytes(8, "big"))
                digest.update(part)
    return digest.hexdigest()[:16]
