"""The languages that programs are written in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from coupling.errors import ProgramError, one_of, reason_of
from coupling.programs import csv_rows, fanuc, fanuc_reader, krl, krl_reader, rapid, rapid_reader
from coupling.programs.program import ProgramFile, RobotProgram

Targets = Literal["cartesian", "joints"]
Posture = Literal["never", "known", "always"]


@dataclass(frozen=True)
class Language:
    """A language of robot programs.

    Attributes:
        name: Word for it on the command line.
        write: Function that gives the files of a program.
        read: Function that reads them again.
        ending: Ending of the file that a user names to have a program read.
        between: Motion of its controller between timed targets: "straight", or "spline" through them.
        longest_name: Characters that a program's name may have.
        targets: Kinds of targets in its programs, the usual first.
        step: Times are whole multiples of this [s]; 0 for any.
        shortest: Least time between targets unless another one is asked for [s]; 0 for any.
        dense: Whether it has a point on every cycle.
        posture: Whether its poses state the robot's posture: "never", "known" where the robot file says
            how the controller counts, or "always", for the language has no pose without.
        joints: Number of joints that its programs are for; None for any.
    """

    name: str
    write: Callable[[RobotProgram], tuple[ProgramFile, ...]]
    read: Callable[[Sequence[ProgramFile]], RobotProgram]
    ending: str
    between: Literal["straight", "spline"]
    longest_name: int
    targets: tuple[Targets, ...] = ("cartesian", "joints")
    step: float = 0.0
    shortest: float = 0.0
    dense: bool = False
    posture: Posture = "never"
    joints: int | None = 6


def _read_krl(files: Sequence[ProgramFile]) -> RobotProgram:
    source = _one(files, ".src")
    data = [file.text for file in files if file.name.lower().endswith(".dat")]
    return krl_reader.read(source.text, "\n".join(data), source.name)


def _read_rapid(files: Sequence[ProgramFile]) -> RobotProgram:
    file = _one(files, ".mod")
    return rapid_reader.read(file.text, file.name)


def _read_csv(files: Sequence[ProgramFile]) -> RobotProgram:
    file = _one(files, ".csv")
    return csv_rows.read(file.text, file.name)


def _one(files: Sequence[ProgramFile], ending: str) -> ProgramFile:
    found = [file for file in files if file.name.lower().endswith(ending)]
    if len(found) != 1:
        raise ProgramError(f"program: expected one file {ending}, got {len(found)}")
    return found[0]


LANGUAGES = {
    language.name: language
    for language in (
        Language(
            "krl",
            krl.write,
            _read_krl,
            ".src",
            "spline",
            krl.LONGEST_NAME,
            # The interpolation cycle of KRC controllers.
            shortest=0.012,
            posture="known",
        ),
        Language(
            "rapid",
            rapid.write,
            _read_rapid,
            ".mod",
            "straight",
            rapid.LONGEST_NAME - 2,
            # No figure is published; a line of the program is planned in some milliseconds.
            shortest=0.012,
            posture="always",
        ),
        Language(
            "fanuc",
            fanuc.write,
            fanuc_reader.read,
            ".ls",
            "straight",
            fanuc.LONGEST_NAME - 3,
            step=1e-3,
            # The interpolation period (ITP) of R-30i controllers, whose multiples times become.
            shortest=0.008,
            posture="always",
        ),
        Language(
            "csv",
            csv_rows.write,
            _read_csv,
            ".csv",
            "spline",
            csv_rows.LONGEST_NAME,
            targets=("joints",),
            dense=True,
            joints=None,
        ),
    )
}


def read_program(path: Path) -> RobotProgram:
    """Read a program in the language that its file's ending says.

    Args:
        path: Its file; others that belong to it, as a .dat and what an .ls calls, lie beside it.

    Raises:
        ProgramError: If it cannot be read.
    """
    ending = path.suffix.lower()
    known = {language.ending: language for language in LANGUAGES.values()}
    if ending not in known:
        raise ProgramError(f"{path}: ending: {one_of(known, ending)}")
    first = _file(path)
    return known[ending].read([first, *_beside(path, first.text)])


def _beside(path: Path, text: str) -> list[ProgramFile]:
    """Return the files that belong to one: of its name with .dat, or called by it."""
    if path.suffix.lower() == ".ls":
        return _called(path, text)
    wanted = {(path.stem.upper(), ".dat")}
    files = sorted(path.parent.iterdir()) if wanted else []
    return [
        _file(file)
        for file in files
        if (file.stem.upper(), file.suffix.lower()) in wanted and file != path
    ]


def _called(path: Path, text: str) -> list[ProgramFile]:
    """Return the files .ls that a program calls, and those that they call."""
    names = list(fanuc_reader.called(text))
    there = {
        file.stem.upper(): file
        for file in (sorted(path.parent.iterdir()) if names else [])
        if file.suffix.lower() == ".ls" and file != path
    }
    files: dict[str, ProgramFile] = {}
    while names:
        name = names.pop()
        if name in there and name not in files:
            files[name] = _file(there[name])
            names += fanuc_reader.called(files[name].text)
    return list(files.values())


def _file(path: Path) -> ProgramFile:
    try:
        return ProgramFile(path.name, path.read_text(encoding="utf-8-sig"))
    except OSError as cause:
        raise ProgramError(f"{path}: cannot be read: {reason_of(cause)}") from cause
    except UnicodeDecodeError:
        # Controllers write the names in comments in the characters of their own country.
        return ProgramFile(path.name, path.read_text(encoding="latin-1"))
