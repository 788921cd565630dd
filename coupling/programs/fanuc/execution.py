"""Instructions of FANUC programs, executed as a controller does."""

from __future__ import annotations

import re
from contextlib import suppress

from coupling.errors import ProgramError
from coupling.programs.budget import Budget
from coupling.programs.endless import ProgramEnd, end_after_pass
from coupling.programs.fanuc.assignments import REGISTER, assign
from coupling.programs.fanuc.expressions import whole_number
from coupling.programs.fanuc.harmless import is_harmless, left_out_word
from coupling.programs.fanuc.memory import Registers
from coupling.programs.fanuc.motion_statements import is_motion, motion_of
from coupling.programs.fanuc.motions import TpDriver, moving_program
from coupling.programs.fanuc.running import RunningProgram
from coupling.programs.fanuc.syntax import TpText, split_at_comma, split_at_commas
from coupling.programs.program import RobotProgram, rest_behind
from coupling.programs.reading import ReadingNotes
from coupling.programs.text import shorten
from coupling.programs.unknown import Unknown

# Programs that call each other, at most.
_MAX_CALL_DEPTH = 10
_FLAGS = re.IGNORECASE
_CALL = re.compile(r"(CALL|RUN)\s+([\w-]+)\s*(?:\((.*)\))?", _FLAGS)
_CALL_BY_STRING = re.compile(r"(?:CALL|RUN)\s+A?SR?\[.*", _FLAGS)
_JUMP = re.compile(r"JMP\s+LBL\[(.+)\]", _FLAGS)
_JUMPED = re.compile(r"\bJMP\s+LBL\[\s*(.+?)\s*\]", _FLAGS)
_END = re.compile(r"(?:^|,)\s*END$", _FLAGS)
_LABEL = re.compile(r"LBL\[.+\]", _FLAGS)
_FOR = re.compile(r"FOR\s+R\[(.+?)\]\s*=\s*(.+?)\s+(TO|DOWNTO)\s+(.+)", _FLAGS)
_IF_THEN = re.compile(r"IF\b\s*(.+?)\s*THEN", _FLAGS)
_SELECT = re.compile(r"SELECT\s+(.+)", _FLAGS)
_CASE = re.compile(r"=\s*([^,]+?)\s*,\s*(.+)", _FLAGS)
_ELSE_CASE = re.compile(r"ELSE\s*,\s*(.+)", _FLAGS)
# Left out, though behind them CNT is like FINE.
_HALTS = ("WAIT", "PAUSE")
_WAIT = re.compile(r"WAIT\s+(?:([\d.]+)\s*\(?\s*sec\s*\)?|(A?R\[[^=<>]*\]))", _FLAGS)
_TIMEOUT = re.compile(r"WAIT\b.*\bTIMEOUT\b", _FLAGS)


class FanucExecution:
    """A controller that goes through programs."""

    def __init__(self, files: dict[str, TpText]) -> None:
        self.files = files
        self.notes = ReadingNotes()
        self.registers = Registers(self.notes)
        self.driver = TpDriver(self.registers, files)
        self.budget = Budget()
        self.budget.remaining += sum(len(text.instructions) for text in files.values())
        self._jumped: dict[tuple[str, int], int] = {}

    def program(self, first: TpText) -> RobotProgram:
        """Return the program that was read."""
        self.driver.arcs.finish()
        if not self.driver.moves:
            raise ProgramError(f"{first.file}: expected motions, got none")
        base, tool = (self.registers.frame(word) for word in ("UFRAME", "UTOOL"))
        return RobotProgram(
            first.title,
            tuple(self.driver.moves),
            (self.driver.frames.base or base).pose,
            (self.driver.frames.tool or tool).pose,
            tuple(sorted(self.notes.left_out.items())),
            tuple(self.notes.assumptions),
        )

    def run(self, text: TpText) -> None:
        """Go through the program that is started, until its end or an ABORT."""
        with suppress(ProgramEnd):
            self._run(RunningProgram(text, self.registers))

    def _run(self, running: RunningProgram, index: int = 0, end: int | None = None) -> None:
        """Go through a program from one instruction to another, which is not executed, or to its end."""
        text = running.text
        while index < len(text.instructions) and index != end:
            self.budget.spend(text.where(index))
            index = self._step(running, index)

    def _step(self, running: RunningProgram, index: int) -> int:
        """Execute an instruction and return the index of the next."""
        words = running.text.instructions[index].text
        upper = words.upper()
        where = running.text.where(index)
        if is_motion(words):
            motion = motion_of(words, where)
            self.driver.move(running, motion, where)
            if any(option.argument.upper() == "P-SPS" for option in motion.options):
                return self._point_logic(running, index, where)
        elif upper.startswith("IF") and (block := _IF_THEN.fullmatch(words)) is not None:
            return self._branch(running, index, block[1], where)
        elif upper in ("ELSE", "ENDIF"):
            # The first part of a block ends here.
            return self._partner(running, index, where) + 1 if upper == "ELSE" else index + 1
        elif upper.startswith("FOR "):
            return self._begin_loop(running, index, words, where)
        elif upper == "ENDFOR":
            return self._end_loop(running, index, where)
        elif (selected := _SELECT.fullmatch(words)) is not None:
            return self._select(running, index, selected[1], where)
        else:
            return self._act(running, index, words, where)
        return index + 1

    def _point_logic(self, running: RunningProgram, index: int, where: str) -> int:
        """Go over what is done on the way to a point, which stands behind it up to a line of dashes."""
        instructions = running.text.instructions
        for after in range(index + 1, len(instructions)):
            instruction = instructions[after]
            if instruction.text.startswith("---"):
                return after + 1
            here = running.text.where(after)
            call = _CALL.fullmatch(instruction.text)
            if call is not None and call[2].upper() not in self.files:
                raise _missing(instruction.text, call[2], here)
            if not self._is_without_effect(running, instruction.text, here):
                raise ProgramError(
                    f"{here}: expected outputs and waits alone in what runs during a motion, got"
                    f" {shorten(instruction.text)!r}"
                )
            self.notes.leave_out("P-SPS")
        raise ProgramError(f"{where}: expected a line of dashes behind P-SPS, got none")

    def _partner(self, running: RunningProgram, index: int, where: str) -> int:
        partner = running.text.partners.get(index)
        if partner is None:
            words = running.text.instructions[index].text
            raise ProgramError(f"{where}: expected the end of {shorten(words)!r}, got none")
        return partner

    def _act(self, running: RunningProgram, index: int, words: str, where: str) -> int:
        """Execute an instruction that may stand behind a condition."""
        upper = words.upper()
        if upper.startswith("IF"):
            return self._if(running, index, words, where)
        if (jump := _JUMP.fullmatch(words)) is not None:
            return self._jump(running, index, words, jump[1], where)
        if upper == "END":
            return len(running.text.instructions)
        if upper == "ABORT":
            raise ProgramEnd
        if _LABEL.fullmatch(words):
            running.begins[index] = len(self.driver.moves)
            return index + 1
        if (call := _CALL.fullmatch(words)) is not None:
            self._call(running, call, where)
        elif _CALL_BY_STRING.fullmatch(words):
            raise ProgramError(
                f"{where}: expected the name of a program, got {shorten(words)!r}, which the"
                " controller alone knows: write the name"
            )
        elif (wait := _WAIT.fullmatch(words)) is not None:
            self._wait(running, wait[1] or wait[2], where)
        elif (word := left_out_word(words)) is not None:
            self.notes.leave_out(word)
            if word in _HALTS:
                rest_behind(self.driver.moves)
            if _TIMEOUT.match(words):
                self.notes.assume("what WAIT waits for comes before its TIMEOUT")
        else:
            assign(running, words, where)
        return index + 1

    def _wait(self, running: RunningProgram, seconds: str, where: str) -> None:
        """Let the robot stand for a time, if it is known."""
        value = running.value(seconds, where)
        if not isinstance(value, float):
            self.notes.leave_out("WAIT")
        rest_behind(self.driver.moves, value if isinstance(value, float) else 0.0)

    # Flow.

    def _truth(self, running: RunningProgram, condition: str, where: str) -> bool | None:
        """Return whether a condition holds; None if nobody knows before the program runs."""
        value = running.value(condition, where)
        if isinstance(value, Unknown):
            return None
        return bool(value)

    def _unknown(self, running: RunningProgram, condition: str, where: str) -> ProgramError:
        value = running.value(condition, where)
        name = value.name if isinstance(value, Unknown) else condition
        remedy = "set it before, or write the branch that is taken"
        if name.startswith("AR["):
            remedy = "read the program that calls this one, which gives it"
        return ProgramError(
            f"{where}: expected a condition of what the program sets, got {shorten(name)} in"
            f" {shorten(condition.strip())!r}: {remedy}"
        )

    def _if(self, running: RunningProgram, index: int, words: str, where: str) -> int:
        condition, action = split_at_comma(words[2:])
        if not action:
            raise ProgramError(
                f"{where}: expected a condition, a comma and an action, got {shorten(words)!r}"
            )
        truth = self._truth(running, condition, where)
        if truth is None:
            if not self._is_without_effect(running, action, where):
                raise self._unknown(running, condition, where)
            self.notes.leave_out("IF")
            return index + 1
        return self._act(running, index, action, where) if truth else index + 1

    def _branch(self, running: RunningProgram, index: int, condition: str, where: str) -> int:
        end = self._partner(running, index, where)
        truth = self._truth(running, condition, where)
        if truth is not None:
            return index + 1 if truth else end + 1
        if running.text.instructions[end].text.upper() == "ELSE":
            end = self._partner(running, end, where)
        for instruction in running.text.instructions[index + 1 : end]:
            if not self._is_without_effect(running, instruction.text, where):
                raise self._unknown(running, condition, where)
        self.notes.leave_out("IF")
        return end + 1

    def _is_without_effect(self, running: RunningProgram, words: str, where: str) -> bool:
        """Return whether an action changes no path; a register that it may set is then unknown."""
        if left_out_word(words) is not None or words.upper() in ("ELSE", "ENDIF"):
            return True
        if words.upper().startswith("IF"):
            action = "" if _IF_THEN.fullmatch(words) else split_at_comma(words[2:])[1]
            return not action or self._is_without_effect(running, action, where)
        if (call := _CALL.fullmatch(words)) is not None:
            return is_harmless(call[2], self.files)
        register = REGISTER.fullmatch(words)
        if register is None:
            return False
        number = whole_number(running.value(register[1], where), f"{where}: R[]")
        self.registers.set_number(number, Unknown(f"R[{number}], set behind an unknown condition"))
        return True

    def _is_endless(self, running: RunningProgram, target: int, index: int) -> bool:
        """Return whether nothing leaves the instructions from a label to the jump that repeats them."""
        if target > index or any(text.holds_abort for text in self.files.values()):
            return False
        for instruction in running.text.instructions[target:index]:
            if _END.search(instruction.text):
                return False
            for label in _JUMPED.findall(instruction.text):
                place = running.text.labels.get(int(label)) if label.isdecimal() else None
                if place is None or not target <= place < index:
                    return False
        return target in running.begins

    def _jump(self, running: RunningProgram, index: int, words: str, label: str, where: str) -> int:
        number = whole_number(running.value(label, where), f"{where}: LBL[]")
        target = running.text.labels.get(number)
        if target is None:
            raise ProgramError(f"{where}: expected a label LBL[{number}] in the program, got none")
        if words == running.text.instructions[index].text and self._is_endless(
            running, target, index
        ):
            end_after_pass(
                running.begins[target],
                self.driver.moves,
                lambda: self._run(running, target, index),
                self.notes,
                running.text.where(target),
            )
        place = (running.text.title, index)
        if target < index and self._jumped.get(place) == self.registers.changes:
            raise ProgramError(
                f"{where}: expected a program that ends, got JMP LBL[{number}], which repeats it for"
                " ever: remove the jump"
            )
        self._jumped[place] = self.registers.changes
        return target

    def _begin_loop(self, running: RunningProgram, index: int, words: str, where: str) -> int:
        loop = _FOR.fullmatch(words)
        if loop is None:
            raise ProgramError(f"{where}: expected FOR R[]=.. TO .., got {shorten(words)!r}")
        register, start, word, end = loop.groups()
        number = whole_number(running.value(register, where), f"{where}: R[]")
        first = running.require_number(start, where)
        last = running.require_number(end, where)
        self.registers.set_number(number, first)
        running.ends[index] = last
        up = word.upper() == "TO"
        enters = first <= last if up else first >= last
        return index + 1 if enters else self._partner(running, index, where) + 1

    def _end_loop(self, running: RunningProgram, index: int, where: str) -> int:
        start = self._partner(running, index, where)
        loop = _FOR.fullmatch(running.text.instructions[start].text)
        if loop is None or start not in running.ends:
            raise ProgramError(f"{where}: expected ENDFOR behind its FOR, got a jump between them")
        number = whole_number(running.value(loop[1], where), f"{where}: R[]")
        step = 1.0 if loop[3].upper() == "TO" else -1.0
        value = running.require_number(f"R[{number}]", where)
        if step * (running.ends[start] - value) <= 0.0:
            return index + 1
        self.registers.set_number(number, value + step)
        return start + 1

    def _select(self, running: RunningProgram, index: int, first: str, where: str) -> int:
        instructions = running.text.instructions
        register, _, first_case = first.partition("=")
        cases, behind = [f"={first_case}"], index + 1
        while behind < len(instructions) and (
            _CASE.fullmatch(instructions[behind].text)
            or _ELSE_CASE.fullmatch(instructions[behind].text)
        ):
            cases.append(instructions[behind].text)
            behind += 1
        value = running.value(register, where)
        if isinstance(value, Unknown):
            raise self._unknown(running, register, where)
        for case in cases:
            match, other = _CASE.fullmatch(case), _ELSE_CASE.fullmatch(case)
            if match is None and other is None:
                raise ProgramError(
                    f"{where}: expected =value,action in SELECT, got {shorten(case)!r}"
                )
            if match is None or value == running.require_number(match[1], where):
                action = match[2] if match is not None else case.partition(",")[2].strip()
                after = self._act(running, index, action, where)
                return behind if after == index + 1 else after
        return behind

    def _call(self, running: RunningProgram, call: re.Match[str], where: str) -> None:
        word, name, arguments = call[1].upper(), call[2], call[3] or ""
        text = self.files.get(name.upper())
        if text is None:
            raise _missing(f"{word} {name}", name, where)
        if is_harmless(name, self.files):
            self.notes.leave_out(f"{word} of outputs")
            return
        if word == "RUN":
            raise moving_program(name, self.files, where)
        if running.depth >= _MAX_CALL_DEPTH:
            raise ProgramError(
                f"{where}: expected at most {_MAX_CALL_DEPTH} calls in each other, got more"
            )
        values = tuple(running.value(part, where) for part in split_at_commas(arguments))
        inner = RunningProgram(
            text, self.registers, values, dict(running.offsets), running.depth + 1
        )
        self._run(inner)
        if inner.offsets != running.offsets:
            # Whether a condition outlives the program that set it is not known.
            running.offsets = {}


def _missing(words: str, name: str, where: str) -> ProgramError:
    """Return the refusal of a program that is not there."""
    return ProgramError(
        f"{where}: expected a file {name}.ls beside the program, got none for {shorten(words)}: put it"
        " there, or remove the line if it does not move the robot"
    )
