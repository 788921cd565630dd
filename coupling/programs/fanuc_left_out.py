"""Instructions of FANUC programs that cannot change a path: the only ones that are left out."""

from __future__ import annotations

import re

# Instructions by the words under which they are listed; each pattern begins them.
_LEFT_OUT = {
    "DO[]": r"DO\[",
    "RO[]": r"RO\[",
    "GO[]": r"GO\[",
    "AO[]": r"AO\[",
    "SO[]": r"SO\[",
    "UO[]": r"UO\[",
    "WO[]": r"WO\[",
    "F[]": r"F\[",
    "M[]": r"M\[",
    "SR[]": r"SR\[",
    "WAIT": r"WAIT\b",
    "MESSAGE": r"MESSAGE\[",
    "UALM": r"UALM\[",
    "TIMER": r"TIMER(?:_OVERFLOW)?\[",
    "RSR": r"RSR\[",
    "PAUSE": r"PAUSE$",
    "PAYLOAD": r"PAYLOAD\[",
    "COL DETECT": r"COL DETECT\s+(?:ON|OFF)$",
    "COL GUARD": r"COL GUARD ADJUST\b",
    "MONITOR": r"MONITOR\s",
    "LOCK PREG": r"(?:UN)?LOCK PREG$",
    "SKIP CONDITION": r"SKIP CONDITION\s",
    "ERROR_PROG": r"ERROR_PROG\s*=",
    "RESUME_PROG": r"RESUME_PROG(?:\[\d+\])?\s*=",
    "DIAG_REC": r"DIAG_REC\[",
    "JOINT_MAX_SPEED": r"JOINT_MAX_SPEED\[",
    "Arc Start": r"ARC\s+START\s*\[",
    "Arc End": r"ARC\s+END\s*\[",
    "Weld Start": r"WELD\s+START\s*\[",
    "Weld End": r"WELD\s+END\s*\[",
    "Weave End": r"WEAVE\s+END\b",
    "$WAITTMOUT": r"\$WAITTMOUT\s*=",
}
_PATTERNS = tuple((re.compile(pattern, re.IGNORECASE), word) for word, pattern in _LEFT_OUT.items())
# What a string gives to a register.
OUTCOME = re.compile(r"(?:STRLEN|FINDSTR)\b", re.IGNORECASE)


def left_out_word(instruction: str) -> str | None:
    """Return the word under which an instruction is listed as left out; None if it is not left out.

    Example:
        >>> left_out_word("DO[3]=ON"), left_out_word("UFRAME_NUM=2")
        ('DO[]', None)
    """
    for pattern, word in _PATTERNS:
        if pattern.match(instruction):
            return word
    return None
