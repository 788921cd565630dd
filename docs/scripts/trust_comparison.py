"""A comparison of the page on trust: a deviation, beside what it is a part of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from math import inf

# Largest deviation [%] for which a word stands.
GRADES = {"settled": 0.1, "good": 5.0, "rough": 25.0, "do not rely on it": inf}


class Against(Enum):
    """With what the model is compared."""

    PROGRAM = "another program: are the equations solved?"
    MEASUREMENT = "a measurement: is it true?"
    ROBOT = "a robot that is not as its file"


@dataclass(frozen=True)
class Comparison:
    """A deviation of the model.

    Attributes:
        what: In words, for the picture.
        against: Compared with what.
        deviation: Model less the other, or a distance of both.
        of: What is compared, in the same unit, > 0.
        words: Both with their unit.

    Example:
        >>> found = Comparison("force", Against.MEASUREMENT, -30.0, 1500.0, "-30 of 1500 N")
        >>> found.percent, found.verdict
        (2.0, 'good')
    """

    what: str
    against: Against
    deviation: float
    of: float
    words: str

    @property
    def percent(self) -> float:
        """Size of the deviation [% of what is compared]."""
        return 100.0 * abs(self.deviation) / self.of

    @property
    def beyond(self) -> str:
        """The deviation with its sign, in per cent."""
        return f"{100.0 * self.deviation / self.of:+.0f} %"

    @property
    def verdict(self) -> str:
        """In a word."""
        return next(word for word, most in GRADES.items() if self.percent <= most)

    def __str__(self) -> str:
        return f"{self.words} ({_rounded(self.percent)} %)"


def commanded(
    left: Mapping[str, tuple[str, float]], before: float, exact: str
) -> dict[str, Comparison]:
    """Return the entries of what a command leaves.

    Args:
        left: By name: the robot, in words, and the largest deviation on it [m].
        before: Largest deviation without the command [m].
        exact: Name of the robot that is as its file.
    """
    return {
        name: Comparison(
            f"command, {what}",
            Against.PROGRAM if name == exact else Against.ROBOT,
            value,
            before,
            f"{micrometres(value)} of {micrometres(before)} um",
        )
        for name, (what, value) in left.items()
    }


def micrometres(length: float) -> str:
    """Return a length [m] in words [um]."""
    return f"{1e6 * length:{'.1g' if length < 5e-8 else '.2g' if length < 1e-5 else '.0f'}}"


def _rounded(percent: float) -> str:
    if percent < 0.1:
        return f"{percent:.1g}"
    return f"{percent:.2g}" if percent < 10.0 else f"{percent:.0f}"
