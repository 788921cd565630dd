"""Estimated parameters, and what tests say of one that a robot may be without."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Self

from coupling.results.base import ResultFile, ResultPart, finite

# What a robot file says beside a value that is not identified.
KEPT = "NOT IDENTIFIED, start value kept"


class EvidenceResult(ResultPart):
    """A parameter, or some together, beside a model without: F test and leave-one-out.

    Attributes:
        F: Fall of the squares for each parameter, over the variance.
        probability: Probability of an F as large by chance.
        left_out_change: Change of the leave-one-out root mean square with the parameter [1].
        left_out_change_without_worst: The same where the three rows that are predicted worst without it
            are left out of everything; None for too few rows, and for what is not supported.
        supported: Whether both tests support it.
        in_words: The verdict, or the reason for which it could not be tested.
    """

    F: float | None
    probability: float | None
    left_out_change: float | None
    left_out_change_without_worst: float | None
    supported: bool
    in_words: str


class ParameterResult(ResultPart):
    """An estimated parameter; None is infinite, not fitted, or not in the start or the new file.

    Attributes:
        start, value, written: Value in the start file, fitted value, value in the new file.
        identified: Whether the measurements identify it.
        added: Whether the start file does not have it.
        term: Term of the equations of motion; None where that does not matter.
        support: Tests of what a robot may be without; None for others.
    """

    sparse = ("term", "support")

    name: str
    unit: str
    start: float | None
    value: float | None
    low: float | None
    high: float | None
    written: float | None
    identified: bool
    reason: str
    added: bool = False
    term: str | None = None
    support: EvidenceResult | None = None

    @classmethod
    def judged(
        cls,
        name: str,
        unit: str,
        start: float | None,
        value: float,
        interval: Sequence[float],
        reason: str,
        **further: Any,
    ) -> Self:
        """Return the verdict: the value is written where it is identified, else the start's.

        Args:
            start: Value in the start file, in its unit; None where it has none.
            value: Fitted value, in its unit.
            interval: Ends of its 95 % interval, in its unit, infinite where nothing bounds it.
            reason: Reason why it is not identified; "" where it is.
            further: Other attributes, and `written` where another value is.

        Example:
            >>> name, unit, interval = "joint[1].damping", "N m s/rad", (1.0, math.inf)
            >>> kept = ParameterResult.judged(name, unit, 2.0, 3.0, interval, "hidden by noise")
            >>> kept.written, kept.high, kept.identified
            (2.0, None, False)
        """
        low, high = interval
        numbers: dict[str, Any] = {
            key: None if number is None else finite(number)
            for key, number in (("start", start), ("value", value), ("low", low), ("high", high))
        }
        written = numbers["start" if reason else "value"]
        verdict = {"written": written, "identified": not reason, "reason": reason}
        return cls(name=name, unit=unit, **{**numbers, **verdict, **further})

    @property
    def kind(self) -> str:
        """Kind of the parameter, the key of its row."""
        return self.name.rpartition(".")[2]

    @property
    def is_written(self) -> bool:
        """Whether the new file has another value than the start's, or the same confirmed."""
        return self.written is not None and (self.identified or self.written != self.start)

    @property
    def remark(self) -> str:
        """Comment beside it in a robot file: its interval, or why its start value is kept."""
        ends = ("no limit" if end is None else f"{end:.4g}" for end in (self.low, self.high))
        interval = f"95 %: {' to '.join(ends)}"
        if self.identified:
            return interval
        if self.is_written and not self.added:
            return f"best fit with the others, but {self.reason}; {interval}"
        return f"{KEPT}: {self.reason}"

    @property
    def bounds(self) -> tuple[float, float] | None:
        """Its interval where both ends bound it and are positive."""
        if self.low is None or self.high is None or not 0.0 < self.low <= self.high < math.inf:
            return None
        return self.low, self.high

    def contains(self, value: float) -> bool:
        """Return whether a value is in its interval."""
        return (self.low is None or self.low <= value) and (self.high is None or value <= self.high)


class FitResult(ResultFile):
    """Base of the figures of all fits.

    Attributes:
        refusal: Reason why no file should be written; "" where one may be.
        parameters: Verdict on each parameter.
    """

    refusal: str
    parameters: tuple[ParameterResult, ...]

    @property
    def identified(self) -> set[str]:
        """Names of the parameters that are identified."""
        return {parameter.name for parameter in self.parameters if parameter.identified}
