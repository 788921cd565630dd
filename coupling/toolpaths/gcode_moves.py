"""What a G-code program does: moves and waits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.path.frame import Frame
from coupling.toolpaths.arcs import Arc
from coupling.toolpaths.rotary import Coordinates
from coupling.toolpaths.segments import Curve, Segment, straight
from coupling.toolpaths.spindle import ProgrammedSpindle

_NO_ROTATION = np.zeros(3)


@dataclass(frozen=True, slots=True)
class Held:
    """How a tool is held: by angles, or by its axis.

    Attributes:
        angles: Angles of the rotary axes of the machine's kinematics [rad].
        axis: Unit vector from the tip to the holder, axes of X, Y, Z; empty where angles say it.
    """

    angles: tuple[float, ...] = ()
    axis: tuple[float, ...] = ()


UNTILTED = Held(axis=(0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Turn:
    """How a tool turns along a move: evenly with the way.

    Attributes:
        before, after: Directions at its ends.
        is_great_circle: Whether its axis turns in the plane of both; otherwise the rotary axes turn.
        angle: Angle that stands for its way where X, Y, Z stay [rad]; zero where they do not.
    """

    before: Held
    after: Held
    is_great_circle: bool
    angle: float = 0.0


@dataclass(frozen=True, slots=True)
class GcodeMove:
    """A move; what is computed of it is not kept, for programs have many.

    Attributes:
        start, end: First and last X, Y, Z [m], (3,).
        feed: Its speed [m/s], or [rad/s] where they stay; None for a rapid.
        arc: Its curve; None for a line.
        turn: Directions of its tool; None for one along z.
    """

    start: np.ndarray
    end: np.ndarray
    feed: float | None
    arc: Arc | None = None
    turn: Turn | None = None

    @property
    def stays(self) -> bool:
        """Whether X, Y, Z stay, and the tool turns."""
        return self.turn is not None and self.turn.angle > 0.0

    @property
    def segment(self) -> Segment:
        """Its curve by arc length, or by the angle that the tool turns by."""
        if self.turn is not None and self.turn.angle > 0.0:
            return Curve(self.turn.angle, lambda s: np.tile(self.end, (len(s), 1)))
        return straight(self.start, self.end) if self.arc is None else self.arc.segment()

    @property
    def curvatures(self) -> tuple[np.ndarray, np.ndarray]:
        """Curvature vectors at its ends [1/m], (3,) each; zeros for a line."""
        return (_NO_ROTATION, _NO_ROTATION) if self.arc is None else self.arc.curvatures()


@dataclass(frozen=True, slots=True)
class Dwell:
    """A wait [s]."""

    duration: float


@dataclass(frozen=True)
class GcodeProgram:
    """Moves of a program.

    Attributes:
        steps: Its moves and waits.
        left_out: Words that were read and left out, by how often they stand there.
        assumptions: Sentences without a full stop.
        coordinates: Meaning of X, Y, Z with a tilted tool: its tip in the part, or the linear axes.
        plane: Frame of X, Y, Z in the part; None where it is the part's.
        spindle: Speed of its spindle in its feeds; None where it has none.
    """

    steps: tuple[GcodeMove | Dwell, ...]
    left_out: dict[str, int]
    assumptions: tuple[str, ...] = ()
    coordinates: Coordinates = "tool-tip"
    plane: Frame | None = None
    spindle: ProgrammedSpindle | None = None
