"""Noise in the forces of a process."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, PrivateAttr

from coupling.results.base import ResultPart


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
