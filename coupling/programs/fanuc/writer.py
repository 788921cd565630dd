"""FANUC TP, written: .ls programs of timed motions, and one that calls them where they are several.

The words are those of [FanucTP] in docs/references.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from coupling.errors import ProgramError
from coupling.programs.angles import wpr_of
from coupling.programs.program import (
    DEGREE_DECIMALS,
    HERE,
    MM_DECIMALS,
    Configuration,
    ProgramFile,
    ProgramMove,
    RobotProgram,
)
from coupling.programs.text import format_fixed, numbers, require_lines, require_name

# Characters of a name; lines and positions of one program, which are numbered with four digits.
LONGEST_NAME, LONGEST_LINE, MOST_LINES = 36, 254, 9999
_RESERVED_WORDS = """
ABORT CALL END FOR IF JMP LBL PAUSE RUN SELECT SKIP WAIT CON PRN AUX NUL COM1
"""
RESERVED = frozenset(_RESERVED_WORDS.split())
# Frames of the program: their numbers on the controller, and the register that sets them.
FRAME = 9
_SHORTEST_MS, _LONGEST_MS = 1, 32000
_HEADER = """\
/PROG  {name}
/ATTR
OWNER\t\t= MNEDITOR;
COMMENT\t\t= "";
PROG_SIZE\t= 0;
CREATE\t\t= DATE 00-01-01  TIME 00:00:00;
MODIFIED\t= DATE 00-01-01  TIME 00:00:00;
FILE_NAME\t= ;
VERSION\t\t= 0;
LINE_COUNT\t= {lines};
MEMORY_SIZE\t= 0;
PROTECT\t\t= READ_WRITE;
TCD:  STACK_SIZE\t= 0,
      TASK_PRIORITY\t= 50,
      TIME_SLICE\t= 0,
      BUSY_LAMP_OFF\t= 0,
      ABORT_REQUEST\t= 0,
      PAUSE_REQUEST\t= 0;
DEFAULT_GROUP\t= 1,*,*,*,*;
CONTROL_CODE\t= 00000000 00000000;
/MN"""


def write(program: RobotProgram) -> tuple[ProgramFile, ...]:
    """Return the .ls files of a program, the one that is started first.

    Its timed motions are L or J with a time in whole milliseconds and CNT100.

    Raises:
        ProgramError: If its name is none for FANUC, a time cannot be written, or a pose has no
            configuration.
    """
    program = replace(program, name=program.name.upper())
    require_name(program.name, LONGEST_NAME, RESERVED, "FANUC")
    frames = list(_frames(program))
    lines = [_instruction(program, k) for k in range(len(program.moves))]
    if len(lines) + len(frames) <= MOST_LINES:
        files = [_file(program.name, [*frames, *_number_lines(lines)], program.moves)]
    else:
        # Each part's positions are its own.
        size = MOST_LINES
        parts = [slice(k, k + size) for k in range(0, len(lines), size)]
        names = [f"{program.name}_{k + 1}" for k in range(len(parts))]
        require_name(names[-1], LONGEST_NAME, RESERVED, "FANUC")
        calls = [f"CALL {name}" for name in names]
        files = [_file(program.name, [*frames, *calls], ())]
        files += [
            _file(name, _number_lines(lines[part]), program.moves[part])
            for name, part in zip(names, parts, strict=True)
        ]
    for file in files:
        require_lines(file.text, LONGEST_LINE, file.name)
    return tuple(files)


def _frames(program: RobotProgram) -> Iterator[str]:
    """Yield the lines that set and choose both frames, through a position register."""
    yield f"!Overwrites PR[{FRAME}], UFRAME[{FRAME}]"
    yield f"!and UTOOL[{FRAME}]: are they free?"
    yield "!PAYLOAD is the one in use"
    for word, pose in (("UTOOL", program.tool or HERE), ("UFRAME", program.base or HERE)):
        row = np.array([pose])
        position, angles = 1e3 * row[0, :3], wpr_of(row)[0]
        values = f"{numbers(position, MM_DECIMALS)},{numbers(angles, DEGREE_DECIMALS)}"
        for k, value in enumerate(values.split(","), start=1):
            yield f"PR[{FRAME},{k}]={value if not value.startswith('-') else f'({value})'}"
        yield f"{word}[{FRAME}]=PR[{FRAME}]"
        yield f"{word}_NUM={FRAME}"


def _instruction(program: RobotProgram, k: int) -> tuple[str, str]:
    """Return a motion before and after the number of its position."""
    move = program.moves[k]
    word = "L" if move.motion == "linear" else "J"
    if move.duration is None:
        speed = "10%" if word == "J" else f"{format_fixed(1e3 * (move.speed or 0.01), 1)}mm/sec"
        return f"{word} P[", f"] {speed} FINE"
    exact = 1e3 * move.duration
    ms = round(exact)
    if abs(exact - ms) > 1e-3 or not _SHORTEST_MS <= ms <= _LONGEST_MS:
        raise ProgramError(
            f"{program.name}: position {k + 1}: expected a time of {_SHORTEST_MS} to {_LONGEST_MS} whole"
            f" milliseconds, got {exact:.6g} ms"
        )
    end = "FINE" if k == len(program.moves) - 1 else "CNT100"
    return f"{word} P[", f"] {ms}msec {end}"


def _number_lines(lines: Sequence[tuple[str, str]]) -> list[str]:
    return [f"{before}{k}{after}" for k, (before, after) in enumerate(lines, start=1)]


def _file(name: str, lines: Sequence[str], moves: Sequence[ProgramMove]) -> ProgramFile:
    text = [_HEADER.format(name=name, lines=len(lines))]
    for number, line in enumerate(lines, start=1):
        motion = line[:3] in ("J P", "L P")
        text.append(f"{number:4d}:{line} ;" if motion else f"{number:4d}:  {line} ;")
    text.append("/POS")
    poses = [k for k, move in enumerate(moves) if move.pose is not None]
    angles = wpr_of(np.array([moves[k].pose for k in poses])) if poses else np.empty((0, 3))
    rotations = dict(zip(poses, angles, strict=True))
    for k, move in enumerate(moves):
        text += _position(k + 1, move, rotations.get(k))
    return ProgramFile(f"{name}.ls", "\n".join([*text, "/END", ""]))


def _position(number: int, move: ProgramMove, angles: np.ndarray | None) -> Iterator[str]:
    yield f"P[{number}]{{"
    yield "   GP1:"
    if move.joints is not None:
        yield f"\tUF : {FRAME}, UT : {FRAME},"
        degrees = numbers(np.rad2deg(move.joints), DEGREE_DECIMALS).split(",")
        values = [f"J{i}= {value} deg" for i, value in enumerate(degrees, start=1)]
        yield f"\t{', '.join(values[:3])},"
        yield f"\t{', '.join(values[3:])}"
    else:
        assert move.pose is not None
        assert angles is not None
        yield f"\tUF : {FRAME}, UT : {FRAME}, CONFIG : '{_configuration(move.configuration)}',"
        places = zip(
            "XYZ", numbers(1e3 * np.array(move.pose[:3]), MM_DECIMALS).split(","), strict=True
        )
        turns = zip("WPR", numbers(angles, DEGREE_DECIMALS).split(","), strict=True)
        yield f"\t{', '.join(f'{key} = {value} mm' for key, value in places)},"
        yield f"\t{', '.join(f'{key} = {value} deg' for key, value in turns)}"
    yield "};"


def _configuration(configuration: Configuration | None) -> str:
    if configuration is None:
        raise ProgramError("FANUC: expected the robot's posture with every pose, got none")
    letters = (
        "F" if configuration.wrist > 0 else "N",
        "D" if configuration.below else "U",
        "B" if configuration.behind else "T",
    )
    return f"{' '.join(letters)}, {', '.join(str(turn) for turn in configuration.turns)}"
