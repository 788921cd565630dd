"""Whether a process answers the same path alike, as the coupling needs it: noise, and memory."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, PrivateAttr

from coupling.path.histories import WrenchHistory
from coupling.results.base import ResultPart

# What rounding may change, such as sums of threads in another order, over the peak force.
_ROUNDING = 1e-6
# What keeps an iteration from ending, over the peak force: as much as its forces may change at the end.
_NOTICEABLE = 1e-3


class Repeatability(ResultPart):
    """Difference of two responses of a process to one path.

    Attributes:
        largest: Largest magnitude of the difference of the forces on a tool [N].
        rms: Root mean square of that magnitude over samples and tools [N].
        peak: Largest magnitude of the forces themselves [N].
    """

    largest: Annotated[float, Field(alias="largest_N")]
    rms: Annotated[float, Field(alias="rms_N")]
    peak: Annotated[float, Field(alias="peak_N")]

    @classmethod
    def of(cls, first: WrenchHistory, second: WrenchHistory) -> Repeatability:
        """Compare the wrenches of two answers to one path.

        Example:
            >>> time, up = np.array([0.0, 1.0]), np.array([[0.0, 0.0, 300.0]] * 2)
            >>> other = up + [[3.0, 0.0, 4.0], [0.0, 0.0, 0.0]]
            >>> Repeatability.of(*(WrenchHistory.of_forces(time, [f]) for f in (up, other))).largest
            5.0
        """
        distance = np.linalg.norm(second.force - first.force, axis=-1)
        return cls(
            largest=float(distance.max()),
            rms=float(np.sqrt(np.mean(distance**2))),
            peak=max(first.peak_force, second.peak_force),
        )

    @property
    def identical(self) -> bool:
        """Whether the answers are the same but for rounding."""
        return self.largest <= _ROUNDING * self.peak

    @property
    def disturbs(self) -> bool:
        """Whether the answers differ by so much that no iteration can end."""
        return self.largest > _NOTICEABLE * self.peak

    def sentence(self) -> str:
        """Return the difference in words, and what to do where the answers differ."""
        if self.identical:
            return "the process, evaluated twice on the same path, gave the same forces"
        return (
            f"the process gave different forces on the same path, by up to {self.largest:.3g} N"
            f" ({self.rms:.3g} N rms) of {self.peak:.3g} N: noise or memory, which no iteration can"
            " remove; make it repeatable (a fixed seed, a fresh start), average or filter it (cutoff_Hz)"
        )


class ForceNoise(ResultPart):
    """Noise in the forces of a process, and what is done about it.

    Attributes:
        force: Largest standard deviation of white noise in a force [N].
        cutoff: Lowest cutoff of the filter that takes it off [Hz]; None: nothing does.
        adaptive: Whether the filter follows from the noise.
        significant: Whether there is so much of it that it counts.
        sentence: Its level and what is done about it, in words.
    """

    force: Annotated[float, Field(alias="level_N")]
    cutoff: Annotated[float | None, Field(alias="cutoff_Hz")]
    adaptive: bool
    significant: Annotated[bool, Field(alias="counts")]
    sentence: str
    _level: np.ndarray | None = PrivateAttr(None)
    _is_unsure: bool = PrivateAttr(False)

    def with_level(self, level: np.ndarray, is_unsure: bool) -> ForceNoise:
        """Return it with what is not stored.

        Args:
            level: Standard deviation of white noise in the forces, (tools, 6) [N], [N m].
            is_unsure: Whether what a filter takes off may be none.
        """
        noise = self.model_copy()
        noise._level, noise._is_unsure = level, is_unsure
        return noise

    @property
    def level(self) -> np.ndarray:
        """Standard deviation of white noise in the forces, (tools, 6) [N, N m]; not stored."""
        assert self._level is not None  # as when read back
        return self._level

    @property
    def remarks(self) -> tuple[str, ...]:
        """The sentence, where there is something to do or to know."""
        return (self.sentence,) if self.significant or self._is_unsure else ()
