"""What stands in G-code that is no word of a letter and a number: what is read, and its names."""

from __future__ import annotations

import re
from dataclasses import dataclass

from coupling.programs.reading import ReadingNotes
from coupling.programs.text import shorten

# Statements of Siemens' that move nothing: messages, the blank's size, smoothing.
_IDLE_STATEMENT = re.compile(
    r"\s*(?:N\d+\s*)?((?:MSG|WORKPIECE|CYCLE832|GROUP_BEGIN|GROUP_END)\s*\(.*\)"
    r"|TRANS|ROT|SCALE|MIRROR|STOPRE|FFWON|FFWOF|SOFT|BRISK|COMPOF|COMPON|COMPCAD|COMPCURV|COMPSURF|CFTCP|CFC|KONT|NORM|CUT2DF?|DYN(?:NORM|POS|ROUGH|SEMIFIN|FINISH))\s*(?:;.*)?",
    re.IGNORECASE | re.DOTALL,
)
# The tool by its name, and words of further spindles; those of the first are S and M.
_TOOL_NAME = re.compile(r'T\d*="[^"]*"|T\d*=\d+|[SM][2-9]=\d+')
_SELECTED_TOOL = re.compile(r'T\d*="?([^"]*)')
# How far corners may be rounded, which are driven to their points.
_SMOOTHING = re.compile(r"(?:ADIS|ADISPOS|CTOL|OTOL)=(?:\d+(?:\.\d*)?|\.\d+)")
_FIRST_SPINDLE = re.compile(r"([SM])1=(?=\d)")
# Statements of Siemens' on the tool's direction, and components of it as a vector.
_STATEMENT = re.compile(r"TRAORI(?:\(\d?\))?|TRAFOOF(?:\(\))?|ORIWKS|ORIMKS|ORIVECT|ORIAXES")
_BASE_DIRECTION = re.compile(r"TRAORI\s*\([^)]*,", re.IGNORECASE)
_TILTED_PLANE = re.compile(
    r"\s*(?:N\d+\s*)?(CYCLE800\s*\([^()]*\))\s*(?:;.*)?", re.IGNORECASE | re.DOTALL
)
_COMPONENT = re.compile(r"([ABC]3)=([+-]?(?:\d+(?:\.\d*)?|\.\d+))(?![\dE.])")
_HOMING = ("$H", "$X")
# Axes that printers name without a number, to home them or to switch them off, and their messages.
_HOMED_AXES = re.compile(r"(?:N\d+)?(?:G28|G29)(?=[A-Z\d.+-]*$)")
_FREED_AXES = re.compile(r"((?:N\d+)?(?:M17|M18|M84))[XYZE]+")
# A place as SIEMENS' posts may write it.
_PLACE_BY_SIGN = re.compile(r"(?<![A-Z])([A-Z])=(?=[-+]?[\d.])")
_MESSAGE = re.compile(r"\s*(M(?:117|118|16|862\.3|486|555|23|32))\b.*", re.IGNORECASE | re.DOTALL)

_VARIABLES = "let the post-processor write numbers"
_WRITTEN_OUT = "let the post-processor write its moves out"
# What stands where words end, by what it is and what to do; the first that matches is it.
_AT_END = (
    (r"O[\w<>.#]*?(?:ENDSUB|SUB|CALL|RETURN)", "an O-word, a sub-program", _WRITTEN_OUT),
    (
        r"O[\w<>.#]*?(?:IF|ELSE|WHILE|DO|REPEAT|BREAK|CONTINUE)",
        "an O-word, a loop or a condition",
        _WRITTEN_OUT,
    ),
    (r"O<", "an O-word, a sub-program or a loop", _WRITTEN_OUT),
    (r"#", "a variable", _VARIABLES),
    (r"[A-Z]#|[A-Z]-#", "a variable", _VARIABLES),
    (r"[A-Z]?-?\[", "an expression", _VARIABLES),
    (r"R\d+=", "an R parameter", _VARIABLES),
    (r"Q\d+=|D\d+:|Q[LR]\d+", "a Q parameter", _VARIABLES),
    (
        r"[ABC]=(?:DC|ACP|ACN|AC|IC)",
        "a rotary position in another form",
        "write its angle; where axes go the shortest way, name them in shortest of [tool_path.rotary]",
    ),
    (r"[A-Z]-?[RQ]\d|[A-Z]=", "a parameter or an assignment", _VARIABLES),
    (
        r"[ABC][2-9]=|(?:LEAD|TILT|THETA|PSI)=?|A[BC]?N=",
        "a direction of the tool in another form",
        "post-process with A3=, B3=, C3= or rotary axes",
    ),
    (
        r"ORI[A-Z]+|TCARR|TCO[A-Z]+|TOROT[A-Z]*|PAROT[A-Z]*",
        "a way of the tool's direction",
        "post-process with ORIWKS, ORIVECT or ORIAXES",
    ),
    (r"CALL|MCALL|EXTCALL|L\d+P", "a call of a sub-program", _WRITTEN_OUT),
    (r"CYCLE800", "a tilted plane within a line", "write CYCLE800(...) alone in its line"),
    (r"CYCLE\d+|POCKET\d|SLOT\d|HOLES\d|LONGHOLE", "a cycle", _WRITTEN_OUT),
    (
        r"TRAORI|TRACYL|TRANSMIT|TRAANG|TRACON",
        "a transformation of axes",
        "use TRAORI, TRAORI(1) or none",
    ),
    (r"A?(?:TRANS|ROTS?|SCALE|MIRROR)", "a frame of the program", "post-process in one frame"),
    (
        r"IF|ELSE|ENDIF|WHILE|FOR|END|GOTO[BFC]?|REPEAT|LOOP|UNTIL|CASE|DO\d",
        "a loop or a condition",
        _WRITTEN_OUT,
    ),
    (r"DEF|PROC|EXTERN|VARS?\b|SETPIECE", "a declaration", _VARIABLES),
    (r"[BC]?SPLINE|POLY|NURBS", "a spline", "post-process with lines and arcs"),
    (
        r"TURN=|AR=|CT|CIP|I1=|RP=|AP=",
        "an arc or a place in another form",
        "post-process with X, Y, Z and I, J, K",
    ),
    (r",[CR]", "a chamfer or a rounded corner", _WRITTEN_OUT),
    (r"[A-Z][-+]?\d+,\d", "a decimal comma", "write a point"),
    (r"\$", "a setting of the control", "take it out"),
    (r"[{]", "a JSON setting of the control", "take it out"),
    (r"CH[FR]=|RNDM?=", "a chamfer or a rounded corner", _WRITTEN_OUT),
    (
        r"(?![XYZIJKRFSTMGN]+(?:[-+.\d*/)]|$))[A-Z]{2,}",
        "a word of another control",
        "take it out if it does not move the tool",
    ),
    (r"[A-Z][-+.]*(?:[A-Z*/)]|$)", "a word without a number", "give the number"),
    (r"\)", "the end of a comment that has no beginning", "write '(' before it"),
    (r"/", "a / within a line", "write it at the line's beginning"),
    (r"[-+*]", "an expression", _VARIABLES),
)
_REFUSED_STATEMENTS = tuple(
    (re.compile(pattern), name, remedy) for pattern, name, remedy in _AT_END
)


@dataclass(frozen=True, slots=True)
class CommonWords:
    """A line that is written in another form.

    Attributes:
        code: Its words of a letter and a number.
        statements: Its statements on the tool's direction, without blanks.
        components: Components of its tool vector by their names A3, B3, C3.
        tool: Name of the tool that it selects; empty if none.
    """

    code: str
    statements: tuple[str, ...] = ()
    components: tuple[tuple[str, float], ...] = ()
    tool: str = ""


def is_text(line: str) -> bool:
    """Return whether a line has a statement with a text, a message for instance."""
    return bool(_IDLE_STATEMENT.fullmatch(line) or _MESSAGE.fullmatch(line))


def common_words(line: str, code: str, notes: ReadingNotes) -> CommonWords:
    """Return a line's words where it writes them in another form; what moves nothing is left out.

    Args:
        code: Its words without comments and blanks, in capitals.
        notes: Notes on words left out, added to.
    """
    if idle := _IDLE_STATEMENT.fullmatch(line):
        notes.leave_out(shorten(re.sub(r"\s*\(.*", "", idle[1], flags=re.DOTALL).upper(), 20))
        return CommonWords("")
    if plane := _TILTED_PLANE.fullmatch(line):
        return CommonWords("", ("".join(plane[1].split()).upper(),))
    if message := _MESSAGE.fullmatch(line):
        notes.leave_out(message[1].upper())
        return CommonWords("")
    if re.fullmatch(r"N\d+%.*", code):  # the last line of DIN/ISO, with the program's name
        return CommonWords("M30")
    if freed := _FREED_AXES.fullmatch(code):
        return CommonWords(freed[1])
    if _HOMED_AXES.match(code):
        return CommonWords(re.sub(r"([A-Z])(?=[A-Z]|$)", r"\g<1>0", code))
    if code in _HOMING:
        # A return to the reference point, as G28; $X only unlocks.
        notes.leave_out(code)
        return CommonWords("G28" if code == "$H" else "")
    plain, smoothings = _SMOOTHING.subn("", code)
    if smoothings:
        notes.leave_out("ADIS=, CTOL=")
    without, count = _TOOL_NAME.subn("", _FIRST_SPINDLE.sub(r"\1", plain))
    if count:
        notes.leave_out("T=" if "T" in code else "S=")
    tool = _SELECTED_TOOL.search(code)
    statements = tuple(_STATEMENT.findall(without))
    if "TRAORI" in statements and _BASE_DIRECTION.search(line):
        raise ValueError(
            "expected TRAORI without a base orientation, got further numbers: give it in the tool's data"
        )
    components = tuple((name, float(value)) for name, value in _COMPONENT.findall(without))
    words = _PLACE_BY_SIGN.sub(r"\1", _COMPONENT.sub("", _STATEMENT.sub("", without)))
    return CommonWords(
        words.replace("CR=", "R").replace("SUPA", "G53"),
        statements,
        components,
        tool[1] if tool else "",
    )


def refusal(code: str, end: int) -> str:
    """Return the sentence for a line that has something else behind its words.

    Args:
        code: Its words without comments and blanks, in capitals.
        end: Number of the characters of its words.
    """
    remaining = code[end:]
    # A number's end may belong to it: O100SUB, R1=5, X1,5.
    head = re.search(r"[A-Z][-+]?[\d.]*$", code[:end])
    for text in (head[0] + remaining if head else remaining, remaining):
        for pattern, name, remedy in _REFUSED_STATEMENTS:
            if pattern.match(text):
                return (
                    f"expected words of a letter and a number, got {name} {text[:20]!r}: {remedy}"
                )
    return (
        f"expected words of a letter and a number, got {remaining[:20]!r}: not G-code that is known"
        " here, take it out"
    )
