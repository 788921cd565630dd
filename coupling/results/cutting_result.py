"""What measured slots say of a material, an edge and a spindle."""

from __future__ import annotations

from typing import Literal

from coupling.results.base import ResultPart
from coupling.results.parameter_result import FitResult


class SlotPrediction(ResultPart):
    """A measured force at a feed, predicted by a fit of all slots and by one of the others."""

    feed_m_s: float
    quantity: Literal["mean", "once", "passing"]
    axis: Literal["across", "along", "axial"]
    measured_N: float
    fitted_N: float
    held_out_N: float | None


class CuttingIdentified(FitResult):
    """Figures of an identification from slots."""

    what = "the figures of an identification from slots"

    axes: tuple[str, str, str]
    shown: tuple[float, ...]
    edge_difference: float = 0.0
    roundness_m: float | None = None
    predictions: tuple[SlotPrediction, ...]
