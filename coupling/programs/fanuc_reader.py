"""FANUC TP, read: .ls programs are executed as a controller does, with those that they call."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import acos, degrees

from coupling.errors import ProgramError
from coupling.programs.fanuc_expressions import Unknown, Value, evaluate, whole_number
from coupling.programs.fanuc_left_out import OUTCOME, first_effect, is_harmless, left_out_word
from coupling.programs.fanuc_motion import MotionInstruction, MotionOption, is_motion, motion_of
from coupling.programs.fanuc_positions import TpPosition, cartesian_of, position_of
from coupling.programs.fanuc_registers import LastTarget, PositionRegister, Registers
from coupling.programs.fanuc_text import TpText
from coupling.programs.frames import PoseFrames
from coupling.programs.poses import product
from coupling.programs.program import Motion, Pose, ProgramFile, ProgramMove, RobotProgram
from coupling.programs.reading import ReadingNotes
from coupling.programs.text import shortened

_RADIANS = 0.017453292519943295
# Speeds in m/s for one unit, and times in seconds.
_PACES = {"mm/sec": 1e-3, "cm/min": 1e-2 / 60.0, "inch/min": 0.0254 / 60.0}
_TIMES = {"sec": 1.0, "msec": 1e-3}
# Programs that call each other; instructions beyond those that stand in the files, as loops make them.
_DEEPEST, _MOST_REPEATED = 10, 200_000
# Axes beside the robot's that stand differ by rounding alone [mm], [deg].
_STANDS = 1e-3
_FLAGS = re.IGNORECASE
_REGISTER = re.compile(r"R\[(.+?)\]\s*=(?!=)\s*(.+)", _FLAGS)
_ELEMENT = re.compile(r"PR\[([^,=]+),([^=]+)\]\s*=\s*(.+)", _FLAGS)
_WHOLE = re.compile(r"PR\[([^,=]+)\]\s*=\s*(.+)", _FLAGS)
_TERM = re.compile(
    r"\s*([-+]?)\s*(LPOS|JPOS|(PR|P|UFRAME|UTOOL)\[((?:[^\[\]]|\[[^\[\]]*\])*)\])", _FLAGS
)
_SET = re.compile(r"(UFRAME|UTOOL)\[([^=]+)\]\s*=\s*PR\[([^=]+)\]", _FLAGS)
_CHOSEN = re.compile(r"(UFRAME|UTOOL)_NUM\s*=\s*(.+)", _FLAGS)
_OVERRIDE = re.compile(
    r"(?:OVERRIDE|\$MCR\.\$GENOVERRIDE|\$MCR_GRP\[1\]\.\$PRGOVERRIDE)\s*=\s*([^%]+)%?", _FLAGS
)
_CONDITION = re.compile(
    r"(OFFSET|TOOL_OFFSET)\s+CONDITION\s+PR\[((?:[^\[\]]|\[[^\[\]]*\])*)\]"
    r"(?:\s*,?\s*\(?(UFRAME|UTOOL)\[([^\]]+)\]\)?)?",
    _FLAGS,
)
_CALL = re.compile(r"(CALL|RUN)\s+([\w-]+)\s*(?:\((.*)\))?", _FLAGS)
_CALL_BY_STRING = re.compile(r"(?:CALL|RUN)\s+A?SR?\[.*", _FLAGS)
_JUMP = re.compile(r"JMP\s+LBL\[(.+)\]", _FLAGS)
_LABEL = re.compile(r"LBL\[.+\]", _FLAGS)
_FOR = re.compile(r"FOR\s+R\[(.+?)\]\s*=\s*(.+?)\s+(TO|DOWNTO)\s+(.+)", _FLAGS)
_IF_THEN = re.compile(r"IF\b\s*(.+?)\s*THEN", _FLAGS)
_SELECT = re.compile(r"SELECT\s+(.+)", _FLAGS)
_CASE = re.compile(r"=\s*([^,]+?)\s*,\s*(.+)", _FLAGS)
_ELSE_CASE = re.compile(r"ELSE\s*,\s*(.+)", _FLAGS)
_TIMEOUT = re.compile(r"WAIT\b.*\bTIMEOUT\b", _FLAGS)


def read(files: Sequence[ProgramFile]) -> RobotProgram:
    """Return the program of .ls files: the first one, and what it calls.

    Args:
        files: Texts, the one that is started first.

    Raises:
        ProgramError: With the line, what was expected and what was got.
    """
    if not files:
        raise ProgramError("FANUC: expected a file .ls, got none")
    texts = [TpText.of(file) for file in files]
    reader = _FanucReader({text.title.upper(): text for text in reversed(texts)})
    reader.run(texts[0], (), 0)
    return reader.program(texts[0])


def called(text: str) -> tuple[str, ...]:
    """Return the names of the programs that a text calls or runs."""
    return tuple(name.upper() for name in re.findall(r"\b(?:CALL|RUN)\s+(\w+)", text, _FLAGS))


class _Aborted(Exception):
    """The program reached ABORT."""


@dataclass
class _Running:
    """A program that runs.

    Attributes:
        text: Its text.
        arguments: Values that it was called with.
        offsets: Position registers of OFFSET CONDITION and TOOL_OFFSET CONDITION, by the first word.
        ends: Ends of its loops, by the index of FOR.
        depth: Number of programs that it was called through.
    """

    text: TpText
    arguments: tuple[Value, ...]
    offsets: dict[str, int]
    depth: int
    ends: dict[int, float] = field(default_factory=dict)


class _FanucReader:
    """A controller that goes through programs."""

    def __init__(self, files: dict[str, TpText]) -> None:
        self.files = files
        self.notes = ReadingNotes()
        self.registers = Registers(self.notes)
        self.frames = PoseFrames()
        self.moves: list[ProgramMove] = []
        self.others: dict[str, float] = {}
        self.override = 1.0
        self.steps = _MOST_REPEATED + sum(len(text.instructions) for text in files.values())
        self._jumped: dict[tuple[str, int], int] = {}
        self._positions: dict[tuple[str, int], TpPosition] = {}

    def program(self, first: TpText) -> RobotProgram:
        """Return the program that was read."""
        if not self.moves:
            raise ProgramError(f"{first.file}: expected motions, got none")
        base, tool = (self.registers.frame(word) for word in ("UFRAME", "UTOOL"))
        return RobotProgram(
            first.title,
            tuple(self.moves),
            (self.frames.base or base).pose,
            (self.frames.tool or tool).pose,
            tuple(sorted(self.notes.left_out.items())),
            tuple(self.notes.assumptions),
        )

    def run(self, text: TpText, arguments: tuple[Value, ...], depth: int) -> None:
        """Go through the program that is started, until its end or an ABORT."""
        try:
            self._run(_Running(text, arguments, {}, depth))
        except _Aborted:
            return

    def _run(self, running: _Running) -> None:
        text, index = running.text, 0
        while index < len(text.instructions):
            self.steps -= 1
            if self.steps < 0:
                raise ProgramError(
                    f"{text.where(index)}: expected at most {_MOST_REPEATED} repeated instructions, got"
                    " more: a loop that does not end, or too long a one"
                )
            index = self._step(running, index)

    def _step(self, running: _Running, index: int) -> int:
        """Execute an instruction and return the index of the next."""
        words = running.text.instructions[index].text
        upper = words.upper()
        where = running.text.where(index)
        if is_motion(words):
            motion = motion_of(words, where)
            self._move(running, motion, where)
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

    def _point_logic(self, running: _Running, index: int, where: str) -> int:
        """Go over what is done on the way to a point, which stands behind it up to a line of dashes."""
        instructions = running.text.instructions
        for after in range(index + 1, len(instructions)):
            instruction = instructions[after]
            if instruction.text.startswith("---"):
                return after + 1
            here = running.text.where(after)
            if not self._is_without_effect(running, instruction.text, here):
                raise ProgramError(
                    f"{here}: expected outputs and waits alone in what runs during a motion, got"
                    f" {shortened(instruction.text)!r}"
                )
            self.notes.leave_out("P-SPS")
        raise ProgramError(f"{where}: expected a line of dashes behind P-SPS, got none")

    def _partner(self, running: _Running, index: int, where: str) -> int:
        partner = running.text.partners.get(index)
        if partner is None:
            words = running.text.instructions[index].text
            raise ProgramError(f"{where}: expected the end of {shortened(words)!r}, got none")
        return partner

    def _act(self, running: _Running, index: int, words: str, where: str) -> int:
        """Execute an instruction that may stand behind a condition."""
        upper = words.upper()
        if upper.startswith("IF"):
            return self._if(running, index, words, where)
        if (jump := _JUMP.fullmatch(words)) is not None:
            return self._jump(running, index, jump[1], where)
        if upper == "END":
            return len(running.text.instructions)
        if upper == "ABORT":
            raise _Aborted
        if _LABEL.fullmatch(words):
            return index + 1
        if (call := _CALL.fullmatch(words)) is not None:
            self._call(running, call, where)
        elif _CALL_BY_STRING.fullmatch(words):
            raise ProgramError(
                f"{where}: expected the name of a program, got {shortened(words)!r}, which the controller"
                " alone knows: write the name"
            )
        elif (word := left_out_word(words)) is not None:
            self.notes.leave_out(word)
            if _TIMEOUT.match(words):
                self.notes.assume("what WAIT waits for comes before its TIMEOUT")
        else:
            self._set(running, words, where)
        return index + 1

    # Flow.

    def _truth(self, running: _Running, condition: str, where: str) -> bool | None:
        """Return whether a condition holds; None if nobody knows before the program runs."""
        value = self._value(running, condition, where)
        if isinstance(value, Unknown):
            return None
        return bool(value)

    def _unknown(self, running: _Running, condition: str, where: str) -> ProgramError:
        value = self._value(running, condition, where)
        name = value.name if isinstance(value, Unknown) else condition
        remedy = "set it before, or write the branch that is taken"
        if name.startswith("AR["):
            remedy = "read the program that calls this one, which gives it"
        return ProgramError(
            f"{where}: expected a condition of what the program sets, got {shortened(name)} in"
            f" {shortened(condition.strip())!r}: {remedy}"
        )

    def _if(self, running: _Running, index: int, words: str, where: str) -> int:
        condition, action = _parted(words[2:])
        if not action:
            raise ProgramError(
                f"{where}: expected a condition, a comma and an action, got {shortened(words)!r}"
            )
        truth = self._truth(running, condition, where)
        if truth is None:
            if not self._is_without_effect(running, action, where):
                raise self._unknown(running, condition, where)
            self.notes.leave_out("IF")
            return index + 1
        return self._act(running, index, action, where) if truth else index + 1

    def _branch(self, running: _Running, index: int, condition: str, where: str) -> int:
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

    def _is_without_effect(self, running: _Running, words: str, where: str) -> bool:
        """Return whether an action changes no path; a register that it may set is then unknown."""
        if left_out_word(words) is not None or words.upper() in ("ELSE", "ENDIF"):
            return True
        if words.upper().startswith("IF"):
            action = "" if _IF_THEN.fullmatch(words) else _parted(words[2:])[1]
            return not action or self._is_without_effect(running, action, where)
        if (call := _CALL.fullmatch(words)) is not None:
            return is_harmless(call[2], self.files)
        given = _REGISTER.fullmatch(words)
        if given is None:
            return False
        number = whole_number(self._value(running, given[1], where), f"{where}: R[]")
        self.registers.set_number(number, Unknown(f"R[{number}], set behind an unknown condition"))
        return True

    def _jump(self, running: _Running, index: int, label: str, where: str) -> int:
        number = whole_number(self._value(running, label, where), f"{where}: LBL[]")
        target = running.text.labels.get(number)
        if target is None:
            raise ProgramError(f"{where}: expected a label LBL[{number}] in the program, got none")
        place = (running.text.title, index)
        if target < index and self._jumped.get(place) == self.registers.changes:
            raise ProgramError(
                f"{where}: expected a program that ends, got JMP LBL[{number}], which repeats it for ever:"
                " remove the jump"
            )
        self._jumped[place] = self.registers.changes
        return target

    def _begin_loop(self, running: _Running, index: int, words: str, where: str) -> int:
        given = _FOR.fullmatch(words)
        if given is None:
            raise ProgramError(f"{where}: expected FOR R[]=.. TO .., got {shortened(words)!r}")
        register, start, word, end = given.groups()
        number = whole_number(self._value(running, register, where), f"{where}: R[]")
        first = self._known(running, start, where)
        last = self._known(running, end, where)
        self.registers.set_number(number, first)
        running.ends[index] = last
        up = word.upper() == "TO"
        enters = first <= last if up else first >= last
        return index + 1 if enters else self._partner(running, index, where) + 1

    def _end_loop(self, running: _Running, index: int, where: str) -> int:
        start = self._partner(running, index, where)
        given = _FOR.fullmatch(running.text.instructions[start].text)
        if given is None or start not in running.ends:
            raise ProgramError(f"{where}: expected ENDFOR behind its FOR, got a jump between them")
        number = whole_number(self._value(running, given[1], where), f"{where}: R[]")
        step = 1.0 if given[3].upper() == "TO" else -1.0
        value = self._known(running, f"R[{number}]", where)
        if step * (running.ends[start] - value) <= 0.0:
            return index + 1
        self.registers.set_number(number, value + step)
        return start + 1

    def _select(self, running: _Running, index: int, first: str, where: str) -> int:
        instructions = running.text.instructions
        register, _, rest = first.partition("=")
        cases, behind = [f"={rest}"], index + 1
        while behind < len(instructions) and (
            _CASE.fullmatch(instructions[behind].text)
            or _ELSE_CASE.fullmatch(instructions[behind].text)
        ):
            cases.append(instructions[behind].text)
            behind += 1
        value = self._value(running, register, where)
        if isinstance(value, Unknown):
            raise self._unknown(running, register, where)
        for case in cases:
            given, other = _CASE.fullmatch(case), _ELSE_CASE.fullmatch(case)
            if given is None and other is None:
                raise ProgramError(
                    f"{where}: expected =value,action in SELECT, got {shortened(case)!r}"
                )
            if given is None or value == self._known(running, given[1], where):
                action = given[2] if given is not None else case.partition(",")[2].strip()
                after = self._act(running, index, action, where)
                return behind if after == index + 1 else after
        return behind

    def _call(self, running: _Running, call: re.Match[str], where: str) -> None:
        word, name, arguments = call[1].upper(), call[2], call[3] or ""
        text = self.files.get(name.upper())
        if text is None:
            raise ProgramError(
                f"{where}: expected a file {name}.ls beside the program, got none for {word} {name}: put it"
                " there, or remove the line if it does not move the robot"
            )
        if is_harmless(name, self.files):
            self.notes.leave_out(f"{word} of outputs")
            return
        if word == "RUN":
            raise self._moving(name, where)
        if running.depth >= _DEEPEST:
            raise ProgramError(
                f"{where}: expected at most {_DEEPEST} calls in each other, got more"
            )
        values = tuple(self._value(running, part, where) for part in _listed(arguments))
        inner = _Running(text, values, dict(running.offsets), running.depth + 1)
        self._run(inner)
        if inner.offsets != running.offsets:
            # Whether a condition outlives the program that set it is not known.
            running.offsets = {}

    def _moving(self, name: str, where: str) -> ProgramError:
        words = first_effect(name, self.files)
        return ProgramError(
            f"{where}: expected outputs and waits alone in {name}, which runs during a motion, got"
            f" {shortened(words)!r}: call it before or after the motion"
        )

    # Values.

    def _value(self, running: _Running, expression: str, where: str) -> Value:
        def lookup(name: str, indices: tuple[int, ...]) -> Value:
            return self.registers.value(name, indices, running.arguments)

        return evaluate(expression, lookup, where)

    def _known(self, running: _Running, expression: str, where: str) -> float:
        value = self._value(running, expression, where)
        if isinstance(value, (Unknown, str)):
            name = value.name if isinstance(value, Unknown) else repr(value)
            raise ProgramError(
                f"{where}: expected a number that the program sets, got {shortened(name)}: set it before"
            )
        return float(value)

    def _index(self, running: _Running, expression: str, where: str) -> int:
        return whole_number(self._value(running, expression, where), f"{where}: [{expression}]")

    def _set(self, running: _Running, words: str, where: str) -> None:
        """Execute an assignment."""
        registers = self.registers
        if (given := _ELEMENT.fullmatch(words)) is not None:
            index, place = (self._index(running, part, where) for part in given.groups()[:2])
            registers.set_element(index, place, self._value(running, given[3], where), where)
        elif (given := _WHOLE.fullmatch(words)) is not None:
            index = self._index(running, given[1], where)
            registers.set_position(index, self._sum(running, given[2], where))
        elif (given := _REGISTER.fullmatch(words)) is not None:
            value = (
                Unknown(given[2])
                if OUTCOME.match(given[2])
                else self._value(running, given[2], where)
            )
            registers.set_number(self._index(running, given[1], where), value)
        elif (given := _SET.fullmatch(words)) is not None:
            number, index = (self._index(running, part, where) for part in given.groups()[1:])
            registers.set_frame(given[1].upper(), number, index, where)
        elif (given := _CHOSEN.fullmatch(words)) is not None:
            registers.choose(given[1].upper(), int(self._known(running, given[2], where)))
        elif (given := _OVERRIDE.fullmatch(words)) is not None:
            self._set_override(self._known(running, given[1], where), where)
        elif (given := _CONDITION.fullmatch(words)) is not None:
            self._set_condition(running, given, where)
        else:
            raise ProgramError(
                f"{where}: expected an instruction that is known, got {shortened(words)!r}: remove it if it"
                " does not change the path"
            )

    def _set_override(self, percent: float, where: str) -> None:
        if not 0.0 < percent <= 100.0:
            raise ProgramError(f"{where}: expected an override of 1 to 100 %, got {percent:g}")
        self.override = percent / 100.0
        self.notes.assume(f"OVERRIDE={percent:g}% scales the speeds behind it")

    def _set_condition(self, running: _Running, given: re.Match[str], where: str) -> None:
        word, register, frame, number = given.groups()
        if frame is not None:
            active = self.registers.active.get(frame.upper())
            if self._index(running, number, where) != active:
                raise ProgramError(
                    f"{where}: expected an offset in the {frame.upper()} in use, got {frame}[{number}]:"
                    " choose that one"
                )
        running.offsets[word.upper()] = self._index(running, register, where)

    def _sum(self, running: _Running, text: str, where: str) -> PositionRegister:
        """Return a sum or difference of positions."""
        bare = (
            text.strip().removeprefix("(").removesuffix(")")
            if text.startswith("(")
            else text.strip()
        )
        total: PositionRegister | None = None
        at = 0
        while at < len(bare):
            term = _TERM.match(bare, at)
            if term is None or (total is not None and not term[1]) or (total is None and term[1]):
                raise ProgramError(
                    f"{where}: expected a position, or a sum of PR[], got {shortened(bare)!r}"
                )
            value = self._term(running, term, where)
            if total is None:
                total = value
            else:
                total = self._added(total, value, -1.0 if term[1] == "-" else 1.0, where)
            at = term.end()
            if not bare[at:].strip():
                break
        if total is None:
            raise ProgramError(f"{where}: expected a position, got none")
        return total

    def _term(self, running: _Running, term: re.Match[str], where: str) -> PositionRegister:
        word = (term[3] or term[2]).upper()
        if word in ("LPOS", "JPOS"):
            last = self.registers.last_position(where)
            if last.is_joint != (word == "JPOS"):
                raise ProgramError(
                    f"{where}: expected {word}, got a last target of"
                    f" {'joint angles' if last.is_joint else 'X, Y, Z, W, P, R'}: the other is known to the"
                    " robot alone"
                )
            return PositionRegister.of(last)
        index = self._index(running, term[4], where)
        if word == "P":
            return PositionRegister.of(self._taught(running, index, where))
        if word == "PR":
            register = self.registers.positions.get(index)
            if register is None:
                self.registers.position(index, where)
            assert register is not None
            return PositionRegister(
                dict(register.elements), register.is_joint, register.others, register.is_matrix
            )
        pose = self.registers.frames.get((word, index))
        if pose is None:
            raise ProgramError(
                f"{where}: expected {word}[{index}] as the program sets it, and it does not: set it from a"
                " position register"
            )
        return PositionRegister.of(TpPosition(cartesian_of(pose)), is_matrix=True)

    def _added(
        self, a: PositionRegister, b: PositionRegister, sign: float, where: str
    ) -> PositionRegister:
        if bool(a.is_joint) != bool(b.is_joint) or a.is_matrix or b.is_matrix:
            raise ProgramError(
                f"{where}: expected positions of one kind to add, got X, Y, Z, W, P, R, joint angles or"
                " copies of frames"
            )
        elements: dict[int, Value] = {}
        for place in a.elements.keys() | b.elements.keys():
            x, y = (r.elements.get(place, Unknown("an element that is not set")) for r in (a, b))
            unknown = next((v for v in (x, y) if isinstance(v, (Unknown, str))), None)
            if unknown is None:
                elements[place] = float(x) + sign * float(y)
            else:
                elements[place] = unknown
        kind = a.is_joint if a.is_joint is not None else b.is_joint
        return PositionRegister(elements, kind, a.others)

    # Motions.

    def _taught(self, running: _Running, index: int, where: str) -> TpPosition:
        """Return a position of the program's own data."""
        key = (running.text.title, index)
        if key not in self._positions:
            data = running.text.positions.get(index)
            if data is None:
                raise ProgramError(f"{where}: expected a position in /POS, got none for P[{index}]")
            self._positions[key] = position_of(data, f"{running.text.file}: P[{index}]")
        return self._positions[key]

    def _move(self, running: _Running, motion: MotionInstruction, where: str) -> None:
        if not running.text.moves_robot:
            raise ProgramError(
                f"{where}: expected motions of group 1, the robot, got a program of other groups"
            )
        position = self._target(running, motion, where)
        for option in motion.options:
            if option.kind == "left out":
                self.notes.leave_out(option.words)
            elif option.kind == "call":
                self._on_the_way(option.argument, where)
        self._require_standing(position, where)
        duration, speed = self._pace(running, motion, position, where)
        registers = self.registers
        base, tool = registers.frame("UFRAME"), registers.frame("UTOOL")
        if position.is_joint:
            if motion.letter == "L":
                raise ProgramError(
                    f"{where}: expected X, Y, Z, W, P, R for a line, got joint angles: teach the position as"
                    " such, or write J"
                )
            joints = tuple(_RADIANS * angle for angle in position.values)
            self.moves.append(ProgramMove("joint", joints=joints, duration=duration, speed=speed))
        else:
            kind: Motion = "linear" if motion.letter == "L" else "joint"
            pose = self.frames.express(position.pose, base, tool, kind == "linear", where)
            self.moves.append(ProgramMove(kind, pose, duration=duration, speed=speed))
        registers.last = LastTarget(position, base, tool)

    def _target(self, running: _Running, motion: MotionInstruction, where: str) -> TpPosition:
        """Return the target of a motion with its offsets."""
        index = self._index(running, motion.index, where)
        if motion.register == "PR":
            position = self.registers.position(index, where)
        else:
            position = self._taught(running, index, where)
            self.registers.require_frames(position, where)
        if any(option.kind == "incremental" for option in motion.options):
            last = self.registers.last_position(where)
            self._require_one_kind(last, position, "INC", where)
            position = position.plus(last.values)
            # The last target has no other axes; those of an increment are zero where they stand.
            position = TpPosition(
                position.values, position.is_joint, others=self._moved_others(position, where)
            )
        for option in motion.options:
            if option.kind == "offset":
                position = self._offset(running, option, position, where)
        for option in motion.options:
            if option.kind == "tool_offset":
                position = self._tool_offset(running, option, position, where)
        return position

    def _moved_others(self, position: TpPosition, where: str) -> tuple[tuple[str, float], ...]:
        for name, value in position.others:
            if abs(value) > _STANDS:
                raise ProgramError(
                    f"{where}: expected {name} to stand, got an increment of {value:g}: the robot alone is"
                    " moved"
                )
        return ()

    def _shift(self, running: _Running, option: MotionOption, word: str, where: str) -> TpPosition:
        """Return the position register that an option shifts a target by."""
        if option.argument:
            return self.registers.position(self._index(running, option.argument, where), where)
        if word not in running.offsets:
            raise ProgramError(
                f"{where}: expected {word} CONDITION PR[] before {option.words}, got none"
            )
        return self.registers.position(running.offsets[word], where)

    def _offset(
        self, running: _Running, option: MotionOption, position: TpPosition, where: str
    ) -> TpPosition:
        shift = self._shift(running, option, "OFFSET", where)
        self._require_one_kind(position, shift, "Offset", where)
        if not shift.is_joint and any(shift.values[3:]):
            self.notes.assume(
                "W, P, R of an Offset are added to those of its target ($OFFSET_CART=FALSE)"
            )
        return position.plus(shift.values)

    def _tool_offset(
        self, running: _Running, option: MotionOption, position: TpPosition, where: str
    ) -> TpPosition:
        shift = self._shift(running, option, "TOOL_OFFSET", where)
        if position.is_joint or shift.is_joint:
            raise ProgramError(
                f"{where}: expected X, Y, Z, W, P, R with Tool_Offset, got joint angles: teach the position"
                " as such"
            )
        pose = product(position.pose, shift.pose)
        return TpPosition(cartesian_of(pose), others=position.others)

    def _require_one_kind(self, a: TpPosition, b: TpPosition, word: str, where: str) -> None:
        if a.is_joint != b.is_joint or len(a.values) != len(b.values):
            raise ProgramError(
                f"{where}: expected {word} and its target both as X, Y, Z, W, P, R or both as joint angles,"
                " got one of each, which the robot alone can add"
            )

    def _require_standing(self, position: TpPosition, where: str) -> None:
        """Refuse a target to which other axes than the robot's move."""
        for name, value in position.others:
            before = self.others.setdefault(name, value)
            if abs(value - before) > _STANDS:
                raise ProgramError(
                    f"{where}: expected {name} to stand, got a move from {before:g} to {value:g}: the robot"
                    " alone is moved"
                )

    def _on_the_way(self, action: str, where: str) -> None:
        """Take what is done during a motion: outputs, or a program of outputs."""
        if action.upper() == "P-SPS":
            return
        if (call := _CALL.fullmatch(action)) is None:
            self.notes.leave_out(left_out_word(action) or action)
            return
        name = call[2]
        if name.upper() not in self.files:
            raise ProgramError(
                f"{where}: expected a file {name}.ls beside the program, got none for {action}: put it"
                " there, or remove the option if it does not move the robot"
            )
        if not is_harmless(name, self.files):
            raise self._moving(name, where)
        self.notes.leave_out("CALL of outputs")

    def _pace(
        self, running: _Running, motion: MotionInstruction, position: TpPosition, where: str
    ) -> tuple[float | None, float | None]:
        """Return time [s] and speed [m/s] of a motion, whichever it has."""
        if motion.unit == "%":
            return None, None
        number = self._known(running, motion.speed, where)
        if number <= 0.0:
            raise ProgramError(f"{where}: expected a speed or a time > 0, got {number:g}")
        if motion.unit in _TIMES:
            return _TIMES[motion.unit] * number / self.override, None
        if motion.unit in _PACES:
            return None, _PACES[motion.unit] * number * self.override
        last = self.registers.last_position(where)
        if last.is_joint or position.is_joint or _angle(last.pose, position.pose) == 0.0:
            raise ProgramError(
                f"{where}: expected a turn from the last pose for a speed in deg/sec, got none: write mm/sec"
            )
        return _angle(last.pose, position.pose) / (number * self.override), None


def _angle(a: Pose, b: Pose) -> float:
    """Return the angle between two poses [deg]."""
    along = abs(sum(x * y for x, y in zip(a[3:], b[3:], strict=True)))
    return 2.0 * degrees(acos(min(along, 1.0)))


def _parted(text: str) -> tuple[str, str]:
    """Return what stands before and behind the first comma outside of brackets."""
    depth = 0
    for at, letter in enumerate(text):
        depth += (letter in "([") - (letter in ")]")
        if letter == "," and depth == 0:
            return text[:at].strip(), text[at + 1 :].strip()
    return text.strip(), ""


def _listed(text: str) -> list[str]:
    """Return the parts between commas outside of brackets."""
    parts, rest = [], text.strip()
    while rest:
        part, rest = _parted(rest)
        parts.append(part)
    return parts
