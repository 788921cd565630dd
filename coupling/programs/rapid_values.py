"""Values of RAPID: numbers, words and lists in brackets, and what they stand for."""

from __future__ import annotations

import re

from coupling.errors import ProgramError
from coupling.programs.poses import pose_of_quaternion
from coupling.programs.program import Pose
from coupling.programs.text import NUMBER, real, shortened

_TOKEN = re.compile(rf"\s*(\[|\]|,|{NUMBER}|[A-Za-z_]\w*|\"[^\"]*\")")
# Brackets in each other, at most.
_DEEPEST = 6
# A quaternion written with few digits is normalised; beyond this it is a mistake.
_UNIT_TOLERANCE = 1e-3

# Components that are given a value by themselves, and where they stand in what has them.
_COMPONENTS = {
    "wobjdata": {"UFRAME": 3, "OFRAME": 4},
    "tooldata": {"TFRAME": 1},
    "robtarget": {"TRANS": 0, "ROT": 1, "ROBCONF": 2, "EXTAX": 3},
    "jointtarget": {"ROBAX": 0, "EXTAX": 1},
    "speeddata": {"V_TCP": 0, "V_ORI": 1, "V_LEAX": 2, "V_REAX": 3},
}

# Number, word or list of them.
Value = float | str | list["Value"]


def value_of(text: str, where: str) -> Value:
    """Return a value in brackets, or a single word or number."""
    position = 0
    stack: list[list[Value]] = [[]]
    while position < len(text.rstrip()):
        token = _TOKEN.match(text, position)
        if token is None:
            raise ProgramError(
                f"{where}: expected numbers in brackets, got {shortened(text[position:].strip())!r}"
            )
        position = token.end()
        word = token[1]
        if word == "[":
            if len(stack) > _DEEPEST:
                raise ProgramError(f"{where}: expected at most {_DEEPEST} brackets in each other")
            stack.append([])
        elif word == "]":
            inner = stack.pop()
            if not stack:
                raise ProgramError(f"{where}: expected a [ for every ], got one less")
            stack[-1].append(inner)
        elif word != ",":
            is_number = re.fullmatch(NUMBER, word) is not None
            stack[-1].append(_number(word, where) if is_number else word)
    if len(stack) != 1 or len(stack[0]) != 1:
        raise ProgramError(f"{where}: expected one value in brackets, got {shortened(text)!r}")
    return stack[0][0]


def _number(word: str, where: str) -> float:
    """Return a number; 9E9 says that there is no such axis."""
    return 9e9 if float(word) == 9e9 else real(word, where)


def number_list(value: Value, count: int, what: str, where: str) -> list[float]:
    """Return a list of so many numbers."""
    if (
        not isinstance(value, list)
        or len(value) != count
        or not all(isinstance(x, float) and x != 9e9 for x in value)
    ):
        raise ProgramError(
            f"{where}: expected {count} numbers as {what}, got {shortened(str(value))}"
        )
    return [x for x in value if isinstance(x, float)]


def with_component(kind: str, value: Value, component: str, new: Value, where: str) -> Value:
    """Return data of a kind with another value of one of their components.

    Raises:
        ProgramError: If they have none of that name.
    """
    at = _COMPONENTS.get(kind, {}).get(component.upper())
    if at is None or not isinstance(value, list) or len(value) <= at:
        raise ProgramError(f"{where}: expected a component of {kind}, got {shortened(component)!r}")
    return [*value[:at], new, *value[at + 1 :]]


def arguments_of(text: str) -> list[str]:
    """Return the arguments of a motion: divided at the commas outside of brackets."""
    parts, depth, begun = [], 0, 0
    for k, letter in enumerate(text):
        depth += (letter == "[") - (letter == "]")
        if letter == "," and depth == 0:
            parts.append(text[begun:k].strip())
            begun = k + 1
    return [*parts, text[begun:].strip()]


def placement(value: Value, where: str) -> Pose:
    """Return the pose of [[x,y,z],[w,x,y,z]]."""
    if not isinstance(value, list) or len(value) != 2:
        raise ProgramError(
            f"{where}: expected [[x,y,z],[q1,q2,q3,q4]], got {shortened(str(value))}"
        )
    position = number_list(value[0], 3, "position", where)
    quaternion = number_list(value[1], 4, "quaternion", where)
    length = sum(q * q for q in quaternion) ** 0.5
    if abs(length - 1.0) > _UNIT_TOLERANCE:
        raise ProgramError(f"{where}: expected a quaternion of length 1, got length {length:.6g}")
    return pose_of_quaternion(position, quaternion)
