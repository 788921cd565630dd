"""State of a FANUC controller: registers, position registers, frames, and the last target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from coupling.errors import ProgramError
from coupling.programs.fanuc.expressions import Value
from coupling.programs.fanuc.positions import TpPosition, cartesian_of
from coupling.programs.frames import ControllerFrame
from coupling.programs.poses import inverse, product
from coupling.programs.program import HERE, Pose
from coupling.programs.reading import ReadingNotes
from coupling.programs.unknown import Unknown

# Elements of a position register: those of a pose, or the joints that it may have.
_POSE, _MOST_JOINTS = 6, 9


@dataclass
class PositionRegister:
    """A position register.

    Attributes:
        elements: Its numbers by their place, from one [mm], [deg].
        is_joint: Whether they are joint angles; None where only elements were set.
        others: Axes beside the robot's that it holds.
        is_matrix: Whether it was copied from a frame, which most controllers hold as a matrix.
    """

    elements: dict[int, Value] = field(default_factory=dict)
    is_joint: bool | None = None
    others: tuple[tuple[str, float], ...] = ()
    is_matrix: bool = False

    @classmethod
    def of(cls, position: TpPosition, is_matrix: bool = False) -> PositionRegister:
        """Return a register that holds a position."""
        elements: dict[int, Value] = dict(enumerate(position.values, start=1))
        return cls(elements, position.is_joint, position.others, is_matrix)


@dataclass
class LastTarget:
    """Target of the last motion.

    Attributes:
        position: Its numbers.
        base, tool: Frames that they stand in.
    """

    position: TpPosition
    base: ControllerFrame
    tool: ControllerFrame


@dataclass
class Registers:
    """State of a controller.

    Attributes:
        notes: Notes on what is assumed.
        numbers: Registers R.
        positions: Position registers PR.
        frames: Frames that were set, by UFRAME or UTOOL and their numbers.
        active: Numbers of the frames in use, by UFRAME and UTOOL; none before they are known.
        stated: Those that the program itself chose.
        last: Last target, if there was a motion.
        override: Part of the programmed speeds that is driven.
        changes: Count of values that changed, by which an endless loop is known.
    """

    notes: ReadingNotes
    numbers: dict[int, Value] = field(default_factory=dict)
    positions: dict[int, PositionRegister] = field(default_factory=dict)
    frames: dict[tuple[str, int], Pose] = field(default_factory=dict)
    active: dict[str, int] = field(default_factory=dict)
    last: LastTarget | None = None
    override: float = 1.0
    changes: int = 0

    def value(self, name: str, indices: tuple[int, ...], arguments: Sequence[Value]) -> Value:
        """Return the value of a register in an expression; unknown where the program does not set it."""
        if name == "R" and len(indices) == 1:
            return self.numbers.get(indices[0], Unknown(f"R[{indices[0]}]"))
        if name == "AR" and len(indices) == 1:
            (k,) = indices
            return arguments[k - 1] if 0 < k <= len(arguments) else Unknown(f"AR[{k}]")
        if name == "PR" and len(indices) == 2:
            register = self.positions.get(indices[0], PositionRegister())
            unknown = Unknown(f"PR[{indices[0]},{indices[1]}]")
            return unknown if register.is_matrix else register.elements.get(indices[1], unknown)
        return Unknown(f"{name}[{','.join(str(k) for k in indices)}]")

    def set_number(self, index: int, value: Value) -> None:
        """Set a register, in single precision unless it is whole."""
        if isinstance(value, bool):
            value = float(value)
        if isinstance(value, float) and value != int(value):
            value = float(np.float32(value))
        if isinstance(value, str):
            value = Unknown(f"the string {value!r}")
        self.changes += self.numbers.get(index) != value
        self.numbers[index] = value

    def set_element(self, index: int, place: int, value: Value, where: str) -> None:
        """Set an element of a position register."""
        register = self.positions.setdefault(index, PositionRegister())
        most = _MOST_JOINTS if register.is_joint else _POSE
        if not 1 <= place <= most or isinstance(value, str):
            raise ProgramError(
                f"{where}: expected an element of 1 to {most} of PR[{index}] and a number, got {place}"
                f" and {value if isinstance(value, str) else 'a number'}: other axes are not read"
            )
        if register.is_matrix:
            raise ProgramError(
                f"{where}: expected PR[{index}] as X, Y, Z, W, P, R, got a copy of a frame, which"
                " controllers hold as a matrix: set its six elements by numbers"
            )
        if isinstance(value, (bool, float)):
            value = float(np.float32(value))
        self.changes += register.elements.get(place) != value
        register.elements[place] = value

    def set_position(self, index: int, register: PositionRegister) -> None:
        """Set a position register as a whole."""
        self.changes += self.positions.get(index) != register
        self.positions[index] = register

    def position(self, index: int, where: str) -> TpPosition:
        """Return what a position register holds.

        Raises:
            ProgramError: If the program does not set it.
        """
        register = self.positions.get(index)
        if register is None:
            raise ProgramError(
                f"{where}: expected PR[{index}] with a value, and the program sets none: write"
                f" PR[{index},1]=.. to PR[{index},6]=.. before"
            )
        if register.is_joint is None:
            self.notes.assume(f"PR[{index}], set element by element, holds X, Y, Z, W, P, R")
        count = len(register.elements) if register.is_joint else _POSE
        values: list[float] = []
        for place in range(1, count + 1):
            value = register.elements.get(place, Unknown(f"PR[{index},{place}]"))
            if isinstance(value, (Unknown, str)):
                name = value.name if isinstance(value, Unknown) else value
                raise ProgramError(
                    f"{where}: expected PR[{index}] with numbers that the program sets, got {name}"
                    f" in PR[{index},{place}]: set it before"
                )
            values.append(float(value))
        return TpPosition(tuple(values), bool(register.is_joint), others=register.others)

    def set_frame(self, word: str, number: int, index: int, where: str) -> None:
        """Set a frame from a position register; unknown if that is.

        Args:
            word: UFRAME or UTOOL.
            index: Number of the position register.
            where: Place in the program, for messages.
        """
        position = self.frame_position(index, where)
        self.changes += self.frames.get((word, number)) != position.pose
        self.frames[word, number] = position.pose

    def frame_position(self, index: int, where: str) -> TpPosition:
        """Return what a position register holds that becomes a frame."""
        register = self.positions.get(index)
        if register is not None and register.is_joint is None:
            # A frame is Cartesian whatever the register was before.
            register.is_joint = False
        position = self.position(index, where)
        if position.is_joint:
            raise ProgramError(
                f"{where}: expected a frame of X, Y, Z, W, P, R, got joint angles in PR[{index}]"
            )
        return position

    def choose(self, word: str, number: int) -> None:
        """Choose a frame."""
        self.changes += self.active.get(word) != number
        self.active[word] = number

    def frame(self, word: str) -> ControllerFrame:
        """Return the frame in use: the robot's own for number 0, unknown if the controller holds it."""
        number = self.active.get(word)
        if number is None:
            return ControllerFrame(f"the {word} in use", None)
        pose = HERE if number == 0 else self.frames.get((word, number))
        return ControllerFrame(f"{word} {number}", pose)

    def require_frames(self, position: TpPosition, where: str) -> None:
        """Refuse a position of other frames than those in use, as a controller does.

        Where none was chosen those of the position are in use.
        """
        for word, number in (("UFRAME", position.frame), ("UTOOL", position.tool)):
            if number is None:
                continue
            if word not in self.active:
                self.notes.assume(f"{word} {number} is in use at the start, as positions say")
                self.active[word] = number
            elif self.active[word] != number:
                short = word.replace("FRAME", "F").replace("TOOL", "T")
                raise ProgramError(
                    f"{where}: expected a position of {word} {self.active[word]}, which is in use,"
                    f" got {short} : {number}: choose it by {word}_NUM={number} before"
                )

    def last_position(self, where: str) -> TpPosition:
        """Return the last target in the frames in use.

        Raises:
            ProgramError: If it is not known.
        """
        if self.last is None:
            raise ProgramError(
                f"{where}: expected a position to begin with, got none: only the robot knows where it"
                " stands; begin with a motion to a position"
            )
        base, tool = self.frame("UFRAME"), self.frame("UTOOL")
        position = self.last.position
        if position.is_joint:
            return TpPosition(position.values, is_joint=True)
        if (base, tool) == (self.last.base, self.last.tool):
            return TpPosition(
                cartesian_of(position.pose) if position.is_tilted_over else position.values
            )
        last_frames = (self.last.base.pose, self.last.tool.pose, base.pose, tool.pose)
        if None in last_frames:
            raise ProgramError(
                f"{where}: expected the last position in {base.name} and {tool.name}, got it in"
                f" {self.last.base.name} and {self.last.tool.name}, which the program does not all"
                " set: set them from position registers"
            )
        first_base, first_tool, other_base, other_tool = (pose or HERE for pose in last_frames)
        flange = product(product(first_base, position.pose), inverse(first_tool))
        pose = product(product(inverse(other_base), flange), other_tool)
        return TpPosition(cartesian_of(pose))
