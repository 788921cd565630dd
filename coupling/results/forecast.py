"""What a command is expected to leave on a robot that was measured."""

from __future__ import annotations

from pydantic import computed_field

from coupling.path.length_text import in_words
from coupling.results.base import ResultPart


class RunForecast(ResultPart):
    """Expected deviation of the next measured run [m], noise of the measurement taken off.

    Attributes:
        maximum: Upper end of the range of the largest distance: that of the rms, with the peaks of what
            was measured or of what the model expects, whichever is more peaked.
        absolute: Whether the constant counts; else all of it is less a constant, as the measuring frame
            is not known better.

    Example:
        >>> forecast = RunForecast(
        ...     rms=9e-5, low=7e-5, high=1.2e-4, maximum=4e-4, absolute=True, before=3e-4
        ... )
        >>> print(forecast.sentence.partition(", largest")[0])
        Expected deviation on your robot: 90.0 um rms (range 70.0 um to 0.120 mm)
    """

    rms: float
    low: float
    high: float
    maximum: float
    absolute: bool
    before: float

    @computed_field  # type: ignore[prop-decorator]
    @property
    def sentence(self) -> str:
        """What to expect, in a sentence."""
        constant = "" if self.absolute else " less a constant"
        return (
            f"Expected deviation on your robot: {in_words(self.rms)} rms{constant} (range"
            f" {in_words(self.low)} to {in_words(self.high)}),"
            f" largest up to about {in_words(self.maximum)}; measured under the last command:"
            f" {in_words(self.before)} rms"
        )
