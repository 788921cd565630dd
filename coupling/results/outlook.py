"""What to expect of a command on a real robot, which is none of the model's own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pydantic import computed_field

from coupling.path.deviation import Deviation, measure
from coupling.path.histories import ToolPath
from coupling.results.base import ResultPart

# Replays of gears whose stiffness is that of a class of robots: its lowest and its highest.
ENDS_OF_RANGES = ("the softest gears of their class", "the stiffest gears of their class")


@dataclass(frozen=True)
class Replay:
    """What a command leaves on robots that differ from the model.

    Attributes:
        name: Difference from the model, in words.
        deviation: Deviation from the desired paths, the worst figures of all tools.
        tools: Deviation of every tool.
    """

    name: str
    deviation: Deviation
    tools: tuple[Deviation, ...]

    @classmethod
    def of(cls, name: str, path: ToolPath, desired: ToolPath) -> Replay:
        """Return what a path of all tools leaves to the desired one."""
        pairs = zip(path.tools, desired.tools, strict=True)
        tools = tuple(measure(own, wanted) for own, wanted in pairs)
        return cls(name, measure(path, desired), tools)


class WorstReplay(ResultPart):
    """The worst of all replays of a command, beside what the uncorrected one leaves.

    Attributes:
        worst: Difference from the model in the replay with the largest deviation.
        deviation: Largest deviation of all replays [m].
        less_constant: The same less a constant, of the replay in which this is largest [m].
        nothing: Largest deviation of the uncorrected command, as the model has it [m].
        nothing_less_constant: The same less a constant [m].
    """

    worst: str
    deviation: float
    less_constant: float
    nothing: float
    nothing_less_constant: float

    @classmethod
    def among(cls, before: Deviation, replays: Sequence[Replay]) -> WorstReplay | None:
        """Return the outlook; None where nothing was replayed.

        Args:
            before: Deviation under the uncorrected command.
            replays: Deviations under the command, of robots and under loads that differ.
        """
        if not replays:
            return None
        worst = max(replays, key=lambda replay: replay.deviation.maximum)
        return cls(
            worst=worst.name,
            deviation=worst.deviation.maximum,
            less_constant=max(replay.deviation.maximum_less_constant for replay in replays),
            nothing=before.maximum,
            nothing_less_constant=before.maximum_less_constant,
        )

    @computed_field  # type: ignore[prop-decorator]
    @property
    def gains(self) -> bool:
        """Whether the command is better than the uncorrected one in all replays.

        Less a constant as well: a command that takes off the robot's sag and shakes its tool is worse
        than an uncorrected one with the part touched off.
        """
        within = self.less_constant <= self.nothing_less_constant
        return within and self.deviation <= self.nothing

    @computed_field  # type: ignore[prop-decorator]
    @property
    def sentence(self) -> str:
        """What to expect, in a sentence."""
        figures = (
            f"up to {_um(self.deviation)} ({self.worst}), {_um(self.less_constant)} less a constant;"
            f" uncorrected {_um(self.nothing)}, {_um(self.nothing_less_constant)} less a constant"
        )
        if self.gains:
            return f"Expected deviation on a real robot: {figures}."
        return (
            "This command may be WORSE THAN NONE: with small errors of the robot's parameters or of the"
            f" force the deviation is {figures}. {self._advice}"
        )

    @property
    def _advice(self) -> str:
        if self.worst in ENDS_OF_RANGES:
            return (
                "Measure the gears' stiffness, which is that of a class (elastic-robot identify)."
            )
        return (
            "Measure the force and the gears' backlash more exactly, or place the part where no gear"
            " reverses (elastic-robot place)."
        )


def _um(length: float) -> str:
    return f"{1e6 * length:.4g} um"
