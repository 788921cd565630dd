"""What costs tests much, made once: by one of several workers, and again only if its sources changed.

An entry is named by the function that makes it, its inputs, and the content of all files that the
function's module depends on.  Entries are kept in `.pytest_cache/stored`; those that are not used are
removed when there is more than a gigabyte of them.
"""

import hashlib
import inspect
import os
import pickle
import shutil
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from filelock import FileLock
from module_sources import sources_of
from places import ROOT

T = TypeVar("T")
STORE = ROOT / ".pytest_cache" / "stored"
LARGEST = 2**30  # [bytes]


def stored(make: Callable[..., T], *inputs: Any, using: tuple[Any, ...] = (), **named: Any) -> T:
    """Return what a function makes of inputs; pickle can write them, and what it makes.

    Args:
        make: A function of a module; its answer depends on its inputs and its sources alone.
        inputs: Its arguments.
        using: Further ones that follow from the inputs and cannot be written, such as a running FMU.
        named: Arguments by their names.
    """

    def write(folder: Path) -> None:
        (folder / "value").write_bytes(pickle.dumps(make(*inputs, *using, **named)))

    entry = _entry(make, (inputs, named), write)
    return pickle.loads((entry / "value").read_bytes())


def stored_folder(make: Callable[..., None], *inputs: Any) -> Path:
    """Return the folder that a function fills, to be read, or copied by who changes it.

    Args:
        make: As for `stored`; its first argument is the folder, new and empty.
        inputs: Its other arguments.
    """
    return _entry(make, inputs, lambda folder: make(folder, *inputs))


def key_of(make: Callable[..., Any], inputs: tuple[Any, ...]) -> str:
    """Return the name of what a function makes of inputs: another one where a source differs."""
    file = Path(inspect.getfile(inspect.unwrap(make)))
    told = hashlib.sha256(pickle.dumps((make.__module__, make.__qualname__, inputs)))
    told.update(_environment())
    for source in sorted(sources_of(file)):
        told.update(str(source.relative_to(ROOT)).encode() + b"\0" + _content(source))
    return told.hexdigest()


def prune(folder: Path = STORE, largest: int = LARGEST) -> None:
    """Remove the entries that were used least recently where all together are larger [bytes]."""
    entries = [entry for entry in folder.glob("*") if entry.is_dir()]
    entries.sort(key=lambda entry: entry.stat().st_mtime, reverse=True)
    size = 0
    for entry in entries:
        size += sum(file.stat().st_size for file in entry.rglob("*") if file.is_file())
        if size > largest:
            shutil.rmtree(entry, ignore_errors=True)


def _entry(
    make: Callable[..., Any], inputs: tuple[Any, ...], write: Callable[[Path], None]
) -> Path:
    entry = STORE / key_of(make, inputs)
    STORE.mkdir(parents=True, exist_ok=True)
    with FileLock(entry.with_suffix(".lock")):
        if entry.is_dir():
            os.utime(entry)
            return entry
        with tempfile.TemporaryDirectory(dir=STORE, prefix=".") as place:
            folder = Path(place, "made")
            folder.mkdir()
            write(folder)
            folder.rename(entry)
    return entry


@cache
def _environment() -> bytes:
    """Return what an answer depends on beside sources: Python, and the versions of what is installed."""
    places = sorted({path for path in map(Path, sys.path) if path.name == "site-packages"})
    installed = (
        name for place in places for name in os.listdir(place) if name.endswith(".dist-info")
    )
    return "\0".join([sys.version, sys.platform, *sorted(installed)]).encode()


@cache
def _content(file: Path) -> bytes:
    return hashlib.sha256(file.read_bytes()).digest()
