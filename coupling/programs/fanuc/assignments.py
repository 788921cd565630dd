"""Assignments of FANUC programs: registers, position registers, frames and offset conditions."""

from __future__ import annotations

import re

from coupling.errors import ProgramError
from coupling.programs.fanuc.expressions import Value
from coupling.programs.fanuc.harmless import OUTCOME
from coupling.programs.fanuc.memory import PositionRegister
from coupling.programs.fanuc.positions import TpPosition, cartesian_of
from coupling.programs.fanuc.running import RunningProgram
from coupling.programs.text import shorten
from coupling.programs.unknown import Unknown

_FLAGS = re.IGNORECASE
REGISTER = re.compile(r"R\[(.+?)\]\s*=(?!=)\s*(.+)", _FLAGS)
_ELEMENT = re.compile(r"PR\[([^,=]+),([^=]+)\]\s*=\s*(.+)", _FLAGS)
_WHOLE_REGISTER = re.compile(r"PR\[([^,=]+)\]\s*=\s*(.+)", _FLAGS)
_TERM = re.compile(
    r"\s*([-+]?)\s*(LPOS|JPOS|(PR|P|UFRAME|UTOOL)\[((?:[^\[\]]|\[[^\[\]]*\])*)\])", _FLAGS
)
_SET = re.compile(r"(UFRAME|UTOOL)\[([^=]+)\]\s*=\s*PR\[([^=]+)\]", _FLAGS)
_FRAME_NUMBER = re.compile(r"(UFRAME|UTOOL)_NUM(?:\[GP1\])?\s*=\s*(.+)", _FLAGS)
_OVERRIDE = re.compile(
    r"(?:OVERRIDE|\$MCR\.\$GENOVERRIDE|\$MCR_GRP\[1\]\.\$PRGOVERRIDE)\s*=\s*([^%]+)%?", _FLAGS
)
_CONDITION = re.compile(
    r"(OFFSET|TOOL_OFFSET)\s+CONDITION\s+PR\[((?:[^\[\]]|\[[^\[\]]*\])*)\]"
    r"(?:\s*,?\s*\(?(UFRAME|UTOOL)\[([^\]]+)\]\)?)?",
    _FLAGS,
)


def assign(running: RunningProgram, words: str, where: str) -> None:
    """Execute an assignment.

    Args:
        running: The program that it stands in.
        words: The instruction.
        where: Its place, for messages.

    Raises:
        ProgramError: If it is none that is known.
    """
    registers = running.registers
    if (match := _ELEMENT.fullmatch(words)) is not None:
        index, place = (running.index(part, where) for part in match.groups()[:2])
        registers.set_element(index, place, running.value(match[3], where), where)
    elif (match := _WHOLE_REGISTER.fullmatch(words)) is not None:
        index = running.index(match[1], where)
        registers.set_position(index, _sum(running, match[2], where))
    elif (match := REGISTER.fullmatch(words)) is not None:
        value = Unknown(match[2]) if OUTCOME.match(match[2]) else running.value(match[2], where)
        registers.set_number(running.index(match[1], where), value)
    elif (match := _SET.fullmatch(words)) is not None:
        number, index = (running.index(part, where) for part in match.groups()[1:])
        registers.set_frame(match[1].upper(), number, index, where)
    elif (match := _FRAME_NUMBER.fullmatch(words)) is not None:
        registers.choose(match[1].upper(), int(running.require_number(match[2], where)))
    elif (match := _OVERRIDE.fullmatch(words)) is not None:
        _set_override(running, running.require_number(match[1], where), where)
    elif (match := _CONDITION.fullmatch(words)) is not None:
        _set_condition(running, match, where)
    else:
        raise ProgramError(
            f"{where}: expected an instruction that is known, got {shorten(words)!r}: remove it if it"
            " does not change the path"
        )


def _set_override(running: RunningProgram, percent: float, where: str) -> None:
    if not 0.0 < percent <= 100.0:
        raise ProgramError(f"{where}: expected an override of 1 to 100 %, got {percent:g}")
    running.registers.override = percent / 100.0
    running.registers.notes.assume(f"OVERRIDE={percent:g}% scales the speeds behind it")


def _set_condition(running: RunningProgram, match: re.Match[str], where: str) -> None:
    word, register, frame, number = match.groups()
    if frame is not None:
        active = running.registers.active.get(frame.upper())
        if running.index(number, where) != active:
            raise ProgramError(
                f"{where}: expected an offset in the {frame.upper()} in use, got {frame}[{number}]:"
                " choose that one"
            )
    running.offsets[word.upper()] = running.index(register, where)


def _sum(running: RunningProgram, text: str, where: str) -> PositionRegister:
    """Return a sum or difference of positions."""
    bare = (
        text.strip().removeprefix("(").removesuffix(")") if text.startswith("(") else text.strip()
    )
    total: PositionRegister | None = None
    at = 0
    while at < len(bare):
        term = _TERM.match(bare, at)
        if term is None or (total is not None and not term[1]) or (total is None and term[1]):
            raise ProgramError(
                f"{where}: expected a position, or a sum of PR[], got {shorten(bare)!r}"
            )
        value = _term(running, term, where)
        sign = -1.0 if term[1] == "-" else 1.0
        total = value if total is None else _add_positions(total, value, sign, where)
        at = term.end()
        if not bare[at:].strip():
            break
    if total is None:
        raise ProgramError(f"{where}: expected a position, got none")
    return total


def _term(running: RunningProgram, term: re.Match[str], where: str) -> PositionRegister:
    word = (term[3] or term[2]).upper()
    if word in ("LPOS", "JPOS"):
        last = running.registers.last_position(where)
        if last.is_joint != (word == "JPOS"):
            raise ProgramError(
                f"{where}: expected {word}, got a last target of"
                f" {'joint angles' if last.is_joint else 'X, Y, Z, W, P, R'}: the other is known to the"
                " robot alone"
            )
        return PositionRegister.of(last)
    index = running.index(term[4], where)
    if word == "P":
        return PositionRegister.of(running.taught(index, where))
    if word == "PR":
        register = running.registers.positions.get(index)
        if register is None:
            running.registers.position(index, where)
        assert register is not None
        return PositionRegister(
            dict(register.elements), register.is_joint, register.others, register.is_matrix
        )
    pose = running.registers.frames.get((word, index))
    if pose is None:
        raise ProgramError(
            f"{where}: expected {word}[{index}] as the program sets it, and it does not: set it from a"
            " position register"
        )
    return PositionRegister.of(TpPosition(cartesian_of(pose)), is_matrix=True)


def _add_positions(
    a: PositionRegister, b: PositionRegister, sign: float, where: str
) -> PositionRegister:
    if bool(a.is_joint) != bool(b.is_joint) or a.is_matrix or b.is_matrix:
        raise ProgramError(
            f"{where}: expected positions of one kind to add, got X, Y, Z, W, P, R, joint angles or"
            " copies of frames"
        )
    elements: dict[int, Value] = {}
    for place in a.elements.keys() | b.elements.keys():
        x, y = (r.elements.get(place, Unknown("an element that is not set")) for r in (a, b))
        if isinstance(x, (Unknown, str)) or isinstance(y, (Unknown, str)):
            elements[place] = x if isinstance(x, (Unknown, str)) else y
        else:
            elements[place] = float(x) + sign * float(y)
    kind = a.is_joint if a.is_joint is not None else b.is_joint
    return PositionRegister(elements, kind, a.others)
