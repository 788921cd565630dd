"""Verdict on a fitted parameter: its value, its 95 % interval, and whether it is identifiable."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from scipy.special import stdtrit

from coupling.results.base import finite
from coupling.results.parameter_result import EvidenceResult, ParameterResult

# What a robot file says beside a value that is not identified.
KEPT = "NOT IDENTIFIED, start value kept"


class NamedParameter(Protocol):
    """A parameter with its value in the start file."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def value(self) -> float:
        """Value in the start file, in its unit."""

    @property
    def unit(self) -> str:
        """Its unit."""


Named = TypeVar("Named", bound=NamedParameter)


@dataclass(frozen=True)
class ParameterVerdict(Generic[Named]):
    """A fitted parameter, and whether the measurements identify it.

    Attributes:
        parameter: The parameter, with its value in the start file.
        value: Fitted value [N m/rad, N m s/rad, rad, N m].
        low, high: Ends of the 95 % interval, in the same unit; infinite where nothing bounds it.
        reason: Reason why it is not identifiable; "" where it is.
    """

    parameter: Named
    value: float
    low: float
    high: float
    reason: str

    @property
    def name(self) -> str:
        """Name of the parameter."""
        return self.parameter.name

    @property
    def unit(self) -> str:
        """Unit of all its values."""
        return self.parameter.unit

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

    def result(
        self,
        written: float | None,
        is_added: bool = False,
        term: str | None = None,
        support: EvidenceResult | None = None,
    ) -> ParameterResult:
        """Return what is stored of it.

        Args:
            written: Value in the robot file that is made, in its unit; None where that has none.
            is_added: Whether the start file does not have it.
            term: Term of the equations of motion; None where that does not matter.
            support: Tests of what a robot may be without; None for others.
        """
        return ParameterResult(
            name=self.name,
            unit=self.unit,
            start=None if is_added else finite(self.start),
            value=finite(self.value),
            low=finite(self.low),
            high=finite(self.high),
            written=None if written is None else finite(written),
            identified=self.identifiable,
            reason=self.reason,
            added=is_added,
            term=term,
            support=support,
        )


def interval_words(low: float | None, high: float | None) -> str:
    """Return a 95 % interval in words; None is no limit."""
    ends = ("no limit" if end is None else f"{end:.4g}" for end in (low, high))
    return f"95 %: {' to '.join(ends)}"


def quantile(freedom: float) -> float:
    """Return half a 95 % interval by the standard deviation, of Student's distribution.

    Args:
        freedom: Degrees of freedom, > 0; infinite for a normal one.
    """
    return float(stdtrit(freedom, 0.975))
