"""What a first case can begin with: a process, and the example that shows it."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class OwnFile:
    """A file of an example that its case needs and the user will replace.

    Attributes:
        example: Its place among the examples.
        name: Its name beside the new case.
        key: Key of [process] that names it.
        value: What the key then says.
    """

    example: str
    name: str
    key: str
    value: object


@dataclass(frozen=True)
class Start:
    """A process to begin with.

    Attributes:
        case: Example with one robot.
        about: What is made, for people.
        cell: Example with two robots; None where the process knows one tool alone.
        files: Files that the case needs beside it.
    """

    case: str
    about: str
    cell: str | None = None
    files: tuple[OwnFile, ...] = field(default=())


STARTS = {
    "isf-force-law": Start(
        "cone", "a cone formed in a sheet, its force from a formula", "two_robots"
    ),
    "sheet-fem": Start(
        "cone_fem",
        "a cone formed in a sheet that is computed (pip install 'elastic-robot-fmu[fem]')",
        "two_robots_fem",
    ),
    "milling-force": Start("milling_20000", "a slot milled in aluminium, tooth by tooth"),
    "external": Start(
        "external_template",
        "a process that is a program of your own, answering path.csv with wrench.csv",
        files=(
            OwnFile(
                "process_template.py", "process.py", "command", ["{python}", "{case}/process.py"]
            ),
        ),
    ),
    "measured": Start(
        "measured_line",
        "a force that was measured along the path",
        files=(OwnFile("measured/line_force.csv", "force.csv", "file", "force.csv"),),
    ),
}
