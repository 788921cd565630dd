"""Which files in a folder a command has written: a list in the folder, so that nothing else is removed.

A name is on the list before its file is written, so that the list is complete whenever a command is
killed.  A file that somebody else has put there under such a name is renamed, never replaced:
`wrench.csv` becomes `wrench.csv.kept`.  On the list, `forming/` is a folder that has a list of its own,
and `evaluations/**` one in which all is the command's.
"""

from __future__ import annotations

import itertools
import json
import os
import shutil
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from coupling.files.atomic_file import DRAFT, PARTIAL, AtomicFile, remove_abandoned

# The list: kind of folder, and names of files and folders.
LIST = ".elastic-robot.json"
# Endings of names of folders on the list: with a list of their own, and whole.
_LISTED, WHOLE = "/", "/**"
# Ending of a file of somebody else whose name a command needs.
KEPT = ".kept"
# Page of what a folder holds.
REPORT = "report.html"
# Page of how a command was learned from measured runs.
LEARNING = "next.html"


@dataclass(frozen=True)
class _Written:
    kind: str = ""
    names: frozenset[str] = frozenset()

    @classmethod
    def of(cls, folder: Path) -> _Written:
        """Return the list of a folder; an empty one where there is none that can be read."""
        try:
            content = json.loads((folder / LIST).read_text(encoding="utf-8"))
            kind, names = content["kind"], content["written"]
            return cls(str(kind), frozenset(name for name in names if _is_name(name)))
        except (OSError, ValueError, TypeError, KeyError, RecursionError):
            return cls()

    def write(self, folder: Path) -> None:
        text = json.dumps({"kind": self.kind, "written": sorted(self.names)}, indent=1)
        AtomicFile(folder / LIST).write([f"{text}\n".encode()])

    def has(self, place: Path) -> bool:
        """Return whether a file, a draft of one or a whole folder is on the list, as what it is."""
        if _is_folder(place):
            return f"{place.name}{WHOLE}" in self.names
        draft = DRAFT.fullmatch(place.name)
        if draft is not None:
            return draft[1] in self.names or draft[1] == LIST
        return place.name in self.names


def _is_folder(place: Path) -> bool:
    return place.is_dir() and not place.is_symlink()


def _is_draft_of_list(place: Path) -> bool:
    draft = DRAFT.fullmatch(place.name)
    return draft is not None and draft[1] == LIST


def _is_name(name: object) -> bool:
    """Return whether a name stays in its folder, whoever has written the list."""
    if not isinstance(name, str):
        return False
    plain = name.removesuffix(WHOLE).removesuffix(_LISTED)
    return plain not in ("", ".", "..", LIST) and not set(plain) & set("/\\\0")


def begin_folder(folder: Path, kind: str) -> None:
    """Make a folder in which a command lists what it writes, or go on with one that it alone writes.

    Drafts that a killed command has left there go.

    Example:
        >>> import tempfile
        >>> folder = Path(tempfile.mkdtemp())
        >>> begin_folder(folder, "run")
        >>> _ = claim_file(folder / "wrench.csv").write_text("of the command")
        >>> _ = (folder / "measured.csv").write_text("of the user")
        >>> remove_written(folder)
        >>> [file.name for file in folder.glob("*.csv")]
        ['measured.csv']
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = _Written.of(folder)
    for draft in folder.glob(f"*{PARTIAL}"):
        if written.has(draft):
            remove_abandoned(draft)
    if written.kind != kind or not (folder / LIST).is_file():
        replace(written, kind=kind).write(folder)


def is_of_kind(folder: Path, kind: str) -> bool:
    """Return whether a folder was begun for a kind of content."""
    return _Written.of(folder).kind == kind


def is_free(folder: Path) -> bool:
    """Return whether there is nothing in a folder, or only drafts of a command that was killed."""
    return not folder.exists() or all(DRAFT.fullmatch(place.name) for place in folder.iterdir())


def claim(folder: Path, names: Iterable[str]) -> None:
    """Put names on the list of a folder before they are written.

    What somebody else has put there under the name of a file gets another one; a folder is shared.

    Args:
        names: Names of files; of folders with the ending `WHOLE`.
    """
    written, claimed = _Written.of(folder), frozenset(names)
    for name in claimed:
        place = folder / name.removesuffix(WHOLE).removesuffix(_LISTED)
        is_shared = name.endswith((WHOLE, _LISTED)) and place.is_dir()
        if os.path.lexists(place) and not is_shared and not written.has(place):
            os.rename(place, _free_name(place))
    if not claimed <= written.names:
        replace(written, names=written.names | claimed).write(folder)


def claim_file(file: Path) -> Path:
    """Return a file that a command may write: listed, and no other's."""
    claim(file.parent, [file.name])
    return file


def claimed_folder(folder: Path) -> Path:
    """Make a folder within a command's folder, in which it lists what it writes there; return it."""
    claim(folder.parent, [f"{folder.name}{_LISTED}"])
    folder.mkdir(exist_ok=True)
    return folder


def listed_files(folder: Path) -> Iterator[Path]:
    """Yield the files on the list of a folder, and of those in it that have a list."""
    for name in _Written.of(folder).names:
        place = folder / name.removesuffix(_LISTED)
        if place.is_file():
            yield place
        elif name.endswith(_LISTED) and place.is_dir():
            yield from listed_files(place)


def remove_written(folder: Path, keep: Iterable[str] = ()) -> None:
    """Remove what a command has written into a folder, and the folder where nothing else is in it.

    Args:
        keep: Names on the list that stay, and with them the folder.
    """
    if not (folder / LIST).is_file():
        return
    written, protected = _Written.of(folder), frozenset(keep)
    going = replace(written, names=written.names - protected)
    for place in list(folder.iterdir()):
        if going.has(place) or (DRAFT.fullmatch(place.name) and written.has(place)):
            shutil.rmtree(place) if _is_folder(place) else place.unlink()
        elif _is_folder(place) and f"{place.name}{_LISTED}" in going.names:
            remove_written(place)
    if not protected and all(place.name == LIST for place in folder.iterdir()):
        (folder / LIST).unlink()
        folder.rmdir()
    else:
        replace(written, names=written.names & protected).write(folder)


def hand_over(old: Path, new: Path) -> None:
    """Remove what a command has written into a folder that another one has replaced, and the folder.

    What else is in it comes into the other one, under another name where its own is taken.
    """
    remove_written(old)
    if not old.exists():
        return
    for place in list(old.iterdir()):
        target = new / place.name
        if place.name == LIST or _is_draft_of_list(place):
            continue
        if _is_folder(place) and _is_folder(target):
            hand_over(place, target)
        else:
            os.rename(place, _free_name(target) if os.path.lexists(target) else target)
    for place in old.iterdir():
        place.unlink()
    old.rmdir()


def _free_name(place: Path) -> Path:
    """Return a name like that of a file which nothing has."""
    names = (f"{place.name}{KEPT}{number or ''}" for number in itertools.count())
    return next(free for name in names if not os.path.lexists(free := place.with_name(name)))
