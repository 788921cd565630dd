"""elastic-robot store: what is kept, whether it is sound, and clearing it."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from coupling.cli.arguments import STORE
from coupling.cli.console import console

if TYPE_CHECKING:
    from coupling.store import Entry

UNSOUND = 1
_HOURS = {"h": 1, "d": 24, "w": 7 * 24}
_BYTES = {"": 1, "B": 1, "kB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12}


def _age(text: str) -> float:
    match = re.fullmatch(r"(\d{1,6}(?:\.\d{1,6})?)([hdw])", text)
    if match is None:
        raise typer.BadParameter(f"expected a number of hours, days or weeks as 30d, got {text!r}")
    return 3600.0 * float(match[1]) * _HOURS[match[2]]


def _size(text: str) -> int:
    match = re.fullmatch(r"(\d{1,15}(?:\.\d{1,6})?)\s?([kMGT]?B|)", text)
    if match is None:
        raise typer.BadParameter(f"expected a size as 10GB or 500MB, got {text!r}")
    return int(float(match[1]) * _BYTES[match[2]])


def store(
    folder: Annotated[Path, typer.Argument(help="The store.")] = Path("results", STORE),
    verify: Annotated[
        bool, typer.Option("--verify", help="Check every entry's checksum; status 1 if one fails.")
    ] = False,
    clear: Annotated[
        bool,
        typer.Option(
            "--clear", help="Remove evaluations by --older-than and --keep; needs one of them."
        ),
    ] = False,
    older_than: Annotated[
        float | None,
        typer.Option(
            parser=_age, metavar="AGE", help="Those not used for this time: 12h, 30d, 8w."
        ),
    ] = None,
    keep: Annotated[
        int | None,
        typer.Option(
            parser=_size,
            metavar="SIZE",
            help="Size to keep, of those used last: 500MB, 10GB; 0 keeps nothing.",
        ),
    ] = None,
) -> None:
    """List the evaluations that are kept, check them, or clear them by age and size."""
    from coupling.store.store import Store, to_clear

    bounded = older_than is not None or keep is not None
    if clear != bounded:
        raise typer.BadParameter("expected --clear with --older-than, --keep or both")
    if verify and clear:
        raise typer.BadParameter("expected one of --verify and --clear")
    evaluations = Store(folder)
    entries = evaluations.entries()
    if clear:
        gone = to_clear(entries, time.time(), older_than, keep)
        evaluations.clear(gone)
        console.print(f"{folder}: {_sum(gone)} removed, {_sum(entries, gone)} left")
    elif verify:
        problems = {entry: problem for entry in entries if (problem := entry.problem())}
        for entry, problem in problems.items():
            console.print(f"{entry.file}: {problem}", style="red")
        console.print(f"{folder}: {_sum(entries)}, {len(problems)} damaged")
        if problems:
            raise typer.Exit(UNSOUND)
    else:
        for line in _list(entries):
            console.print(line)
        console.print(f"{folder}: {_sum(entries)}")


def _sum(entries: list[Entry], without: list[Entry] | None = None) -> str:
    gone = {entry.file for entry in without or ()}
    remaining = [entry for entry in entries if entry.file not in gone]
    return f"{len(remaining)} evaluations, {_in_words(sum(entry.size for entry in remaining))}"


_COLUMNS = "{:16}  {:16}  {:>9} {:>9} {:>8} {:>2}  {:12}  {}"


def _list(entries: list[Entry]) -> Iterator[str]:
    """Return a line for each entry, the one used last at the end."""
    if entries:
        names = ("last used", "computed", "took", "size", "samples", "x", "key", "process")
        yield _COLUMNS.format(*names)
    for entry in entries:
        about = entry.about
        used, size, key = _moment(entry.used), _in_words(entry.size), entry.key[:12]
        if about is None:
            yield _COLUMNS.format(used, "?", "?", size, "?", "?", key, "damaged")
            continue
        took = f"{about.seconds:.1f} s"
        path = (str(about.samples), str(about.tools))
        yield _COLUMNS.format(used, _moment(about.written), took, size, *path, key, about.process)


def _moment(seconds: float) -> str:
    return datetime.fromtimestamp(seconds).strftime("%Y-%m-%d %H:%M")


def _in_words(size: int) -> str:
    for unit in ("TB", "GB", "MB", "kB"):
        if size >= _BYTES[unit]:
            return f"{size / _BYTES[unit]:.1f} {unit}"
    return f"{size} B"
