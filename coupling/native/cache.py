"""Where compiled libraries are kept, for users with a home folder and for services without one."""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path

from coupling.errors import BuildError

# Variable that names the folder of caches, as the XDG Base Directory Specification has it.
VARIABLE = "XDG_CACHE_HOME"
_NAME = "elastic-robot"


def cache_folder() -> Path:
    """Return the folder for compiled libraries, which is made.

    It is `elastic-robot` in the folder that XDG_CACHE_HOME names, else in `.cache` of the home folder.
    Where there is none that can be written to, as for services, it is a folder of the user's own among
    the temporary files.

    Raises:
        BuildError: If the folder that XDG_CACHE_HOME names cannot be written to, or there is none.
    """
    stated = os.environ.get(VARIABLE)
    if stated:
        if _is_made(Path(stated, _NAME)):
            return Path(stated, _NAME)
        raise BuildError(
            f"{stated}: expected a folder to write compiled libraries into, got one that cannot be"
            f" written to: let the variable {VARIABLE} name another"
        )
    try:
        usual = Path.home() / ".cache" / _NAME
    except RuntimeError:  # neither HOME nor an entry among the users
        usual = None
    if usual is not None and _is_made(usual):
        return usual
    user = os.getuid() if hasattr(os, "getuid") else "user"
    temporary = Path(tempfile.gettempdir(), f"{_NAME}-{user}")
    if _is_made(temporary) and _is_private(temporary):
        return temporary
    raise BuildError(
        f"{usual or 'no home folder'}, {temporary}: expected a folder of this user to write compiled"
        f" libraries into, got none: let the variable {VARIABLE} name one"
    )


def compiler_environment() -> dict[str, str]:
    """Return the environment for a compiler: Zig keeps what it has compiled in `cache_folder`, too."""
    zig_cache = str(cache_folder() / "zig")
    return {"ZIG_GLOBAL_CACHE_DIR": zig_cache, "ZIG_LOCAL_CACHE_DIR": zig_cache, **os.environ}


def _is_made(folder: Path) -> bool:
    """Return whether a folder is there, or could be made, and can be written to."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _is_private(folder: Path) -> bool:
    """Return whether a folder is this user's alone: libraries from another's would be run."""
    if not hasattr(os, "getuid"):
        return True
    status = folder.lstat()
    shared = status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not shared
