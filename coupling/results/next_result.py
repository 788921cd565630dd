"""next.json, how the next command of a robot that was measured was found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from coupling.results.base import ResultFile, ResultPart
from coupling.results.forecast import RunForecast
from coupling.results.learned_result import MeasuredRunResult
from coupling.results.run_result import Three


@dataclass(frozen=True)
class DeviationSize:
    """Size of a deviation [m] without noise; what is faster than 15 Hz counts where it exceeds noise.

    Attributes:
        maximum_less_constant, rms_less_constant: The same less a constant.
        doubt: Standard deviation of the square of the rms, by the noise [m^2].
        fast: Rms of what is faster than 15 Hz and more than noise, which is part of the others; else 0.
    """

    maximum: float
    rms: float
    maximum_less_constant: float
    rms_less_constant: float
    doubt: float = 0.0
    fast: float = 0.0


@dataclass(frozen=True)
class LearningStep:
    """How the last run compares with the best one, and up to which frequency is learned.

    Attributes:
        base: Number of the last run or, if that is worse, of the best one, from 0.
        worse: Whether the last run left more than the best one, beyond chance.
        cutoff: Cutoff, at most that of the model [Hz].
    """

    base: int
    worse: bool
    cutoff: float


class NextRunResult(MeasuredRunResult):
    """A measured run that the next command follows from."""

    tip_m: Three
    noise_m: float
    left_out: int
    size_m: DeviationSize
    forecast: RunForecast | None
    distance_m: list[float]


class PathCorrectionResult(ResultPart):
    """Correction along the path."""

    cutoff_Hz: float
    gain: float
    time: list[float]
    deviation_m: list[list[float]]


class NextResult(ResultFile):
    """Figures of a next command; docs/next.md says what they are."""

    what = "the figures of a next command"
    sparse: ClassVar = ("tolerance_m",)

    absolute: bool
    tolerance_m: float | None = None
    warnings: tuple[str, ...] = ()
    sentences: tuple[str, ...]
    runs: tuple[NextRunResult, ...]
    step: LearningStep
    move: str
    robot: str
    parameters_refused: str
    lowest_mode_Hz: float | None
    correction: PathCorrectionResult | None
    forecast: RunForecast | None
