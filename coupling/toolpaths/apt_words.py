"""Words and numbers of APT cutter location data: what is left out, what is refused."""

from __future__ import annotations

import math
import re

from coupling.toolpaths.apt_statements import Statement
from coupling.toolpaths.gcode_codes import require_functions

NUMBER = re.compile(r"[+-]?(?:\d{1,15}(?:\.\d{0,25})?|\.\d{1,25})(?:E[+-]?\d{1,2})?")
# A vector may be so much longer or shorter than 1.
_LENGTH = 0.01
# Words that change nothing of the tip's path.
_TEXTS = "PARTNO PPRINT REMARK LETTER TITLES TPRINT PAINT DISPLY END-OF-PATH"
_TOOLS = ("TOOL PATH", "TLDATA", "LOADTL", "LOAD", "SELECT", "TOOLNO", "CUTTER")
_MACHINE = ("MACHIN", "COOLNT", "AUXFUN", "OPSTOP", "STOP", "SEQNO", "REWIND", "END")
_SETTINGS = ("INTOL", "OUTTOL", "TOLER", "CLPRNT", "NOPOST")
_IDLE = {*_TEXTS.split(), *_TOOLS, *_MACHINE, *_SETTINGS}
# Words that end what is refused here, and then change nothing.
_IDLE_WHEN_OFF = ("CYCLE", "CUTCOM", "TRACUT", "ARCSLP")
_REPETITION = "a repetition, a jump or a call: output its statements one after the other"
_REFUSED = {
    **dict.fromkeys(("COPY", "INDEX", "MACRO", "CALL", "LOOPST", "JUMPTO"), _REPETITION),
    "CYCLE": "a cycle: output its moves as GOTO",
    "CUTCOM": "cutter radius compensation: output the tool's centre",
    "INSERT": "a block for the controller, which is not known here: take it out",
    "PREFUN": "a preparatory function of the controller: take it out",
    "OPSKIP": "statements that are skipped or not: take them out",
    "TRACUT": "a transformation of the points: output them transformed",
    "TRANS": "a shift of the points: output them shifted",
    "ORIGIN": "an origin of the machine: output points in one frame",
    "TRACYL": "a path wrapped on a cylinder: output its points",
    "ROTABL": "a turn of the machine's table: output points and axes in the part's frame",
    "ROTATE": "a turn of the machine's table: output points and axes in the part's frame",
    "ROTHED": "a turn of the machine's head: output points and axes in the part's frame",
    "RETRCT": "a retraction that the machine knows: output its moves as GOTO",
    "CLEARP": "a plane that the machine retracts to: output its moves as GOTO",
    "NURBS": "a spline: output its points as GOTO",
    "THREAD": "a thread: output its moves as GOTO",
}
_DRIVEN = "GO GOFWD GOLFT GORGT GOBACK INDIRV INDIRP TLON TLLFT TLRGT"
_GEOMETRY = frozenset(_DRIVEN.split())


def idle_word(statement: Statement) -> str | None:
    """Return the word under which a statement is left out; None where it is executed or refused.

    Raises:
        ValueError: If it is an auxiliary function that is more than one of the machine, as M98.
    """
    word, arguments = statement.word, statement.arguments
    if word == "AUXFUN":
        require_functions([float(text) for text in arguments if NUMBER.fullmatch(text)])
    if word in _IDLE:
        return word
    if word in _IDLE_WHEN_OFF and arguments in (("OFF",), ("NOMORE",)):
        return f"{word}/{arguments[0]}"
    return None


def tool_of(statement: Statement) -> tuple[str, ...]:
    """Return what names a tool in a statement, comparable with others of its word; empty for none.

    Example:
        >>> tool_of(Statement(1, "TOOL PATH", ("ROUGH", "TOOL", "MILL")))
        ('MILL',)
        >>> tool_of(Statement(2, "LOADTL", ("1", "ADJUST", "1"))), tool_of(Statement(3, "GOTO", ("1",)))
        (('1',), ())
    """
    arguments = statement.arguments
    if statement.word == "TOOL PATH":
        return arguments[2:3] if arguments[1:2] == ("TOOL",) else ()
    if statement.word == "LOAD":
        return arguments[1:2] if arguments[:1] == ("TOOL",) else ()
    if statement.word in ("LOADTL", "TOOLNO"):
        return arguments[:1]
    return arguments if statement.word in ("CUTTER", "TLDATA") else ()


def refusal(statement: Statement) -> str:
    """Return why a statement is refused, and what to do."""
    word = statement.word
    if word in _REFUSED:
        return f"expected no {word}, got {_REFUSED[word]}"
    if "=" in word or word in _GEOMETRY:
        return (
            f"expected cutter locations, got the geometry of a part program, {word[:20]!r}: output"
            " CLDATA, with GOTO"
        )
    return (
        f"expected a statement of cutter location data, got {word[:20]!r}: take it out if it does not"
        " move the tool"
    )


def numbers(arguments: tuple[str, ...]) -> tuple[float, ...]:
    """Return the numbers of a statement.

    Raises:
        ValueError: If an argument is none.
    """
    for word in arguments:
        if not NUMBER.fullmatch(word):
            raise ValueError(f"expected numbers, got {word[:20]!r}")
    return tuple(map(float, arguments))


def unit_vector(vector: tuple[float, ...]) -> tuple[float, ...]:
    """Return a vector at length 1.

    Raises:
        ValueError: If it is far from that length.
    """
    length = math.hypot(*vector)
    if abs(length - 1.0) > _LENGTH:
        raise ValueError(f"expected a vector of length 1, got length {length:.4g}")
    return tuple(value / length for value in vector)
