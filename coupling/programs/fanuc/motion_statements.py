"""Motion instructions of FANUC programs, taken apart: target, speed, and every option by its name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from coupling.errors import ProgramError
from coupling.programs.text import shorten

_INDEX = r"\[((?:[^\[\]]|\[[^\[\]]*\])*)\]"
_BRACKETS = r"\[(?:[^\[\]]|\[[^\[\]]*\])*\]"
_REGISTER = rf"A?R{_BRACKETS}"
_TARGET = re.compile(rf"([JLCAS])\s*(PR?){_INDEX}\s*", re.IGNORECASE)
_VIA = re.compile(rf"(PR?){_INDEX}\s*", re.IGNORECASE)
_SPEED = re.compile(
    rf"((?:\d+\.?\d*|\.\d+)|{_REGISTER})\s*(%|mm/sec|cm/min|inch/min|deg/sec|msec|sec)(?![\w/])\s*",
    re.IGNORECASE,
)
# Speeds whose numbers the controller or a welding schedule has.
_NAMED_SPEED = re.compile(r"(?:max_speed|WELD_SPEED)(?!\w)\s*", re.IGNORECASE)
_END = re.compile(rf"(?:FINE|(?:CNT|CD|CR)\s*(?:\d+|{_REGISTER}))(?!\w)\s*", re.IGNORECASE)
_STOP = re.compile(r"FINE|CNT\s*0+", re.IGNORECASE)
_WORD = re.compile(r"[^\s,]+")
_ACTION = (
    rf"(?:P-SPS|CALL\s+\w+(?:\s*\([^()]*\))?|(?:DO|RO|GO|AO|SO|UO|WO|F){_BRACKETS}\s*=\s*"
    rf"(?:PULSE(?:\s*,\s*[\d.]+\s*sec)?|ON|OFF|\([^()]*\)|{_REGISTER}|-?[\d.]+))"
)

Kind = Literal["offset", "tool_offset", "incremental", "call", "left out", "refused"]


@dataclass(frozen=True)
class MotionOption:
    """An option of a motion.

    Attributes:
        kind: Treatment of it.
        words: Its words in the program.
        argument: Index of its position register, or what it does on the way; empty where none stands.
    """

    kind: Kind
    words: str
    argument: str = ""


@dataclass(frozen=True)
class MotionInstruction:
    """A motion.

    Attributes:
        letter: J, L, C or A.
        register: P or PR.
        index: Expression of its number.
        speed: Expression of its speed or time.
        unit: Unit of that; "" of max_speed and WELD_SPEED, whose numbers stand elsewhere.
        is_stop: Whether it is to end at rest: FINE, or CNT0.
        options: Options behind that.
        via: In a C motion P or PR, and the expression of the number of the position in between.
    """

    letter: str
    register: str
    index: str
    speed: str
    unit: str
    is_stop: bool
    options: tuple[MotionOption, ...]
    via: tuple[str, str] | None = None


def _option(pattern: str) -> re.Pattern[str]:
    return re.compile(rf"{pattern}(?![\w/])", re.IGNORECASE)


# What changes the way or the target and is not computed, with what to do.
_NOT_READ = {
    r"Skip(?:Jump)?\s*,\s*\w+\[[^\]]*\](?:\s*,\s*PR\[[^\]]*\]\s*=\s*\w+)?": (
        "ends where a signal comes: write where the tool gets to"
    ),
    r"Wjnt": "turns the tool as the wrist happens to: remove it, or divide the line into short ones",
    r"COORD(?:\[[^\]]*\])?": "moves with another group: write positions in a frame that stands",
    r"RTCP": "is of a tool that stands and a part that moves: write it as a path of the tool",
    r"VOFFSET(?:\s*,\s*VR\[[^\]]*\])?": "is shifted by a camera: remove it, or use Offset,PR[]",
    r"PSPD\s*\d+": "scales the speed: write the speed itself",
    r"Search\s*\[[^\]]*\]": "ends where the tool touches: write where the tool gets to",
    r"ALL_COORD|LEADER|FOLLOWER": "moves with another group: write positions in a frame that stands",
}
# What changes neither the way nor the target: accelerations, corners, plans, processes, other axes.
_LEFT_OUT = {
    "ACC": rf"ACC\s*(?:\d+|{_REGISTER})",
    "PTH": "PTH",
    "BREAK": "BREAK",
    "RT_LD": rf"RT_LDR?\s*(?:\d+|{_REGISTER}|\[\d+\])",
    "AP_LD": rf"AP_LDR?\s*(?:\d+|{_REGISTER}|\[\d+\])",
    "MROT": "MROT",
    "EV": r"(?:Ind\.\s*)?EV\s*\d+\s*%",
    "Arc Start": r"Arc\s+Start\s*\[[^\]]*\]",
    "Arc End": r"Arc\s+End\s*\[[^\]]*\]",
    "Weld Start": r"Weld\s+Start\s*\[[^\]]*\]",
    "Weld End": r"Weld\s+End\s*\[[^\]]*\]",
    "PSPD": r"PSPD\s*100",
}
_OPTIONS: tuple[tuple[re.Pattern[str], Kind, str], ...] = (
    (_option(rf"Offset(?:\s*,\s*PR{_INDEX})?"), "offset", ""),
    (_option(rf"Tool_Offset(?:\s*,\s*PR{_INDEX})?"), "tool_offset", ""),
    (_option("INC"), "incremental", ""),
    (
        _option(
            rf"(?:T[AB]|TIME\s+(?:BEFORE|AFTER)|D[AB])\s*(?:-?[\d.]+|{_REGISTER})\s*(?:sec|mm)\s*,\s*({_ACTION})"
        ),
        "call",
        "",
    ),
    *((_option(pattern), "left out", word) for word, pattern in _LEFT_OUT.items()),
    *((_option(pattern), "refused", reason) for pattern, reason in _NOT_READ.items()),
)


# Options that move a target.
_SHIFTS = ("offset", "tool_offset", "incremental")


def is_motion(text: str) -> bool:
    """Return whether an instruction is a motion."""
    return _TARGET.match(text) is not None


def motion_of(text: str, where: str) -> MotionInstruction:
    """Take a motion apart.

    Raises:
        ProgramError: If it is on a spline, or something of it is not known.

    Example:
        >>> motion = motion_of("L P[2] 50mm/sec CNT100 ACC80 Offset,PR[3]", "here")
        >>> motion.index, motion.speed, motion.unit, [option.kind for option in motion.options]
        ('2', '50', 'mm/sec', ['left out', 'offset'])
    """
    target = _TARGET.match(text)
    if target is None:
        raise ProgramError(f"{where}: expected a motion to P[] or PR[], got {shorten(text)!r}")
    letter = target[1].upper()
    if letter == "S":
        raise ProgramError(
            f"{where}: expected J, L, C or A, got S, a motion on a spline, whose way the controller"
            " alone knows: divide it into lines"
        )
    position, register, index, via = target.end(), target[2].upper(), target[3], None
    if letter == "C":
        end_of_arc = _VIA.match(text, position)
        if end_of_arc is None:
            raise ProgramError(
                f"{where}: expected C through a position to another, got one in {shorten(text)!r}"
            )
        via, position = (register, index), end_of_arc.end()
        register, index = end_of_arc[1].upper(), end_of_arc[2]
    speed = _SPEED.match(text, position)
    named = _NAMED_SPEED.match(text, position) if letter != "J" else None
    if speed is None and named is None:
        raise ProgramError(
            f"{where}: expected a motion to a position with a speed such as 50mm/sec, got"
            f" {shorten(_first(text, position))!r} in {shorten(text)!r}"
        )
    if speed is not None and speed[2] == "%" and letter != "J":
        raise ProgramError(
            f"{where}: expected a speed of {letter} in mm/sec or a time, got {speed[0].strip()}"
        )
    position = max(match.end() for match in (speed, named) if match is not None)
    end = _END.match(text, position)
    if end is None:
        raise ProgramError(
            f"{where}: expected FINE, CNT or CD behind the speed, got"
            f" {shorten(_first(text, position))!r}"
        )
    options = _options(text, end.end(), where)
    shifted = [option.words for option in options if option.kind in _SHIFTS]
    if letter in "CA" and shifted:
        raise ProgramError(
            f"{where}: expected {letter} to its positions, got {shifted[0]}: write positions that it"
            " goes through"
        )
    is_stop = _STOP.fullmatch(end[0].strip()) is not None
    number, unit = ("", "") if speed is None else (speed[1], speed[2].lower())
    return MotionInstruction(letter, register, index, number, unit, is_stop, options, via)


def _options(text: str, at: int, where: str) -> tuple[MotionOption, ...]:
    options: list[MotionOption] = []
    while at < len(text):
        if text[at] in " \t,":
            at += 1
            continue
        option = next(
            ((m, kind, word) for pattern, kind, word in _OPTIONS if (m := pattern.match(text, at))),
            None,
        )
        if option is None:
            raise ProgramError(
                f"{where}: expected known options of a motion, got {shorten(_first(text, at))!r}:"
                " remove it if it does not change the path"
            )
        match, kind, word = option
        if kind == "refused":
            raise ProgramError(
                f"{where}: expected a motion to its target, got {match[0]!r}, which {word}"
            )
        argument = next((group for group in match.groups() if group), "") if match.groups() else ""
        options.append(MotionOption(kind, word or match[0], argument))
        at = match.end()
    return tuple(options)


def _first(text: str, at: int) -> str:
    """Return the first word from somewhere on."""
    word = _WORD.search(text, at)
    return "its end" if word is None else word[0]
