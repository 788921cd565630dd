"""What a command leaves on robots that differ from the model: expected, or by a sensitivity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from pydantic import computed_field

from coupling.path.deviation import Deviation
from coupling.path.length_text import in_words
from coupling.results.base import ResultPart
from coupling.results.replay import Replay, Worsening

# Percentiles between which a deviation is expected: of n robots the values of rank p n + 1/2 (Hazen), as
# far as there are any: the robots are spread evenly, so that each stands for an n-th of all of them.
_INTERVAL = (5.0, 95.0)
# Share of the robots that stay below what is expected.
EXPECTED_SHARE = 0.01 * _INTERVAL[1]
# Ranks at which a sample decides whether a command is worse than none: whether less a constant, and the
# share of the robots.
DECIDING_RANKS = ((False, 0.5), (True, 0.5), (False, EXPECTED_SHARE))

_ADVICE = (
    "Measure the force, the gears' stiffness (elastic-robot identify) and backlash more exactly, or"
    " place the part where no gear reverses (elastic-robot place)."
)


@dataclass(frozen=True)
class DrawnFrom:
    """What robots and forces are drawn from.

    Attributes:
        drawn: Ranges that are stated, in words.
        missing: Parameters without a range, which stay as in the model.
        is_whole: Whether the stiffness of every gear and the force have one.
    """

    drawn: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    is_whole: bool = False


@dataclass(frozen=True)
class DrawnReplays:
    """Replays of a command on robots that are drawn.

    Attributes:
        basis: Ranges and values that they are drawn from.
        stated: Replays on robots and under forces drawn from stated ranges.
        left_out: Replays on the model with the usual value of one thing that its file leaves out.
        completed: Replays on drawn robots that have the usual values of all of these.
    """

    basis: DrawnFrom = field(default_factory=DrawnFrom)
    stated: tuple[Replay, ...] = ()
    left_out: tuple[Replay, ...] = ()
    completed: tuple[Replay, ...] = ()

    @property
    def worst(self) -> Replay | None:
        """The drawn robot with the largest deviation, whose path was kept; None where none was drawn."""
        drawn = (*self.stated, *self.completed)
        return max(drawn, key=lambda replay: replay.deviation.maximum, default=None)


class DeviationInterval(ResultPart):
    """Interval of the deviations of a command on robots that are drawn.

    Attributes:
        samples: Number of robots.
        low, high: 5th and 95th percentile of the largest deviation [m].
        less_constant_low, less_constant_high: The same less a constant [m].
        uncorrected_high: 95th percentile under the uncorrected command [m]; None where not known.
    """

    sparse = ("uncorrected_high",)

    samples: int
    low: float
    high: float
    less_constant_low: float
    less_constant_high: float
    uncorrected_high: float | None = None

    @classmethod
    def around(cls, replays: Sequence[Replay]) -> DeviationInterval | None:
        """Return the interval; None where there are no replays."""
        if not replays:
            return None
        whole = [replay.deviation.maximum for replay in replays]
        less_constant = [replay.deviation.maximum_less_constant for replay in replays]
        uncorrected = [replay.uncorrected.maximum for replay in replays if replay.uncorrected]
        low, high = np.percentile(whole, _INTERVAL, method="hazen")
        less_low, less_high = np.percentile(less_constant, _INTERVAL, method="hazen")
        return cls(
            samples=len(replays),
            low=float(low),
            high=float(high),
            less_constant_low=float(less_low),
            less_constant_high=float(less_high),
            uncorrected_high=(
                float(np.percentile(uncorrected, _INTERVAL[1], method="hazen"))
                if len(uncorrected) == len(replays)
                else None
            ),
        )

    @property
    def share(self) -> float:
        """Share of all robots that lies between low and high."""
        ranks = [0.01 * percent * self.samples + 0.5 for percent in _INTERVAL]
        return (min(ranks[1], self.samples) - max(ranks[0], 1.0)) / self.samples

    @property
    def words(self) -> str:
        """Both intervals."""
        return (
            f"{in_words(self.low)} to {in_words(self.high)},"
            f" {in_words(self.less_constant_low)} to {in_words(self.less_constant_high)}"
            " less a constant"
        )

    @property
    def sampled(self) -> str:
        """Share of the robots in it, and their number."""
        return f"{100.0 * self.share:.0f} % of the robots, by {self.samples} of them"


class DrawnDeviation(DeviationInterval):
    """Deviations of a command on robots and under forces that are drawn from stated ranges.

    Attributes:
        drawn, missing, is_whole: As of `DrawnFrom`.
        left_out_m: Largest deviation on the model with the usual value of one thing that its file
            leaves out [m], by that value.
        with_left_out: Interval of robots that have the usual values of all of these; None where the file
            leaves nothing out.
    """

    drawn: tuple[str, ...]
    missing: tuple[str, ...]
    is_whole: bool
    left_out_m: dict[str, float] = {}
    with_left_out: DeviationInterval | None = None

    @classmethod
    def among(cls, replays: DrawnReplays) -> DrawnDeviation | None:
        """Return the intervals; None where nothing was drawn."""
        stated = DeviationInterval.around(replays.stated)
        if stated is None:
            return None
        basis = replays.basis
        return cls(
            **dict(stated),
            drawn=basis.drawn,
            missing=basis.missing,
            is_whole=basis.is_whole,
            left_out_m={replay.name: replay.deviation.maximum for replay in replays.left_out},
            with_left_out=DeviationInterval.around(replays.completed),
        )

    @property
    def sentence(self) -> str:
        """What is expected: the first figure has what a file leaves out; then what is not in it."""
        text = (
            "Expected deviation on a real robot"
            if self.is_whole
            else "Deviation on robots drawn in part, not what a real robot leaves"
        )
        stated = f"{self.words} ({self.sampled}, drawn from {' and '.join(self.drawn)})"
        if self.with_left_out is None:
            text += f": {stated}."
        else:
            values = ", ".join(
                f"{name} {in_words(deviation)}" for name, deviation in self.left_out_m.items()
            )
            text += (
                f": {self.with_left_out.words} with usual values of what the file leaves out"
                f" ({self.with_left_out.sampled}); by its stated ranges alone {stated}. Each usual value"
                f" alone, on the model: {values}."
            )
        return f"{text} Not in it: {'; '.join(self.missing)}." if self.missing else text


class WorstReplay(ResultPart):
    """The worst of all replays of a command, beside what the uncorrected one leaves.

    Attributes:
        worst: Difference from the model in the replay with the largest deviation.
        deviation: Largest deviation of all replays [m].
        less_constant: The same less a constant, of the replay in which this is largest [m].
        nothing: Largest deviation of the uncorrected command, as the model has it [m].
        nothing_less_constant: The same less a constant [m].
        expected: Deviations on robots that are drawn from stated ranges; None where none is stated.
        worse: Robot on which the command is worse than the uncorrected one, with a parameter that
            differs a little or as half of those that are drawn; None where there is none. A command that
            takes off the robot's sag and shakes its tool is worse less a constant, with the part touched
            off.
        may_be_worse: The same, of all but the last twentieth of those that are drawn.
        shift_alone: Robot with usual values of what its file leaves out on which a shift of the part
            does more than the command and such a shift; None where there is none.
    """

    worst: str
    deviation: float
    less_constant: float
    nothing: float
    nothing_less_constant: float
    expected: DrawnDeviation | None = None
    worse: Worsening | None = None
    may_be_worse: Worsening | None = None
    shift_alone: Worsening | None = None

    @classmethod
    def among(
        cls,
        before: Deviation,
        replays: Sequence[Replay],
        drawn: DrawnReplays | None = None,
    ) -> WorstReplay | None:
        """Return the outlook; None where nothing was replayed.

        Args:
            before: Deviation under the uncorrected command.
            replays: Deviations under the command, of robots and under loads that differ.
            drawn: Deviations on robots that are drawn.
        """
        if not replays:
            return None
        drawn = drawn or DrawnReplays()
        worst = max(replays, key=lambda replay: replay.deviation.maximum)
        # A robot has all that its file leaves out, not one thing of it.
        singles = (*replays, *(() if drawn.completed else drawn.left_out))
        samples = drawn.stated, drawn.completed
        return cls(
            worst=worst.name,
            deviation=worst.deviation.maximum,
            less_constant=max(replay.deviation.maximum_less_constant for replay in replays),
            nothing=before.maximum,
            nothing_less_constant=before.maximum_less_constant,
            expected=DrawnDeviation.among(drawn),
            worse=Worsening.worst(singles, samples, before, False)
            or Worsening.worst(replays, samples[:1], before, True),
            may_be_worse=Worsening.worst(singles, samples, before, False, EXPECTED_SHARE),
            shift_alone=Worsening.worst((), samples[1:], before, True),
        )

    @computed_field  # type: ignore[prop-decorator]
    @property
    def gains(self) -> bool:
        """Whether the command is better than none on all robots to be expected, also less a constant."""
        return self.worse is None and self.shift_alone is None

    @computed_field  # type: ignore[prop-decorator]
    @property
    def sentence(self) -> str:
        """What to expect, in a sentence."""
        figures = (
            f"up to {in_words(self.deviation)} ({self.worst}),"
            f" {in_words(self.less_constant)} less a constant; uncorrected"
            f" {in_words(self.nothing)}, {in_words(self.nothing_less_constant)} less a constant"
        )
        expected = "" if self.expected is None else f"{self.expected.sentence} "
        if self.worse is not None and not self.worse.is_shifted:
            return (
                f"This command may be WORSE THAN NONE: on the same robot ({self.worse.name}) it leaves"
                f" {in_words(self.worse.deviation)}, the uncorrected one"
                f" {in_words(self.worse.uncorrected)}. {_ADVICE} {expected}"
                f"Sensitivity to one parameter: {figures}."
            )
        shift = self.worse or self.shift_alone
        if shift is not None:
            return (
                f"A shift of the part alone does better: less a constant ({shift.name}) this command"
                f" leaves {in_words(shift.deviation)}, the uncorrected one"
                f" {in_words(shift.uncorrected)}. {_ADVICE} {expected}"
                f"Sensitivity to one parameter: {figures}."
            )
        if self.expected is not None:
            return f"{expected}Sensitivity to one parameter: {figures}."
        return (
            "Sensitivity to 2 % of stiffness, 5 % of force and the like, not what a real robot"
            f" leaves, as neither robot file nor process state a range: {figures}."
        )
