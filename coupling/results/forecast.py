"""What a command is expected to leave on a robot that was measured."""

from __future__ import annotations

from pydantic import computed_field

from coupling.path.length_text import format_um
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
        >>> print(forecast.sentence.partition(";")[0])
        Expected deviation on your robot: 90 um rms (range 70 um to 120 um), largest up to about 400 um
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
            f"Expected deviation on your robot: {format_um(self.rms)} um rms{constant} (range"
            f" {format_um(self.low)} um to {format_um(self.high)} um),"
            f" largest up to about {format_um(self.maximum)} um; measured under the last command:"
            f" {format_um(self.before)} um rms"
        )
