"""identified.json of frequency responses, what they tell of stiffness and damping."""

from __future__ import annotations

from coupling.results.base import ResultPart
from coupling.results.modes_result import ResponseResult
from coupling.results.parameter_result import FitResult


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
