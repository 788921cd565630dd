"""What a command is expected to leave on a robot that was measured."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Forecast:
    """What the next pass is expected to leave [m], noise of the measurement taken off.

    Attributes:
        rms: Rms distance from the desired path.
        low, high: Interval that holds it in 90 of 100 passes.
        maximum: Largest distance.
        absolute: Whether the constant counts; else all of it is less a constant, as the measuring frame
            is not known better.
        before: Rms that was measured under the last command.
        robots: Factors of the robot file's parameters by name, of the robots that it is told by.
    """

    rms: float
    low: float
    high: float
    maximum: float
    absolute: bool
    before: float
    robots: tuple[dict[str, float], ...] = ()

    @property
    def sentence(self) -> str:
        """What to expect, in a sentence."""
        constant = "" if self.absolute else " less a constant"
        return (
            f"Expected on your robot: {_um(self.rms)} rms{constant} ({_um(self.low)} to {_um(self.high)}"
            f" in 90 of 100 passes), at most {_um(self.maximum)}; measured under the last command:"
            f" {_um(self.before)} rms"
        )

    def as_dict(self) -> dict[str, Any]:
        """Return its figures by name [m], with the sentence."""
        return {**asdict(self), "robots": list(self.robots), "sentence": self.sentence}

    @classmethod
    def from_dict(cls, figures: dict[str, Any]) -> Forecast:
        """Return what `as_dict` gave."""
        own = {name: figures[name] for name in cls.__dataclass_fields__}
        return cls(**own | {"robots": tuple(own["robots"])})


def _um(length: float) -> str:
    return f"{1e6 * length:.3g} um"
