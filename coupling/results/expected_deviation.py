"""Deviation to expect on a real robot: the one figure by which a tolerance is judged."""

from __future__ import annotations

from coupling.results.base import ResultPart
from coupling.results.outlook import DrawnDeviation


class ExpectedDeviation(ResultPart):
    """Largest deviation to expect on a real robot under a corrected command.

    Attributes:
        maximum: The deviation [m].
        is_whole: Whether all that may differ from the model is in it; else the real one may be larger.
        uncorrected: The same of the same robots under the uncorrected command [m]; None: not known.
    """

    sparse = ("uncorrected",)

    maximum: float
    is_whole: bool
    uncorrected: float | None = None

    @classmethod
    def among(
        cls, single: float, drawn: DrawnDeviation | None, further: float | None = None
    ) -> ExpectedDeviation:
        """Return that of robots drawn from what robot files state and leave out.

        It is no less than that by one thing that a file leaves out, or one parameter that differs a
        little.

        Args:
            single: Largest deviation on robots of which one parameter differs [m].
            drawn: Deviations on robots that are drawn; None where nothing has a range.
            further: The 95th percentile of more robots that are drawn alike, which then counts [m].
        """
        if drawn is None:
            return cls(maximum=single, is_whole=False)
        completed = drawn.with_left_out
        worst = drawn if completed is None or drawn.high >= completed.high else completed
        return cls(
            maximum=max(
                single,
                *drawn.left_out_m.values(),
                worst.high if further is None else further,
            ),
            is_whole=drawn.is_whole or completed is not None,
            uncorrected=worst.uncorrected_high,
        )

    def fits(self, tolerance: float) -> bool | None:
        """Return whether a tolerance [m] will be kept; None where that is open."""
        return (self.is_whole or None) if self.maximum <= tolerance else False
