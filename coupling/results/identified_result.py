"""identified.json: what deflections, frequency responses and milled slots tell."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from coupling.results.base import ResultPart
from coupling.results.modes_result import ResponseResult
from coupling.results.parameter_result import EvidenceResult, FitResult
from coupling.results.run_result import Three


class RmsResult(ResultPart):
    """Rms deflection [m], and what is left of it."""

    measured: float | None
    start: float | None
    fit: float | None
    left_out: float | None
    written: float | None

    @property
    def is_no_better(self) -> bool:
        """Whether the start predicts what was measured as well as the fit does rows left out."""
        return self.left_out is not None and self.start is not None and self.left_out >= self.start


class FurtherResult(EvidenceResult):
    """A parameter that the robot does not have, tested beside its own."""

    name: str
    unit: str
    value: float | None


class DirectionResult(ResultPart):
    """A change of parameters that hardly moves what was measured.

    Attributes:
        parts: Changes of the parameters over that of the first, the largest, (len(names),).
        index: Condition index: largest singular value over that of this direction; None, infinite, for
            one that the data do not see.
        in_words: The change, such as `joint[2] - 0.98 joint[3]`.
    """

    names: tuple[str, ...]
    parts: tuple[float, ...]
    index: float | None
    in_words: str


class AlikeResult(ResultPart):
    """Two parameters that look alike."""

    names: tuple[str, str]
    cosine: float


class CommonLossResult(ResultPart):
    """A deflection that is missing in every row, whatever its load: what friction takes.

    Attributes:
        value_m: The loss; negative where rows deflect by more, as with backlash.
        half_m: Half width of its 95 % interval.
    """

    value_m: float
    half_m: float
    probability: float


class LoopResult(ResultPart):
    """Rms errors of a loading loop [m], over all components of positions.

    Attributes:
        fit_m: Error that the fit leaves.
        left_out_m: Error under a fit of all other loops.
        without_hysteresis_m: Error under such a fit of a robot without hysteresis.
    """

    number: int
    fit_m: float | None
    left_out_m: float | None
    without_hysteresis_m: float | None


class MeasuredRowResult(ResultPart):
    """A measurement and what the robot predicts of it [m], [rad]."""

    name: str
    position_m: Three
    force_N: Three
    measured: list[float]
    predicted: list[float]
    left_out_error: list[float]
    weight: float


class IdentifiedResult(FitResult):
    """Figures of an identification; docs/identify.md says what they are."""

    what = "the figures of an identification"

    converged: bool
    reason: str
    rows: int
    rms_m: RmsResult
    residual_over_deviation: float | None
    further: tuple[FurtherResult, ...]
    condition: float | None
    without_effect: tuple[str, ...]
    unseen: tuple[DirectionResult, ...]
    weak: tuple[DirectionResult, ...]
    alike: tuple[AlikeResult, ...]
    common_loss: CommonLossResult | None
    warnings: tuple[str, ...]
    measurements: Annotated[tuple[MeasuredRowResult, ...], Field(min_length=1)]
    worst: tuple[str, ...]
    loops: tuple[LoopResult, ...] = ()

    def displacements(self, key: str) -> np.ndarray:
        """Return measured or predicted displacements or left-out errors of rows [m, rad], (k, r)."""
        return np.array([getattr(row, key) for row in self.measurements])


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


class LogErrorResult(ResultPart):
    """Median of |log(model / measurement)| [1]: 0.1 is a tenth in magnitude or 6 degrees in phase."""

    start: float
    fit: float
    written: float


class PostureResponseResult(ResultPart):
    """Responses in a posture."""

    name: str
    posture_deg: tuple[float, ...]
    held_out: bool
    unloaded_joints: tuple[int, ...]
    lowest_Hz: float
    highest_Hz: float
    error: LogErrorResult
    modes_Hz: tuple[float, ...]
    damping_ratios: tuple[float, ...]
    measured: tuple[ResponseResult, ...]
    start: tuple[ResponseResult, ...]
    written: tuple[ResponseResult, ...]


class ResponseFitResult(FitResult):
    """Figures of an identification from frequency responses; docs/modes.md says what they are."""

    what = "the figures of an identification from frequency responses"

    converged: bool
    error: LogErrorResult
    residual: float
    noise: float
    held_out: LogErrorResult | None
    postures: tuple[PostureResponseResult, ...]
