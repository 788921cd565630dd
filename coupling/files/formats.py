"""What a file is by its first lines, for those that are given as what they are not."""

from __future__ import annotations

import codecs
import re
from collections.abc import Collection
from dataclasses import dataclass

# So much of a file tells what it is [bytes].
_LOOKED_AT = 16_384


@dataclass(frozen=True)
class FileFormat:
    """A format that tool paths, programs and shapes come in.

    Attributes:
        name: Noun with its article.
        kind: The kind of tool path that reads it; None if there is none.
        remedy: Advice where it is not read, an imperative.
    """

    name: str
    kind: str | None
    remedy: str
    pattern: re.Pattern[str]


_TO_GCODE = "export G-code from the CAM system"
_SHAPE = "a shape without a path: plan the path in a CAM system and export G-code"
_DRAWING = "lines without feeds: export G-code from the CAM system"
_TO_PROGRAM = "export KRL, RAPID, FANUC .ls or G-code"


def _format(name: str, kind: str | None, remedy: str, pattern: str) -> FileFormat:
    return FileFormat(name, kind, remedy, re.compile(pattern, re.MULTILINE | re.IGNORECASE))


def _program(name: str, ending: str, pattern: str) -> FileFormat:
    return _format(
        name, "program", f'give it as kind = "program" with the ending {ending}', pattern
    )


# The first that matches is it; those that begin with a signature come first.  Repetitions before a
# choice are possessive: a page of blanks would else be tried from every blank.
_FORMATS = (
    _format(
        "a STEP-NC program", None, _TO_GCODE, r"FILE_SCHEMA\s*\(\s*\(\s*'[^'\n]*(?:CNC|INTEGRATED)_"
    ),
    _format("a STEP file", None, _SHAPE, r"\A\s*ISO-10303-21\s*;"),
    _format("an IGES file", None, _SHAPE, r"\A.{72}S +1\s*$"),
    _format("an STL file", None, _SHAPE, r"\A\s*solid\b[^\n]*\n\s*facet\s+normal"),
    _format("a DXF file", None, _DRAWING, r"\A\s*(?:999\s*\n[^\n]*\n\s*)?0\s*\n\s*SECTION\b"),
    _format("a PostScript file", None, _DRAWING, r"\A%!PS"),
    _format("a Gerber file", None, _TO_GCODE, r"^%(?:FS[LT][AI]|MO(?:MM|IN))"),
    _format("an Excellon drill file", None, _TO_GCODE, r"\A\s*(?:;[^\n]*\n\s*)*M48\s*$"),
    _format("an HTML page", None, "give the file itself", r"\A\s*<(?:!DOCTYPE html|html)\b"),
    _format("an SVG drawing", None, _DRAWING, r"<svg\b"),
    _format("a Staubli VAL 3 program", None, _TO_PROGRAM, r"<Programs?\b[^>\n]*robotics/VAL3"),
    _format(
        "a list of ABB modules",
        None,
        "give the .mod that has main, the others beside it",
        r"<Module>[^<\n]*\.modx?</Module>",
    ),
    _format("an XML file", None, _TO_GCODE, r"\A\s*<\?xml\b"),
    _program("a FANUC program", ".ls", r"\A\s*/PROG\b"),
    _format("a Yaskawa job", None, _TO_PROGRAM, r"\A\s*/JOB\b"),
    _format("a Kawasaki AS program", None, _TO_PROGRAM, r"^[ \t]*\.PROGRAM\b"),
    _format("a Hyundai program", None, _TO_PROGRAM, r"\AProgram File Format Version"),
    _format(
        "a Denso PAC program", None, _TO_PROGRAM, r"^[ \t]*TAKEARM\b|^[ \t]*MOVE[ \t]+[LPC][ \t]*,"
    ),
    _format("an Epson SPEL+ program", None, _TO_PROGRAM, r"^[ \t]*Fend\b"),
    _format("a KAREL, PDL2 or SCOL program", None, _TO_PROGRAM, r"^[ \t]*PROGRAM[ \t]+\w"),
    _format(
        "a Mitsubishi MELFA program",
        None,
        _TO_PROGRAM,
        r"^[ \t]*+(?:\d++[ \t]++)?+M(?:ov|vs|vr)[ \t]+P\w+[ \t,]*$",
    ),
    _format("a Nachi program", None, _TO_PROGRAM, r"^[ \t]*+(?:\d++[ \t]++)?+MOVEX[ \t]"),
    _format("a Doosan program", None, _TO_PROGRAM, r"^[ \t]*move[jl]x?\s*\(\s*pos[jx]\s*\("),
    _program(
        "a KRL program",
        ".src",
        r"^[ \t]*(?:&ACCESS\b|(?:GLOBAL\s+)?DEF(?:DAT|FCT)?[ \t]+\w+[ \t]*\([^)\n]*\)(?![ \t]*:)"
        r"|DEFDAT[ \t]+\w+|(?:S?PTP|S?LIN)\s+(?:\{|X\w+))",
    ),
    _program(
        "a RAPID program", ".mod", r"^[ \t]*(?:MODULE\s+\w+|PROC\s+\w+\s*\(|Move[LJ]\s+\S+\s*,|%%%)"
    ),
    _format(
        "a UR script",
        None,
        _TO_PROGRAM,
        r"^[ \t]*(?:def\s+\w+\(\s*\)\s*:|(?:move[jlp]|servoj|set_tcp)\s*\()",
    ),
    _format(
        "a Heidenhain dialogue program",
        None,
        "post-process the part for DIN/ISO",
        r"^[ \t]*+(?:\d++\s*+)?+(?:BEGIN PGM\b|TOOL CALL\b|CYCL DEF\b|(?:L|CC|LN)\s+[XYZ][-+])",
    ),
    _format(
        "an APT/CLDATA file",
        "apt",
        'give it as kind = "apt"',
        r"^[ \t]*(?:\d+\s+)?(?:\$\$|PARTNO\b|END-OF-PATH|(?:TOOL PATH|TLDATA|GOTO|FROM|LOADTL|LOAD"
        r"|FEDRAT|SPINDL|MULTAX|CUTTER|PPRINT|MSYS)\s*/)",
    ),
    _format(
        "an HPGL plot",
        None,
        _DRAWING,
        r"\A[\s\x1b]*+(?:[^\n]*+\n)?(?:IN|DF|SP\d|PA|P[UD])[-\d, ]*;",
    ),
    _format("a file of Mastercam (NCI)", None, _TO_GCODE, r"\A(?:\s*10\d\d\s*\n(?:-?[\d.]+ *)+$)"),
    _format("a DSTV file", None, _TO_GCODE, r"\AST\s*$"),
    _format("a woodWOP program", None, _TO_GCODE, r"\A\[H\s*$"),
    _format("JSON", None, _TO_GCODE, r'\A\s*(?:\{\s*"|\[\s*[\[{"\d-])'),
    _format("a TOML file", None, "give the file that it names", r"^\[{1,2}[a-z_][\w.]*\]{1,2}\s*$"),
    _format(
        "a program in Python",
        None,
        "run it, and give the file that it writes",
        r"^(?:import \w|from [\w.]+ import )",
    ),
    _format(
        "G-code",
        "gcode",
        'give it as kind = "gcode"',
        r"^[ \t]*+(?:/[ \t]*+)?+(?:N[ \t]*+\d++[ \t]*+)?+(?:G[ \t]*\d+(?:\.\d)?|M[ \t]*\d+|[TO]\d+)"
        r"\s*(?:[A-Z][-+.\d ]|[(;*]|$)",
    ),
    _format(
        "a table of values",
        "csv",
        'give it as kind = "csv" with the columns time, x, y, z, qx, qy, qz, qw',
        r"\A[\w.+\-/()\[\] \"]+(?:[,;\t][\w.+\-/()\[\] \"]*){2,}$",
    ),
)
_MAGIC = {
    b"PK\x03\x04": "a zip archive",
    b"\x1f\x8b": "a gzip archive",
    b"%PDF": "a PDF",
    b"\xfe\xef": "a binary FANUC program, which the control also writes as .ls",
    b"\x7fELF": "an executable",
    b"MZ": "an executable",
}


def binary_name(content: bytes) -> str | None:
    """Return what a file that is no text is, a noun; None for a text.

    Example:
        >>> binary_name(b"%PDF-1.7"), binary_name(b"G21 G90")
        ('a PDF', None)
    """
    for magic, name in _MAGIC.items():
        if content.startswith(magic) and (len(magic) > 2 or b"\0" in content[:_LOOKED_AT]):
            return name
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "text in UTF-16"
    return "binary data" if b"\0" in content[:_LOOKED_AT] else None


def other_format(content: bytes, kinds: Collection[str]) -> str | None:
    """Return what a file is and what to do, "got X: do Y", if it is of none of these kinds.

    Args:
        kinds: Kinds of tool path that a reader takes.

    Returns:
        The end of an error's sentence; None for a file of these kinds, or of an unknown format.

    Example:
        >>> other_format(b"MODULE part", ["gcode"])
        'got a RAPID program: give it as kind = "program" with the ending .mod'
        >>> other_format(b"G21 G90", ["gcode"])
    """
    binary = binary_name(content)
    if binary is not None:
        return f"got {binary}: give a text file in ASCII or UTF-8"
    text = content[:_LOOKED_AT].removeprefix(codecs.BOM_UTF8).decode("latin-1")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    for candidate in _FORMATS:
        if candidate.pattern.search(text):
            return None if candidate.kind in kinds else f"got {candidate.name}: {candidate.remedy}"
    return None
