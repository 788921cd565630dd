"""Instructions of FANUC programs that cannot change a path: the only ones that are left out."""

from __future__ import annotations

import re
from collections.abc import Mapping

from coupling.programs.fanuc.syntax import TpText

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
    "TC_ONLINE": r"TC_ONLINE\b",
    "$WAITTMOUT": r"\$WAITTMOUT\s*=",
}
_PATTERNS = tuple((re.compile(pattern, re.IGNORECASE), word) for word, pattern in _LEFT_OUT.items())
# What a string gives to a register.
OUTCOME = re.compile(r"(?:STRLEN|FINDSTR)\b", re.IGNORECASE)

# Branches of a program without an effect on the path have none themselves; what one of them does stands
# behind the last comma before a word.
_FLOW = re.compile(r"(?:IF\b.*\bTHEN|ELSE|ENDIF|END|LBL\[.*\]|JMP LBL\[.*\])", re.IGNORECASE)
_ACTION = re.compile(
    r"(?:^(?:IF|SELECT)\b.*?|^=.*?|^ELSE\s*),\s*((?:JMP|CALL|RUN|[A-Z_$]+\s*\[)[^,]*(?:\([^()]*\))?.*)$",
    re.IGNORECASE,
)
CALL = re.compile(r"(?:CALL|RUN)\s+([\w-]+)\s*(?:\(.*\))?", re.IGNORECASE)


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


def is_harmless(name: str, files: Mapping[str, TpText]) -> bool:
    """Return whether a program is there and cannot change a path, whatever its branches.

    Args:
        files: Programs by their names in capitals.
    """
    return name.upper() in files and not first_effect(name, files)


def first_effect(name: str, files: Mapping[str, TpText]) -> str:
    """Return the first instruction of a program, or of what it calls, that may change a path.

    Args:
        files: Programs by their names in capitals.

    Returns:
        The instruction; empty if there is none.
    """
    waiting, visited = [name.upper()], set()
    while waiting:
        title = waiting.pop()
        if title in visited:
            continue
        visited.add(title)
        if title not in files:
            return f"CALL {title}"
        for instruction in files[title].instructions:
            words = instruction.text
            action = _ACTION.search(words)
            if action is not None:
                words = action[1]
            if (call := CALL.fullmatch(words)) is not None:
                waiting.append(call[1].upper())
            elif left_out_word(words) is None and not _FLOW.fullmatch(words):
                return instruction.text
    return ""
