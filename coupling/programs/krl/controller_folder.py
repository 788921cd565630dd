"""Folders of a KUKA controller: where the other modules of a program are in an archive of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from coupling.errors import ProgramError

# Folders of R1, in lower case: users' programs, those of technology packages, and the controller's own.
_PROGRAMS, _PACKAGES, _SYSTEM = "program", "tp", "system"
_ENDINGS = (".src", ".dat")
# Data that all programs share.
_SHARED = "$config.dat"


def controller_modules(path: Path) -> list[Path]:
    """Return the .src and .dat that a controller holds with a program, in the order in which they count.

    Those of the program's folder count before others. Where it lies below the folder Program or TP of an
    archive, which has a folder System, all below these two belong to it, and System's $config.dat.
    """
    neighbours = _modules(path.parent.iterdir(), path)
    root = _controller_root(path)
    if root is None:
        return neighbours
    folders = {folder.name.lower(): folder for folder in sorted(root.iterdir()) if folder.is_dir()}
    others = [
        file
        for name in (_PROGRAMS, _PACKAGES)
        if name in folders
        for file in _modules(folders[name].rglob("*"), path)
    ]
    shared = [file for file in folders[_SYSTEM].iterdir() if file.name.lower() == _SHARED]
    return neighbours + [file for file in (*others, *shared) if file.parent != path.parent]


def require_single(named: Iterable[Path], path: Path) -> Path:
    """Return the file of a module's name: the program's neighbour, else the only one.

    Raises:
        ProgramError: If several folders have a module of that name, with different contents.
    """
    files = list(named)
    if files[0].parent == path.parent:
        return files[0]
    if len({file.read_bytes() for file in files}) > 1:
        folders = " and ".join(str(file.parent) for file in files[:2])
        raise ProgramError(
            f"{path}: expected one module {files[0].name}, got several, in {folders}: put the one that"
            " is meant beside the program"
        )
    return files[0]


def _controller_root(path: Path) -> Path | None:
    """Return the folder R1 of an archive that a program lies in; None where it lies in none."""
    for folder in path.resolve().parents:
        if folder.name.lower() in (_PROGRAMS, _PACKAGES):
            names = {other.name.lower() for other in folder.parent.iterdir() if other.is_dir()}
            if _SYSTEM in names:
                return folder.parent
    return None


def _modules(files: Iterable[Path], path: Path) -> list[Path]:
    return sorted(_of_krl(files, path))


def _of_krl(files: Iterable[Path], path: Path) -> Iterator[Path]:
    for file in files:
        if file.suffix.lower() in _ENDINGS and file.is_file() and file.resolve() != path.resolve():
            yield file
