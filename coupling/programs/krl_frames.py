"""Tool and base of a KRL program: by value, or by the number of one that the controller holds."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from coupling.errors import ProgramError
from coupling.programs.program import Pose

_NUMBERS = {"$TOOL": "TOOL_NO", "$BASE": "BASE_NO"}
# The numbers of both that the pendant keeps with a point.
_KEPT = re.compile(r"(?:DECL\s+)?(?:GLOBAL\s+)?FDAT\s+(\w+)\s*=\s*(\{.*\})", re.IGNORECASE)
_ACTIVE = re.compile(r"FDAT_ACT\s*=\s*(.+)", re.IGNORECASE)
# What makes them count: a routine of the pendant's motions, or a clause of a spline's.
_APPLIED = re.compile(r"BAS\s*\(\s*#(?:FRAMES|CP_PARAMS|PTP_PARAMS)\b", re.IGNORECASE)
_CLAUSE = re.compile(r"(\$TOOL|\$BASE)\s*=\s*(\w+\s*\([^()]*\)|[^,]+)", re.IGNORECASE)


@dataclass
class KrlFrames:
    """Tool and base while a program is read.

    Attributes:
        poses: Each by `$TOOL` and `$BASE`; None where the controller holds it.
        kept: Numbers that belong to points, by name.
    """

    poses: dict[str, Pose | None] = field(default_factory=dict)
    kept: dict[str, str] = field(default_factory=dict)
    _sources: dict[str, str] = field(default_factory=dict)
    _active: str = ""

    def take(self, line: str, begun: bool, where: str) -> None:
        """Go on by one statement.

        Args:
            line: The statement.
            begun: Whether there are poses already.
            where: Its place, for the message.

        Raises:
            ProgramError: If the poses from here on would be in another frame than those before.
        """
        if (found := _KEPT.fullmatch(line)) is not None:
            self.kept[found[1].upper()] = found[2]
        elif (found := _ACTIVE.fullmatch(line)) is not None:
            self._active = found[1]
        elif _APPLIED.match(line) is not None and self._active:
            for word in _NUMBERS:
                self.set(word, self._active, None, begun, where)
        else:
            for word, source in _CLAUSE.findall(line.partition("WITH")[2]):
                self.set(word.upper(), source, None, begun, where)

    def set(self, word: str, source: str, pose: Pose | None, begun: bool, where: str) -> None:
        """Set one of the two; `source` is what stands behind the equals sign.  Raises as `take`."""
        number = self._number(word, source)
        if begun and number != self._sources.get(word):
            raise ProgramError(f"{where}: expected one {word} for all poses, got another one")
        self.poses[word], self._sources[word] = pose, number

    def _number(self, word: str, source: str) -> str:
        """Return the number that a source stands for, or what it says."""
        text = re.sub(r"\s", "", source).upper()
        name = re.search(r"\(?(\w+)(?:\.\w+)?\)?$", text)
        known = self.kept.get(name[1], source) if name else source
        found = re.search(rf"\b{_NUMBERS[word]}\s+(\d+)", known, re.IGNORECASE)
        return found[1] if found else re.sub(r"^\w+[\[(](\d+)[\])]$", r"\1", text)
