"""The languages that programs are written in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from coupling.errors import ProgramError, one_of, reason_of
from coupling.files.formats import other_format
from coupling.programs import csv_rows, fanuc, fanuc_reader, krl, krl_reader, rapid, rapid_reader
from coupling.programs.kuka.assignments import CONFIGURATION
from coupling.programs.kuka.modules import called_names
from coupling.programs.program import ProgramFile, RobotProgram

Targets = Literal["cartesian", "joints"]
Posture = Literal["never", "known", "always"]
# Programs of ABB, and what else holds modules.
_RAPID_ENDINGS = (".mod", ".modx", ".prg")
_RAPID_MODULES = (*_RAPID_ENDINGS, ".sys", ".sysx")


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
    dense: bool = False
    posture: Posture = "never"
    joints: int | None = 6
    endings: tuple[str, ...] = ()


def _read_rapid(files: Sequence[ProgramFile]) -> RobotProgram:
    """Return the program of the first file; the others are modules of its folder."""
    file, *others = files
    return rapid_reader.read(file.text, file.name, {other.name: other.text for other in others})


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
            krl_reader.read,
            ".src",
            "spline",
            krl.LONGEST_NAME,
            posture="known",
        ),
        Language(
            "rapid",
            rapid.write,
            _read_rapid,
            ".mod",
            "straight",
            rapid.LONGEST_NAME - 2,
            posture="always",
            endings=_RAPID_ENDINGS[1:],
        ),
        Language(
            "fanuc",
            fanuc.write,
            fanuc_reader.read,
            ".ls",
            "straight",
            fanuc.LONGEST_NAME - 3,
            step=1e-3,
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
    if path.is_file() and (other := other_format(_file(path).text.encode(), ["program", "csv"])):
        raise ProgramError(f"{path}: expected a robot program, {other}")
    ending = path.suffix.lower()
    known = {language.ending: language for language in LANGUAGES.values()}
    known |= {name: language for language in known.values() for name in language.endings}
    if ending not in known:
        raise ProgramError(f"{path}: ending: {one_of(known, ending)}")
    first = _file(path)
    return known[ending].read([first, *_beside(path, first.text)])


def _beside(path: Path, text: str) -> list[ProgramFile]:
    """Return the files that belong to one: its .dat, other modules, or programs that it calls."""
    if path.suffix.lower() == ".src":
        return _modules(path, text)
    if path.suffix.lower() in _RAPID_ENDINGS:
        return [
            _file(file)
            for file in sorted(path.parent.iterdir())
            if file.suffix.lower() in _RAPID_MODULES and file != path and file.is_file()
        ]
    wanted = set()
    if path.suffix.lower() == ".ls":
        wanted = {(name, ".ls") for name in fanuc_reader.called(text)}
    files = sorted(path.parent.iterdir()) if wanted else []
    return [
        _file(file)
        for file in files
        if (file.stem.upper(), file.suffix.lower()) in wanted and file != path
    ]


def _modules(path: Path, text: str) -> list[ProgramFile]:
    """Return the .src in the folder that a .src calls, and those they call, with all their .dat."""
    folder = {
        (file.stem.upper(), file.suffix.lower()): file for file in sorted(path.parent.iterdir())
    }
    wanted, modules, files = [path.stem.upper()], {path.stem.upper()}, []
    texts = {path.stem.upper(): text}
    while wanted:
        module = wanted.pop()
        for name in sorted(called_names(texts[module]) - modules):
            if (source := folder.get((name, ".src"))) is not None:
                modules.add(name)
                wanted.append(name)
                files.append(_file(source))
                texts[name] = files[-1].text
    data = [
        folder[name, ".dat"]
        for name in sorted({*modules, CONFIGURATION})
        if (name, ".dat") in folder
    ]
    return [*files, *(_file(file) for file in data)]


def _file(path: Path) -> ProgramFile:
    try:
        return ProgramFile(path.name, path.read_text(encoding="utf-8-sig"))
    except OSError as cause:
        raise ProgramError(f"{path}: cannot be read: {reason_of(cause)}") from cause
    except UnicodeDecodeError:
        # Controllers write the names in comments in the characters of their own country.
        return ProgramFile(path.name, path.read_text(encoding="latin-1"))
