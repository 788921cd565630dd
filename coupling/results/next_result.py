"""next.json, how the next command of a robot that was measured was found."""

from __future__ import annotations

from typing import Annotated

from coupling.results.base import From, ResultFile, ResultPart
from coupling.results.forecast import RunForecast
from coupling.results.learned_result import MeasuredRunResult
from coupling.results.run_result import Three


class SizeResult(ResultPart):
    """Size of a deviation [m] without noise, of which the faster part; doubt of its square [m^2]."""

    maximum: float
    rms: float
    maximum_less_constant: float
    rms_less_constant: float
    doubt: float
    fast: float


class NextRunResult(MeasuredRunResult):
    """A measured run that the next command follows from."""

    tip_m: Three
    noise_m: float
    left_out: int
    size_m: SizeResult
    forecast: RunForecast | None
    distance_m: list[float]


class JudgementResult(ResultPart):
    """The last measured run beside the best one, by their numbers from 0."""

    best: int
    last: int
    worse: bool
    again: bool


class MoveResult(ResultPart):
    """A way to the next command, and what it would have left of the last measured run."""

    kind: str
    robot: Annotated[str, From("model.name")]
    predicted: bool
    left_m: Annotated[SizeResult, From("size")]


class ContractionResult(ResultPart):
    """Gain and filter of learning along the path, and what they leave at worst."""

    gain: float
    cutoff: float
    learned: float
    everywhere: float
    worst_frequency: float
    lowest_mode: float
    robots: int
    holds: bool


class PathCorrectionResult(ResultPart):
    """What is corrected along the path."""

    cutoff_Hz: float
    weights: tuple[float, ...]
    new_m: float
    left_m: float
    time: list[float]
    deviation_m: list[list[float]]


class CauseResult(ResultPart):
    """What it may be that the model has not."""

    kind: str
    joint: int
    waves: float
    rms_m: Annotated[float, From("size")]
    text: Annotated[str, From("__str__")]


class NextResult(ResultFile):
    """Figures of a next command; docs/next.md says what they are."""

    what = "the figures of a next command"

    absolute: bool
    sentences: tuple[str, ...]
    runs: tuple[NextRunResult, ...]
    judgement: JudgementResult
    move: Annotated[str, From("move.kind")]
    robot: Annotated[str, From("move.model.name")]
    moves: tuple[MoveResult, ...]
    parameters_refused: str
    contraction: ContractionResult
    correction: PathCorrectionResult | None
    causes: tuple[CauseResult, ...]
    forecast: RunForecast | None
