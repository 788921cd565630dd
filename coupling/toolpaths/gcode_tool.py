"""Direction of the tool while G-code is read: by rotary axes, by a vector, or by a tilted plane."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from coupling.path.frame import Frame
from coupling.programs.reading import ReadingNotes
from coupling.toolpaths.gcode_codes import TIP_M, TIP_OFF, TIP_ON
from coupling.toolpaths.gcode_moves import UNTILTED, Held, Turn
from coupling.toolpaths.gcode_rotary import OTHER_AXES, OtherAxes
from coupling.toolpaths.gcode_words import Block
from coupling.toolpaths.rotary import Coordinates, RotaryTable
from coupling.toolpaths.tilted_plane import plane_of_cycle800, plane_of_g68_2

_COMPONENTS, _OFFSETS = ("A3", "B3", "C3"), ("I", "J", "K")
_DIRECTIONS = OTHER_AXES.union(_COMPONENTS)


class ToolDirection:
    """How the tool is held, and what X, Y, Z mean while it is tilted.

    Attributes:
        axes: Rotary axes.
        held: Direction of the tool.
        plane: Frame of the tilted plane in the part; None without one.
        is_great_circle: Whether the tool turns in the plane of its directions at both ends of a move;
            otherwise the rotary axes turn evenly.
    """

    def __init__(self, notes: ReadingNotes, table: RotaryTable | None) -> None:
        self._notes, self._table = notes, table
        self.axes = OtherAxes(notes, table)
        self.held = Held(self.axes.angles) if table else UNTILTED
        self.plane: Frame | None = None
        self._word = ""
        self._is_aligned, self._has_met = True, False
        # What ORIVECT or ORIAXES, and without them ORIWKS or ORIMKS, say of the way between directions.
        self._way, self._reference = "", ""
        self.is_great_circle = False

    @property
    def coordinates(self) -> Coordinates | None:
        """What X, Y, Z are while the tool is tilted; None where nothing says it."""
        return "tool-tip" if self._word else self._table.coordinates if self._table else None

    @property
    def is_tilted(self) -> bool:
        """Whether the tool is not known to be along the z axis of X, Y, Z."""
        if self.held.axis:
            return self.held is not UNTILTED
        return any(self.held.angles)

    def forget(self, letters: list[str]) -> None:
        """Note axes that return to the machine's reference."""
        self.axes.forget(letters)
        if self.held.angles:
            self.held = Held(self.axes.angles)

    def takes(self, values: dict[str, float]) -> bool:
        """Return whether words are on the tool's direction."""
        vectors = self._word == "G43.5" and not values.keys().isdisjoint(_OFFSETS)
        return vectors or not _DIRECTIONS.isdisjoint(values)

    def modes(self, block: Block, has_moved: bool, length: Callable[[float], float]) -> str:
        """Take the modes of a line, and return what lost the place of the tool in the part, or nothing.

        Args:
            block: The line; its values lose those of a plane.
            has_moved: Whether the tool has moved in the part.
            length: Function from a length as written to metres.

        Raises:
            ValueError: If they contradict the table, or each other.
        """
        lost = ""
        for value in block.g:
            if value in TIP_ON:
                lost = self._begin_tip(f"G{value:g}") or lost
            elif value in TIP_OFF:
                lost = self._end_tip(f"G{value:g}") or lost
            elif value == 68.2:
                plane = plane_of_g68_2(block.values, length(1.0))
                lost = self._set_plane("G68.2", plane, has_moved)
                self._is_aligned = False
            elif value == 53.1:
                lost = self._align()
            elif value == 69.0 and self.plane is not None:
                lost = self._set_plane("G69", None, has_moved)
        for value in block.m:
            if value in TIP_M:
                tip = self._begin_tip if value == 128.0 else self._end_tip
                lost = tip(f"M{value:g}") or lost
        for statement in block.statements:
            lost = self._state(statement, has_moved, length) or lost
        return lost

    def take(
        self, values: dict[str, float], motion: float | None, absolute: bool, in_part: bool
    ) -> None:
        """Take the words of rotary axes and of a tool vector out of a line.

        Args:
            values: Words of the line by their letters; they lose these.
            motion: Number of the G-word of motion in force.
            absolute: Whether rotary words are places; otherwise ways.
            in_part: Whether the tool moves in the part, or has moved there.

        Raises:
            ValueError: If they are not read.
        """
        before = self.axes.values
        self.axes.take(values, absolute, in_part)
        names = next((n for n in (_COMPONENTS, _OFFSETS) if not values.keys().isdisjoint(n)), None)
        if names is _OFFSETS and (self._word != "G43.5" or motion in (2.0, 3.0)):
            if self._word == "G43.5":
                raise ValueError(
                    "expected lines under G43.5, got an arc, whose I, J, K are a tool vector here:"
                    " post-process arcs as lines"
                )
            names = None
        if names:
            self.held = self._vector([values.pop(name, 0.0) for name in names])
            self.is_great_circle = True
        elif self._table and self.axes.values is not before:
            self.held = Held(self.axes.angles)
            way = self._way or ("ORIVECT" if self._reference == "ORIWKS" else "")
            # Without tip control the axes are moved as they are.
            self.is_great_circle = way == "ORIVECT" and self.coordinates == "tool-tip"
        changed = bool(names) or (self._table is not None and self.axes.values is not before)
        if self.plane is not None and self._is_aligned and changed:
            raise ValueError(
                "expected a tool along the z axis of its tilted plane, got rotary axes or a vector: turn"
                " the plane instead"
            )

    def require_meaning(self) -> None:
        """Refuse a move of a tilted tool whose X, Y, Z are not known to be its tip or the machine's.

        Raises:
            ValueError: If they are not, or if its direction is not known.
        """
        if not self._has_met:
            self._has_met = True
            self.axes.assume_zeros()
        if not self._is_aligned:
            raise ValueError("expected G53.1 behind G68.2, got a move: write it before")
        if self.is_tilted and self.coordinates is None:
            raise ValueError(
                "expected to know what X, Y, Z are where rotary axes are turned, got none of G43.4,"
                ' G43.5, G234, TRAORI, M128 before: write coordinates = "tool-tip" or "machine"'
                " in [tool_path.rotary]"
            )
        if self._word and self._table is None and self.held is UNTILTED and self.plane is None:
            angle_words = [
                f"{letter}{value:g}" for letter, value in self.axes.values.items() if value
            ]
            if angle_words:
                raise ValueError(
                    f"expected the machine's axes in [tool_path.rotary], got {angle_words[0]} under"
                    f" {self._word} without them: name them, or give tool vectors"
                )

    def turn(self, before: Held, stays: bool) -> Turn | None:
        """Return how the tool turns along a move; None where it is along z.

        Args:
            before: Direction at its beginning.
            stays: Whether X, Y, Z stay.

        Raises:
            ValueError: If rotary axes turn from where they are not known.
        """
        after = self.held
        if before is UNTILTED and after is UNTILTED:
            return None
        if not self.is_great_circle and not (before.angles and after.angles) and before != after:
            raise ValueError(
                "expected rotary axes to turn from known angles, got a tool vector before: give"
                " vectors, or angles, for all moves"
            )
        angle = 0.0
        if stays and before.angles and after.angles:
            angle = math.dist(before.angles, after.angles)
        elif stays:
            angle = math.acos(max(-1.0, min(1.0, float(self._axis(before) @ self._axis(after)))))
        return Turn(before, after, self.is_great_circle, angle)

    def _axis(self, state: Held) -> np.ndarray:
        if state.axis or self._table is None:
            return np.array(state.axis)
        axis: np.ndarray = self._table.kinematics.axis(np.array([state.angles]))[0]
        return axis

    def _begin_tip(self, word: str) -> str:
        if self._table and self._table.coordinates == "machine":
            raise ValueError(
                f"expected machine coordinates, as [tool_path.rotary] says, got {word}: take out"
                " coordinates there, or this word"
            )
        lost = word if self.is_tilted and self.coordinates is None else ""
        self._word = word
        return lost

    def _end_tip(self, word: str) -> str:
        ended, self._word = self._word, ""
        return f"{word}, the end of {ended}," if ended and self.is_tilted else ""

    def _set_plane(self, word: str, plane: Frame | None, has_moved: bool) -> str:
        if plane is not None and has_moved:
            raise ValueError(
                f"expected one plane for all moves, got {word} behind some: give each plane its own file"
            )
        if plane is not None or not has_moved:
            self.plane, self._is_aligned = plane, True
        return f"{word}, {'a tilted plane' if plane else 'the end of the tilted plane'},"

    def _align(self) -> str:
        if self._is_aligned:
            raise ValueError("expected G68.2 before G53.1, got none: write it")
        self._is_aligned = True
        self.held = UNTILTED
        return "G53.1"

    def _state(self, statement: str, has_moved: bool, length: Callable[[float], float]) -> str:
        if statement.startswith("TRAORI"):
            return self._begin_tip("TRAORI")
        if statement.startswith("TRAFOOF"):
            return self._end_tip("TRAFOOF")
        if statement.startswith("CYCLE800"):
            plane = plane_of_cycle800(statement, length(1.0))
            if plane is None and self.plane is None:
                self._notes.leave_out("CYCLE800")
                return ""
            self.held = UNTILTED
            return self._set_plane("CYCLE800", plane, has_moved)
        if statement in ("ORIVECT", "ORIAXES"):
            self._way = statement
        else:
            self._reference = statement
        return ""

    def _vector(self, components: list[float]) -> Held:
        if self.coordinates != "tool-tip":
            raise ValueError("expected TRAORI or G43.5 before a tool vector, got neither: write it")
        if "ORIMKS" in (self._reference, self._way) or self._way == "ORIAXES":
            mode = self._way or self._reference
            raise ValueError(
                f"expected ORIWKS and ORIVECT with a tool vector, got {mode}: it is turned as the"
                " machine's axes go, which is not known from a vector; post-process with rotary axes"
            )
        norm = math.hypot(*components)
        if not 1e-6 < norm < 1e6:
            raise ValueError(f"expected a tool vector, got length {norm:.4g}: write its direction")
        axis = tuple(component / norm for component in components)
        return UNTILTED if axis == UNTILTED.axis else Held(axis=axis)
