"""What a G-code program does: moves and waits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from coupling.toolpaths.arcs import Arc
from coupling.toolpaths.segments import Segment, straight

_STRAIGHT = np.zeros(3)


@dataclass(frozen=True, slots=True)
class GcodeMove:
    """A move of the tool's tip; what is computed of it is not kept, for programs have many.

    Attributes:
        start, end: First and last point [m], (3,).
        feed: Its speed [m/s]; None for a rapid.
        rotary: Angles of rotary axes at its end by their letters, as the program has them [deg].
        arc: Its curve; None for a line.
    """

    start: np.ndarray
    end: np.ndarray
    feed: float | None
    rotary: Mapping[str, float]
    arc: Arc | None = None

    @property
    def segment(self) -> Segment:
        """Its curve by arc length."""
        return straight(self.start, self.end) if self.arc is None else self.arc.segment()

    @property
    def begins(self) -> np.ndarray:
        """Unit tangent at its start, (3,)."""
        return self._along if self.arc is None else self.arc.directions()[0]

    @property
    def ends(self) -> np.ndarray:
        """Unit tangent at its end, (3,)."""
        return self._along if self.arc is None else self.arc.directions()[1]

    @property
    def _along(self) -> np.ndarray:
        way = self.end - self.start
        along: np.ndarray = way / np.linalg.norm(way)
        return along

    @property
    def curvatures(self) -> tuple[np.ndarray, np.ndarray]:
        """Curvature vectors at its ends [1/m], (3,) each; zeros for a line."""
        return (_STRAIGHT, _STRAIGHT) if self.arc is None else self.arc.curvatures()


@dataclass(frozen=True, slots=True)
class Dwell:
    """A wait [s]."""

    duration: float


@dataclass(frozen=True)
class GcodeProgram:
    """Moves of a program.

    Attributes:
        steps: Its moves and waits.
        ignored: Words that were read and left out, by how often they stand there.
        assumptions: Sentences without a full stop.
    """

    steps: tuple[GcodeMove | Dwell, ...]
    ignored: dict[str, int]
    assumptions: tuple[str, ...] = ()
