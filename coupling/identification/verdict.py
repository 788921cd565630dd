"""What a fit says of a parameter: its value, its 95 % interval, and whether it is identifiable."""

from __future__ import annotations

from dataclasses import dataclass

from scipy.stats import t as student

from coupling.robot.parameters import RobotParameter


@dataclass(frozen=True)
class ParameterVerdict:
    """A fitted parameter, and whether the measurements identify it.

    Attributes:
        parameter: The parameter, with its value in the start file.
        value: Fitted value [N m/rad, N m s/rad, rad, N m].
        low, high: Ends of the 95 % interval, in the same unit; infinite where nothing bounds it.
        reason: Why it is not identifiable, in words; "" where it is.
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
    def identifiable(self) -> bool:
        """Whether the measurements identify it."""
        return not self.reason


def quantile(freedom: float) -> float:
    """Return half a 95 % interval by the standard deviation, of Student's distribution.

    Args:
        freedom: Degrees of freedom, > 0; infinite for a normal one.
    """
    return float(student.ppf(0.975, freedom))
