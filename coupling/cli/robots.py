"""The command line: elastic-robot robots."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import typer

from coupling.cli.console import console


def robots(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="Shipped robots or robot files; every number of each is listed."),
    ] = None,
) -> None:
    """List the shipped robots and the sources of their numbers; for named robots every number."""
    for line in _every_number(names) if names else _all():
        console.print(line)


def _all() -> Iterator[str]:
    """Yield a line for each robot, and one for what has the same source."""
    from coupling.files.robot_file import robot_numbers, shipped_robots
    from coupling.files.sources import by_source

    for name, file in shipped_robots().items():
        title, numbers = robot_numbers(file)
        yield f"{name} ({title})"
        for source, places in by_source(numbers).items():
            yield f"  {', '.join(places)}: {source}"


def _every_number(names: list[str]) -> Iterator[str]:
    from coupling.files.provenance import load_provenance, urdf_numbers
    from coupling.files.robot_file import (
        find_robot,
        load_robot,
        parts_in_words,
        robot_numbers,
    )
    from coupling.files.sources import UNKNOWN
    from coupling.run.plausibility import remarks_on_robot
    from elastic_robot.errors import ElasticRobotError

    for name in names:
        file = find_robot(name)
        title, numbers = robot_numbers(file)
        yield f"{file} ({title})"
        for number in numbers:
            yield f"  {number.place} = {_words(number.value)}: {number.source or UNKNOWN}"
        for line in parts_in_words(file):
            yield f"  {line}"
        try:
            listed, robot = urdf_numbers(file), load_robot(file)
            provenance = load_provenance(file, robot)
            said = (*provenance.remarks, *remarks_on_robot(robot, provenance.numbers))
        except ElasticRobotError as error:  # a URDF that is not installed here, for instance
            yield f"  Cannot be used: {error}"
            continue
        for number in listed:
            yield f"  {number.place} = {_words(number.value)}: {number.source}"
        for text in said:
            yield f"  Remark: {text}"


def _words(value: object) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_words(entry) for entry in value)}]"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.9g}" if isinstance(value, int | float) else str(value)
