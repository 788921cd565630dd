"""Verdict on a fitted parameter: its value, its 95 % interval, and whether it is identifiable."""

from __future__ import annotations

from dataclasses import dataclass

from scipy.stats import t as student

from coupling.robot.parameters import RobotParameter

# What a robot file says beside a value that is not identified.
KEPT = "NOT IDENTIFIED, start value kept"


@dataclass(frozen=True)
class ParameterVerdict:
    """A fitted parameter, and whether the measurements identify it.

    Attributes:
        parameter: The parameter, with its value in the start file.
        value: Fitted value [N m/rad, N m s/rad, rad, N m].
        low, high: Ends of the 95 % interval, in the same unit; infinite where nothing bounds it.
        reason: Reason why it is not identifiable; "" where it is.
    """

    parameter: RobotParameter
    value: float
    low: float
    high: float
    reason: str

    @property
    def name(self) -> str:
        """Name in the FMU."""
        return self.parameter.name

    @property
    def start(self) -> float:
        """Value in the start file, in the same unit."""
        return self.parameter.value

    @property
    def remark(self) -> str:
        """Comment beside it in a robot file: its interval, or why its start value is kept."""
        if self.identifiable:
            return interval_words(self.low, self.high)
        return f"{KEPT}: {self.reason}"

    @property
    def identifiable(self) -> bool:
        """Whether the measurements identify it."""
        return not self.reason


def interval_words(low: float | None, high: float | None) -> str:
    """Return a 95 % interval in words; None is no limit."""
    ends = ("no limit" if own is None else f"{own:.4g}" for own in (low, high))
    return f"95 %: {' to '.join(ends)}"


def quantile(freedom: float) -> float:
    """Return half a 95 % interval by the standard deviation, of Student's distribution.

    Args:
        freedom: Degrees of freedom, > 0; infinite for a normal one.
    """
    return float(student.ppf(0.975, freedom))
