"""How the next command is to be found, and how well the measuring device is known."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from coupling.results.next_result import DeviationSize

# Runs one after the other on a warm robot repeat better than data sheets of large robots say, 0.05 mm.
REPEATABILITY = 2e-5
# Three standard deviations and the mean of a distance are 3.6 standard deviations of a coordinate.
_OF_RP = float(np.sqrt(3.0) / 3.6)
KINDS = ("auto", "parameters", "path", "both")
# What an industrial robot's tool may be off before it is measured: pose accuracy of robots that are not
# calibrated, some tenths of a millimetre [m], and that over an arm of a metre [rad].
_ROBOT_OFF, _ROBOT_TURNED = 5e-4, 5e-4
# Standard deviations of both beyond which a frame is doubted.
_DOUBTFUL = 3.0


@dataclass(frozen=True)
class FrameAccuracy:
    """How well the measuring frame is known: standard deviations from the robot's base frame.

    Attributes:
        shift: Deviation of each coordinate of its origin [m].
        turn: Deviation of each coordinate of its turn about the middle of the path [rad].
        tip: Deviation of each coordinate of the probe's tip from the TCP, axes of the tool [m]; 0: none.
        is_clock_known: Whether the device's clock is the command's, and what the tool is late by the
            robot's.
    """

    shift: float = np.inf
    turn: float = 1e-4
    tip: float = 0.0
    is_clock_known: bool = False

    def of_device(self, shift: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the parts of a shift [m] and a turn [rad] that are the device's, not the robot's.

        Both may be off; each gets its share of the variance.

        Example:
            >>> shift, turn = FrameAccuracy(5e-5, 5e-5).of_device(np.full(3, 1e-4), np.zeros(3))
            >>> shift.round(8).tolist()
            [9.9e-07, 9.9e-07, 9.9e-07]
            >>> FrameAccuracy().of_device(np.full(3, 1e-4), np.zeros(3))[0].tolist()
            [0.0001, 0.0001, 0.0001]
        """
        return (
            shift * _share(self.shift, _ROBOT_OFF),
            turn * _share(self.turn, _ROBOT_TURNED),
        )

    def explains(self, offset: np.ndarray) -> bool:
        """Return whether device and robot together may be off by a constant [m], (3,).

        Example:
            >>> [FrameAccuracy(5e-5).explains(np.array([0.0, off, 0.0])) for off in (1e-3, 2e-3)]
            [True, False]
        """
        return bool(np.abs(offset).max() <= _DOUBTFUL * np.hypot(self.shift, _ROBOT_OFF))

    def of_tip(self) -> float:
        """Return the part of a tip's offset that is the probe's, not the robot's tool."""
        return _share(self.tip, _ROBOT_OFF)


def _share(deviation: float, robot: float) -> float:
    return 1.0 if np.isinf(deviation) else deviation**2 / (deviation**2 + robot**2)


ANYWHERE = FrameAccuracy(np.inf, np.inf)


@dataclass(frozen=True)
class NextOptions:
    """How the next command is found.

    Attributes:
        frame_accuracy: Standard deviations of the measuring device's frame and tip.
        move: One of `KINDS`.
        cutoff: Cutoff of learning along the path that is asked for [Hz]; None: as runs confirm
            it.
        repeatability: RP of the robot by ISO 9283, on the day and on this path [m].
    """

    frame_accuracy: FrameAccuracy = field(default_factory=FrameAccuracy)
    move: str = "auto"
    cutoff: float | None = None
    repeatability: float = REPEATABILITY

    @property
    def random(self) -> float:
        """Rms distance from run to run [m]: RP is the mean of distances and three deviations of them."""
        return _OF_RP * self.repeatability

    @property
    def absolute(self) -> bool:
        """Whether the deviation's constant counts: the frame is said to be known."""
        return bool(np.isfinite(self.frame_accuracy.shift))

    def rms_of(self, size: DeviationSize) -> float:
        """Return the rms of a deviation [m]: less a constant where the frame is not known."""
        return size.rms if self.absolute else size.rms_less_constant
