"""What is written of every estimated parameter."""

from __future__ import annotations

from typing import Annotated

from coupling.results.base import From, ResultPart


class ParameterResult(ResultPart):
    """An estimated parameter; None is infinite, not fitted, or not in the start or the new file."""

    name: str
    unit: str
    start: float | None
    value: float | None
    low: float | None
    high: float | None
    written: float | None
    identified: Annotated[bool, From("identifiable")]
    reason: str
