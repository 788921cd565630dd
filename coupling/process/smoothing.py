"""A process without the noise of its answers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coupling.path.histories import ToolPath
from coupling.path.noise import noise_level
from coupling.process.base import Process, ProcessResponse, ProcessWrapper
from coupling.process.noise_filter import AdaptiveLowPass, ForceFilter

# Noise below this part of the largest force is rounding, or the unevenness of a computed one.
_COUNTS = 1e-3


@dataclass(frozen=True)
class ForceNoise:
    """Noise in the forces of a process.

    Attributes:
        level: Standard deviation of white noise in them, (tools, 6) [N], [N m].
        filter: Filter that takes it off; None: nothing does.
        peak: Largest force [N].
    """

    level: np.ndarray
    filter: ForceFilter | None
    peak: float

    @property
    def significant(self) -> bool:
        """Whether there is so much of it that it counts."""
        return self.force > _COUNTS * self.peak

    @property
    def force(self) -> float:
        """The largest level of a force [N]."""
        return float(self.level[:, :3].max())

    @property
    def adaptive(self) -> bool:
        """Whether the filter follows from the noise."""
        return isinstance(self.filter, AdaptiveLowPass)

    @property
    def sentence(self) -> str:
        """The level and what is done about it."""
        what = f"of about {self.force:.3g} N" if self.significant else "that hardly counts"
        left = self.filter is None or (self.adaptive and not self.significant)
        done = "not filtered" if left else f"{self.filter}, without delay"
        return f"The forces of the process have noise {what}; they are {done}."


class SmoothedProcess(ProcessWrapper):
    """A process without the noise of its answers.

    Periodic answers are left as they are: what is fast in them is meant.

    Args:
        process: The process.
        filter_: Filter that takes the noise off; None leaves it.
    """

    def __init__(self, process: Process, filter_: ForceFilter | None) -> None:
        self.process, self._filter = process, filter_
        self.noise: ForceNoise | None = None

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return the process's answer to a path, its wrenches without their noise."""
        response = self.process.evaluate(path)
        if response.period is not None:
            return response
        wrench = response.wrench
        level = np.stack([noise_level(wrench.instants, own) for own in wrench.before])
        self.noise = ForceNoise(level, self._filter, wrench.peak_force)
        if self._filter is None:
            return response
        significant = level if self.noise.significant else np.zeros_like(level)
        return replace(response, wrench=self._filter.of(wrench, significant))
