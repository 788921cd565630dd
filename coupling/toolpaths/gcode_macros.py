"""Which lines of G-code are executed: O-words of LinuxCNC, WHILE, IF and GOTO of FANUC's macros."""

from __future__ import annotations

import itertools
import re
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Sequence

from coupling.programs.budget import MOST_REPEATED
from coupling.toolpaths.gcode_expressions import Parameters

_O_WORD = re.compile(
    r"(?:N\d+)?O(\d+|<[^<>]{1,60}>)(SUB|ENDSUB|CALL|RETURN|IF|ELSEIF|ELSE|ENDIF|WHILE|ENDWHILE|DO|REPEAT|ENDREPEAT"
    r"|BREAK|CONTINUE)((?:\[.*)?)"
)
# What the O-words of a label are, without calls.
_BLOCKS = re.compile(
    r"(?:IF(?: ELSEIF)*(?: ELSE)? ENDIF|WHILE(?: BREAK| CONTINUE)* ENDWHILE|DO(?: BREAK)* WHILE"
    r"|REPEAT ENDREPEAT|SUB(?: RETURN)* ENDSUB)?(?: |$)"
)
_SUB = re.compile(r"O(?:\d+|<[^<>]{1,60}>)SUB")
_CONDITION = re.compile(r"(N\d+)?(IF|WHILE)(\[.*\])(GOTO(?=[\d#\[])|THEN(?=#)|DO(?=\d))(.+)")
_JUMP = re.compile(r"(?:N\d+)?GOTO(\d+|[#\[].*)")
_LOOP = re.compile(r"(?:N\d+)?(?:WHILE\[.*\])?DO(\d)")
_LOOP_END = re.compile(r"(?:N\d+)?END(\d)")
_NUMBER = re.compile(r"N0*(\d+)")
# Sub-programs in each other, as LinuxCNC has it.
_DEEPEST = 10


def has_macros(codes: Sequence[str]) -> bool:
    """Return whether lines, as words without comments and blanks in capitals, have any of this."""
    return any(
        "#" in code or "[" in code or _O_WORD.fullmatch(code) or _LOOP_END.fullmatch(code)
        for code in codes
    )


def executed(
    codes: Sequence[str], line_error: Callable[[int, ValueError], Exception]
) -> Iterator[tuple[int, str]]:
    """Yield the lines that a program executes, one behind the other, with numbers for parameters.

    Args:
        codes: Its lines: words without comments and blanks, in capitals.
        line_error: Exception of a problem in a line, by its number from 0.

    Yields:
        Number of the line, from 0, and its words; "" of one that moves nothing.
    """
    program = _Program(codes)
    place, remaining, has_words = 0, len(codes) + MOST_REPEATED, False
    while place < len(codes):
        number, code = place, codes[place]
        remaining -= 1
        try:
            if remaining < 0:
                raise ValueError(
                    f"expected a program that ends with at most {MOST_REPEATED} repeated lines, got"
                    " more: a loop that does not end, or is too long"
                )
            place, words = program.step(place, code)
        except ValueError as cause:
            raise line_error(number, cause) from cause
        except RecursionError as cause:
            raise line_error(number, ValueError("expected fewer brackets in each other")) from cause
        has_words = has_words or words != ""
        yield number, words
    sub = next((k for k, code in enumerate(codes) if _SUB.fullmatch(code)), None)
    if not has_words and sub is not None:
        raise line_error(
            sub,
            ValueError(
                "expected a program that calls it, got a sub-program alone: copy it to the beginning of"
                " the program that calls it, and give that"
            ),
        )


class _Program:
    """Lines of a program, and what is known while they are executed."""

    def __init__(self, codes: Sequence[str]) -> None:
        self._words = [_O_WORD.fullmatch(code) for code in codes]
        is_ngc = any(self._words) or any("#<" in code for code in codes)
        self._parameters = Parameters(is_ngc)
        # Lines by what they may be looked for: O-words by label, DO and END, and lines' numbers.
        self._lines: dict[object, list[int]] = {}
        for k, code in enumerate(codes):
            if word := self._words[k]:
                self._lines.setdefault(word[1], []).append(k)
            for pattern in (_LOOP, _LOOP_END, _NUMBER):
                if match := pattern.match(code):
                    self._lines.setdefault((pattern, int(match[1])), []).append(k)
        verbs: dict[str, list[str]] = {}
        for word in filter(None, self._words):
            verbs.setdefault(word[1], []).extend([word[2]] if word[2] != "CALL" else [])
        self._unbalanced = {
            label: " ".join(of_label)
            for label, of_label in verbs.items()
            if _BLOCKS.sub("", " ".join(of_label))
        }
        self._returns: list[int] = []
        self._repeats: dict[int, int] = {}

    def step(self, place: int, code: str) -> tuple[int, str]:
        """Execute a line; return the next one's number, and its words with their numbers."""
        if word := self._words[place]:
            return self._o_word(place, *word.groups()), ""
        if (condition := _CONDITION.fullmatch(code)) is not None:
            return self._condition(place, condition)
        if jump := _JUMP.fullmatch(code):
            return self._target(place, jump[1]), ""
        if end := _LOOP_END.fullmatch(code):
            return self._find(place, _LOOP, end[1], -1), ""
        if _LOOP.fullmatch(code):
            return place + 1, ""
        if "#" in code or "[" in code:
            return place + 1, self._parameters.line(code)
        return place + 1, code

    def _condition(self, place: int, match: re.Match[str]) -> tuple[int, str]:
        """Execute WHILE [..] DOn, IF [..] GOTO n or IF [..] THEN and an assignment."""
        _, kind, condition, verb, target = match.groups()
        if (kind == "WHILE") != (verb == "DO"):
            raise ValueError(
                f"expected IF with GOTO or THEN, WHILE with DO, got {kind} with {verb}"
            )
        is_met = self._is_met(condition)
        if verb == "DO":
            end = self._find(place, _LOOP_END, target, 1)
            return (place if is_met else end) + 1, ""
        if not is_met:
            return place + 1, ""
        if verb == "GOTO":
            return self._target(place, target), ""
        return place + 1, self._parameters.line(target)

    def _is_met(self, condition: str) -> bool:
        return self._single(condition) != 0.0

    def _single(self, code: str) -> float:
        values = self._parameters.values(code)
        if len(values) != 1:
            raise ValueError(f"expected an expression in [ ], got {code[:20] or 'none'!r}")
        return values[0]

    def _find(self, place: int, pattern: re.Pattern[str], number: str, way: int) -> int:
        """Return the nearest line that begins or ends the loop of a number, ahead (1) or behind (-1)."""
        line = next(self._from(place, (pattern, int(number)), way), None)
        if line is None:
            word = "END" if way > 0 else "DO"
            side = "behind" if way > 0 else "before"
            raise ValueError(f"expected {word}{number} {side} it, got none")
        return line

    def _from(self, place: int, key: object, way: int) -> Iterator[int]:
        """Yield the lines of a kind from a line on, ahead (1) or behind it (-1), the nearest first."""
        lines = self._lines.get(key, [])
        if way > 0:
            return itertools.islice(lines, bisect_right(lines, place), None)
        return (lines[k] for k in range(bisect_left(lines, place) - 1, -1, -1))

    def _target(self, place: int, target: str) -> int:
        """Return the line of a number: the first behind this one, else the first of the program."""
        value = float(target) if target.isdecimal() else self._single(f"[{target}]")
        key = (_NUMBER, value)
        for line in (*itertools.islice(self._from(place, key, 1), 1), *self._lines.get(key, [])):
            return line
        raise ValueError(f"expected a line N{value:g} to go to, got none")

    def _o_word(self, place: int, label: str, verb: str, operand: str) -> int:
        """Execute an O-word; return the number of the next line."""
        if label in self._unbalanced:
            raise ValueError(
                f"expected O{label} to begin and end one block or more, got"
                f" {self._unbalanced[label][:60].lower()}"
            )
        if verb == "SUB":
            return self._ahead(place, label, "ENDSUB") + 1
        if verb == "CALL":
            return self._call(place, label, self._parameters.values(operand))
        if verb in ("ENDSUB", "RETURN"):
            result = self._parameters.values(operand)
            if not self._returns:
                raise ValueError(
                    f"expected O{label} {verb.lower()} of a sub-program that is called"
                )
            self._parameters.end_call(result[0] if result else 0.0)
            return self._returns.pop()
        if verb in ("ELSE", "ELSEIF"):  # behind the part that was executed
            return self._ahead(place, label, "ENDIF") + 1
        if verb == "IF":
            return self._branch(place, label, operand)
        if verb == "BREAK":
            return self._ahead(place, label, "ENDWHILE", "WHILE") + 1
        if verb == "CONTINUE":
            return self._ahead(place, label, "ENDWHILE")
        if verb in ("WHILE", "ENDWHILE", "REPEAT", "ENDREPEAT"):
            return self._loop(place, label, verb, operand)
        return place + 1  # DO, ENDIF

    def _call(self, place: int, label: str, arguments: list[float]) -> int:
        begin = self._nearest(-1, label, ("SUB",), 1)
        if begin is None:
            raise ValueError(
                f"expected the sub-program O{label} in this file, got its call alone: copy it to the"
                " file's beginning"
            )
        if self._parameters.depth == _DEEPEST:
            raise ValueError(f"expected at most {_DEEPEST} sub-programs in each other, got more")
        self._parameters.call(arguments)
        self._returns.append(place + 1)
        return begin + 1

    def _branch(self, place: int, label: str, condition: str) -> int:
        """Return the line behind that of IF, ELSEIF or ELSE whose part is executed, or behind ENDIF."""
        while not self._is_met(condition):
            place = self._ahead(place, label, "ELSEIF", "ELSE", "ENDIF")
            word = self._words[place]
            assert word is not None
            if word[2] != "ELSEIF":
                break
            condition = word[3]
        return place + 1

    def _loop(self, place: int, label: str, verb: str, operand: str) -> int:
        if verb == "ENDWHILE":
            return self._behind(place, label, "WHILE")
        if verb == "ENDREPEAT":
            begin = self._behind(place, label, "REPEAT")
            self._repeats[begin] -= 1
            return begin + 1 if self._repeats[begin] > 0 else place + 1
        if verb == "REPEAT":
            self._repeats[place] = round(self._single(operand))
            end = self._ahead(place, label, "ENDREPEAT")
            return (place if self._repeats[place] > 0 else end) + 1
        before = self._nearest(place, label, ("DO", "WHILE", "ENDWHILE"), -1)
        if before is not None and self._is(before, label, "DO"):
            return before + 1 if self._is_met(operand) else place + 1
        end = self._ahead(place, label, "ENDWHILE")
        return (place if self._is_met(operand) else end) + 1

    def _ahead(self, place: int, label: str, *verbs: str) -> int:
        line = self._nearest(place, label, verbs, 1)
        assert line is not None  # the label's blocks are whole
        return line

    def _behind(self, place: int, label: str, verb: str) -> int:
        line = self._nearest(place, label, (verb,), -1)
        assert line is not None
        return line

    def _nearest(self, place: int, label: str, verbs: Sequence[str], way: int) -> int | None:
        return next((k for k in self._from(place, label, way) if self._is(k, label, *verbs)), None)

    def _is(self, place: int, label: str, *verbs: str) -> bool:
        word = self._words[place]
        return word is not None and word[1] == label and word[2] in verbs
