"""The languages that programs are written in."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from coupling.errors import ProgramError, one_of
from coupling.files.bounded_file import read_bounded
from coupling.files.formats import other_format
from coupling.programs import csv_rows
from coupling.programs.fanuc import reader as fanuc_reader
from coupling.programs.fanuc import writer as fanuc
from coupling.programs.krl import reader as krl_reader
from coupling.programs.krl import writer as krl
from coupling.programs.krl.assignments import CONFIGURATION
from coupling.programs.krl.controller_folder import controller_modules, require_single
from coupling.programs.krl.syntax import called_names, shares_data
from coupling.programs.program import ProgramFile, RobotProgram
from coupling.programs.rapid import reader as rapid_reader
from coupling.programs.rapid import writer as rapid
from coupling.programs.rounding import round_program

Targets = Literal["cartesian", "joints"]
Posture = Literal["never", "known", "always"]
# Programs of ABB, and what else holds modules.
_RAPID_ENDINGS = (".mod", ".modx", ".prg")
_RAPID_MODULES = (*_RAPID_ENDINGS, ".sys", ".sysx")
# No program that a controller holds is larger [bytes].
_MAX_BYTES = 256_000_000


@dataclass(frozen=True)
class Language:
    """A language of robot programs.

    Attributes:
        name: Word for it on the command line.
        write: Function that gives the files of a program.
        read: Function that reads them again.
        ending: Ending of the file that a user names to have a program read.
        endings: Others that such a file may have.
        between: Motion of its controller between timed targets: "straight", or "spline" through them.
        longest_name: Characters that a program's name may have.
        targets: Kinds of targets in its programs, the usual first.
        step: Times are whole multiples of this [s]; 0 for any.
        shortest: Least time between targets unless another one is asked for [s]; 0 for any.
        dense: Whether it has a point on every cycle.
        posture: Whether its poses state the robot's posture: "never", "known" where the robot file says
            how the controller counts, or "always", for the language has no pose without.
        joints: Number of joints that its programs are for; None for any.
        rounded: Function that gives a program the digits that its text has.
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
    endings: tuple[str, ...] = ()
    rounded: Callable[[RobotProgram], RobotProgram] = round_program


def _read_rapid(files: Sequence[ProgramFile]) -> RobotProgram:
    """Return the program of the first file; the others are modules of its folder."""
    file, *others = files
    return rapid_reader.read(file.text, file.name, {other.name: other.text for other in others})


LANGUAGES = {
    language.name: language
    for language in (
        Language(
            "krl",
            krl.write,
            krl_reader.read,
            ".src",
            "spline",
            krl.LONGEST_NAME,
            # The interpolation cycle of KRC controllers.
            shortest=0.012,
            posture="known",
            rounded=krl.rounded,
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
            endings=_RAPID_ENDINGS[1:],
            rounded=rapid.rounded,
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
            lambda files: csv_rows.read(files[0].text, files[0].name),
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
    content = read_bounded(path, _MAX_BYTES, ProgramError) if path.is_file() else b""
    if other := other_format(content, ["program", "csv"]):
        raise ProgramError(f"{path}: expected a robot program, {other}")
    ending = path.suffix.lower()
    by_ending = {language.ending: language for language in LANGUAGES.values()}
    by_ending |= {name: language for language in by_ending.values() for name in language.endings}
    if ending not in by_ending:
        raise ProgramError(f"{path}: ending: {one_of(by_ending, ending)}")
    first = _file(path)
    return by_ending[ending].read([first, *_data_files(path, first.text)])


def _data_files(path: Path, text: str) -> list[ProgramFile]:
    """Return the files that belong to one: its .dat, other modules, or programs that it calls."""
    folder = [file for file in sorted(path.parent.iterdir()) if file.is_file() and file != path]
    ending = path.suffix.lower()
    if ending in _RAPID_ENDINGS:
        return [_file(file) for file in folder if file.suffix.lower() in _RAPID_MODULES]
    if ending == ".ls":
        return _find_called(path, text, folder, fanuc_reader.find_called)
    if ending == ".src":
        return _krl_files(path, text)
    return []


def _krl_files(path: Path, text: str) -> list[ProgramFile]:
    """Return the .src that a .src calls, and the .dat that these share or have."""
    modules = controller_modules(path)
    programs = _find_called(path, text, modules, called_names)
    with_data = {path.stem.upper(), *(Path(program.name).stem.upper() for program in programs)}
    data: list[ProgramFile] = []
    for name, files in _by_name(modules, ".dat").items():
        file = require_single(files, path) if name in with_data else files[0]
        content = _file(file)
        if name in with_data or name == CONFIGURATION or shares_data(content.text):
            data.append(content)
    return [*programs, *data]


def _by_name(files: Iterable[Path], ending: str) -> dict[str, list[Path]]:
    """Return the files of an ending by their names without it, in capitals."""
    named: dict[str, list[Path]] = {}
    for file in files:
        if file.suffix.lower() == ending:
            named.setdefault(file.stem.upper(), []).append(file)
    return named


def _find_called(
    path: Path, text: str, folder: Sequence[Path], called: Callable[[str], Iterable[str]]
) -> list[ProgramFile]:
    """Return the files with the programs that a text calls, and those that these call.

    Args:
        path: The text's file.
        folder: Other files.
        called: Function from a text to the names that it calls, in capitals.
    """
    there = _by_name(folder, path.suffix.lower())
    files: dict[str, ProgramFile] = {}
    names = sorted(called(text))
    while names:
        name = names.pop()
        if name in there and name not in files:
            files[name] = _file(require_single(there[name], path))
            names += sorted(called(files[name].text))
    return [files[name] for name in sorted(files)]


def _file(path: Path) -> ProgramFile:
    content = read_bounded(path, _MAX_BYTES, ProgramError)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        # Controllers write the names in comments in the characters of their own country.
        text = content.decode("latin-1")
    return ProgramFile(path.name, text.replace("\r\n", "\n").replace("\r", "\n"))
