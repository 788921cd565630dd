"""The command line: elastic-robot robots."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import Annotated

import typer
from rich.console import Console

from coupling.files.robot_file import find_robot, robot_numbers, shipped_robots
from coupling.files.sources import Number

_UNKNOWN = "the file does not say"


def robots(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="Shipped robots or robot files; every number of each is listed."),
    ] = None,
) -> None:
    """List the shipped robots and where their numbers come from; of named robots every number."""
    console = Console(highlight=False)
    for line in _every_number(names) if names else _all():
        console.print(line, markup=False, soft_wrap=True)


def _all() -> Iterator[str]:
    """Yield a line for each robot, and one for what has the same source."""
    for name, file in shipped_robots().items():
        title, numbers = robot_numbers(file)
        yield f"{name} ({title})"
        for source, places in by_source(numbers).items():
            yield f"  {', '.join(places)}: {source}"


def _every_number(names: list[str]) -> Iterator[str]:
    for name in names:
        file = find_robot(name)
        title, numbers = robot_numbers(file)
        yield f"{file} ({title})"
        for number in numbers:
            yield f"  {number.place} = {_words(number.value)}: {number.source or _UNKNOWN}"


def _words(value: object) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_words(entry) for entry in value)}]"
    return f"{value:.9g}" if isinstance(value, int | float) else str(value)


def by_source(numbers: list[Number]) -> dict[str, list[str]]:
    """Return the places of numbers by their source, those of all joints as one place.

    Example:
        >>> by_source([Number("joint[1].mass", 1.0, "a"), Number("joint[2].mass", 2.0, "a")])
        {'a': ['joint.mass']}
    """
    kinds: dict[str, set[str]] = {}
    for number in numbers:
        kinds.setdefault(_kind(number.place), set()).add(number.source)
    found: dict[str, list[str]] = {}
    for number in numbers:
        kind = _kind(number.place)
        place = kind if len(kinds[kind]) == 1 else number.place
        places = found.setdefault(number.source or _UNKNOWN, [])
        if place not in places:
            places.append(place)
    return found


def _kind(place: str) -> str:
    """Return a place without the numbers of joint and tilt."""
    parts = (list(part) for _, part in groupby(place, lambda letter: letter in "[]0123456789"))
    return "".join("".join(part) for part in parts if part[0] not in "[]")
