"""Statements of KRL that cannot change the path: outputs, waits, messages, settings of PTP."""

from __future__ import annotations

import re

from coupling.errors import ProgramError
from coupling.programs.krl.functions import FUNCTIONS
from coupling.programs.krl.syntax import KrlLine, called_names
from coupling.programs.text import shorten

_STATEMENTS = """
WAIT HALT BRAKE CONTINUE PULSE ANOUT CONST_VEL ON_ERROR_PROCEED ERR_CLEAR CONFIRM
"""
_WORDS = frozenset(_STATEMENTS.split())
_SYSTEM_WORDS = """
$ACC $ACC_AXIS $ACC_EXTAX $ACC_CAR_TOOL $ACT_BASE $ACT_TOOL $ANOUT $APO $BWDSTART
$COLLMON_TOL_PRO $CYCFLAG $ECO_LEVEL $FILTER $FLAG $GEAR_JERK $H_POS $H_POS_TOL $JERK $LOAD $LOAD_A1
$LOAD_A2 $LOAD_A3 $LOOP_CONT $MSG_T $OUT $OUT_C $RED_ACC $RED_VEL $SPL_VEL_MODE $TIMER $TIMER_FLAG
$TIMER_STOP $TORQMON $TORQMON_COM $TORQMON_DEF $TORQMON_TIME $VEL_AXIS $VEL_EXTAX $VEL_PTP
"""
# System variables that do not say where the tool goes along a line, or how fast.
HARMLESS_VARIABLES = frozenset(_SYSTEM_WORDS.split())
# Components of $VEL beside the speed of the path.
HARMLESS_SPEEDS = frozenset(("ORI1", "ORI2"))
_CALLS = re.compile(
    r"MSG(?:NOTIFY|QUIT|STATE|LOAD|DIALOG)|(?:SET|CLEAR|EXISTS|GET)_KRL(?:MSG|DLG|DLGANSWER)"
    r"|EKI_(?:INIT|OPEN|CLOSE|CLEAR|CLEARBUFFER|SEND|LOCK|UNLOCK|CHECKBUFFER)"
    r"|EKI_[SG]ET(?:BOOL|INT|REAL|STRING|FRAME)(?:ARRAY)?"
    r"|STR(?:ADD|CLEAR|COMP|COPY|DECLLEN|FIND|LEN)|STRTO(?:BOOL|INT|REAL|STRING|FRAME|POS|E6POS)"
    r"|SWRITE|SREAD|VARSTATE|VARTYPE"
)
# Functions in settings of the pendant's spline motions.
_SETTINGS = re.compile(r"S(?:ACC|APO|GEAR|JERK|LOAD|VEL)\w*|USE_CM_PRO_VALUES")
_SPOKEN_WORDS = "WAIT FOR SEC AND OR NOT EXOR B_AND B_OR B_NOT B_EXOR PULSE ANOUT DO"
_KEYWORDS = frozenset(_SPOKEN_WORDS.split())
# Motions behind another statement, outside of texts.
_MOTION = re.compile(r"(?<![#\w$.])(?:S?PTP|S?LIN|S?CIRC|SPL)(?:_REL)?\s*[ {(]", re.IGNORECASE)
_STRING = re.compile(r'"[^"]*"')
# Technology packages are switched on in the INI fold of programs that a pendant makes.
_INITIALIZED = re.compile(
    r"(?:USERSPOT|USER_GRP|H50|H70|A10|A20)\s*\(\s*(?:#?\w*INI\w*|0)\s*[,)].*",
    re.IGNORECASE,
)
_BAS = re.compile(
    r"BAS\s*\(\s*#(ACC_CP|ACC_GLUE|ACC_PTP|VEL_PTP|OUT_SYNC|OUT_ASYNC)\b", re.IGNORECASE
)
_OUTPUTS = frozenset(("$OUT", "$OUT_C", "$ANOUT", "$FLAG", "$CYCFLAG"))
_ASSIGNED = re.compile(r"([$A-Za-z_][\w$]*)[^=<>]*=(?!=)")
_TRIGGERED = re.compile(r"\bDO\b\s*(.+)", re.IGNORECASE)


def is_harmless_call(name: str) -> bool:
    """Return whether a routine, which the program does not hold, only tells or asks something.

    Args:
        name: Name in upper case.
    """
    return _CALLS.fullmatch(name) is not None


def harmless_word(line: KrlLine) -> str | None:
    """Return the word under which a statement is left out; None where it is executed or refused.

    Example:
        >>> harmless_word(KrlLine("line 1", "$OUT[3]=TRUE", "$OUT"))
        '$OUT'
        >>> harmless_word(KrlLine("line 2", "$BASE.X=3", "$BASE"))
    """
    if _MOTION.search(_STRING.sub("", line.text)) or not _calls_nothing(line):
        return None
    if line.word in _WORDS:
        return line.word
    if line.word == "TRIGGER":
        return "TRIGGER" if _is_output(line.text) else None
    if line.word == "INTERRUPT":
        return None
    if (call := _BAS.match(line.text)) is not None:
        return f"BAS(#{call[1].upper()})"
    if _INITIALIZED.fullmatch(line.text):
        return line.word
    assignment = _ASSIGNED.match(line.text)
    if assignment is not None and line.word in HARMLESS_VARIABLES:
        return line.word
    if assignment is None and is_harmless_call(line.word):
        return line.word
    if re.match(r"\$VEL\.ORI[12]\s*=", line.text, re.IGNORECASE):
        return "$VEL.ORI"
    return None


def require_no_call(line: KrlLine) -> None:
    """Refuse a statement that would be left out if it did not call a routine, which may move.

    Raises:
        ProgramError: If it is one.
    """
    if line.word in _WORDS | HARMLESS_VARIABLES and not _calls_nothing(line):
        raise ProgramError(
            f"{line.where}: expected {line.word} without a call of a routine, got"
            f" {shorten(line.text)!r}: call it in a line before, and use its result"
        )


def _calls_nothing(line: KrlLine) -> bool:
    """Return whether a wait or a setting calls no routine that is to be executed or refused."""
    if line.word not in _WORDS and not line.word.startswith("$"):
        return True
    names = called_names(_STRING.sub("", line.text)) - _KEYWORDS - FUNCTIONS
    return all(is_harmless_call(name) or _SETTINGS.fullmatch(name) for name in names)


def _is_output(text: str) -> bool:
    """Return whether a trigger does no more than to set an output."""
    trigger = _TRIGGERED.search(text)
    if trigger is None:
        return False
    action = trigger[1]
    if re.match(r"PULSE\b", action, re.IGNORECASE):
        return True
    assignment = _ASSIGNED.match(action)
    return assignment is not None and assignment[1].upper() in _OUTPUTS
