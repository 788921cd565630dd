"""Words of an arc in G-code: a radius R, or a centre I, J, K in the arc's plane."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coupling.programs.reading import ReadingNotes
from coupling.toolpaths.arcs import Arc, Plane

_OFFSETS = "IJK"


@dataclass(frozen=True)
class ArcWords:
    """The words of a line with G2 or G3, and the modes that they are in.

    Attributes:
        values: The words by their letters, in the program's unit.
        plane: Plane of the arc.
        is_clockwise: Whether it is G2.
        is_centre_absolute: Whether the centre is a place (G90.1), not an offset from the start.
        in_metres: Function that gives a length of the program [m].
        notes: Notes on what is left out.
    """

    values: dict[str, float]
    plane: Plane
    is_clockwise: bool
    is_centre_absolute: bool
    in_metres: Callable[[float], float]
    notes: ReadingNotes

    def arc(self, start: np.ndarray, end: np.ndarray) -> Arc:
        """Return the arc from one point to another [m], (3,) each.

        Raises:
            ValueError: If its words do not say which one.
        """
        values, plane, clockwise = self.values, self.plane, self.is_clockwise
        axes = (plane.first, plane.second)
        in_plane, across = [_OFFSETS[axis] for axis in axes], _OFFSETS[plane.normal]
        if values.get(across) == 0.0:
            # A centre is in the plane of its arc: a zero across it says the same.
            self.notes.leave_out(f"{across}0")
            del values[across]
        offset_words = [letter for letter in _OFFSETS if letter in values]
        if "R" in values:
            if offset_words:
                raise ValueError(
                    f"expected either R or a centre, got both R and {offset_words[0]}: give one"
                )
            return Arc.of_radius(plane, start, end, self.in_metres(values["R"]), clockwise)
        centre_is = f"a centre {in_plane[0]}, {in_plane[1]} in this plane"
        if across in offset_words:
            raise ValueError(
                f"expected R or {centre_is}, got {across}{values[across]:g}, an offset across it: select"
                " the arc's plane by G17, G18 or G19"
            )
        if not offset_words:
            raise ValueError(f"expected R or {centre_is}, got none: give it")
        if self.is_centre_absolute and len(offset_words) < 2:
            raise ValueError(
                f"expected both {in_plane[0]} and {in_plane[1]} after G90.1, got"
                f" {offset_words[0]}: give both"
            )
        offsets = np.array([self.in_metres(values.get(letter, 0.0)) for letter in in_plane])
        centre = offsets if self.is_centre_absolute else start[list(axes)] + offsets
        return Arc.about(plane, start, end, centre, clockwise)
