"""learned.json, what was learned of a robot."""

from __future__ import annotations

from coupling.results.base import ResultPart
from coupling.results.gear_result import GearDiagnosis
from coupling.results.parameter_result import FitResult, ParameterResult
from coupling.results.run_result import Three


class LeftResult(ResultPart):
    """Rms that is left [m]."""

    robot_file: float
    learned: float


class LearnedParameterResult(ParameterResult):
    """A parameter of the robot file, whose numbers are all known, and its factor against that.

    Attributes:
        factor, factor_low, factor_high: Fitted value and ends of its interval over that of the file.
        significant: Whether it moves the tool by more than is looked for.
        effect_m: Effect of its prior standard deviation on the tool along the runs measured, less a
            constant: rms of the slow part.
    """

    start: float
    value: float
    low: float
    high: float
    written: float
    factor: float
    factor_low: float
    factor_high: float
    significant: bool
    effect_m: float


class MeasuredRunResult(ResultPart):
    """A measured run, and what is drawn of it over its time."""

    run: str
    measured: str
    rows: int
    from_s: float
    to_s: float
    frame_shift_m: Three
    frame_turn_rad: Three
    clock_s: float
    time: list[float]


class LearnedRunResult(MeasuredRunResult):
    """A measured run that a robot was learned from."""

    orientation_noise_rad: float | None
    motors: dict[str, float] = {}
    left_robot_file_m: list[float]
    left_learned_m: list[float]


class LearnedResult(FitResult):
    """Figures of what was learned; docs/next.md says what they are."""

    what = "the figures of what was learned"

    robot: str
    converged: bool
    left_m: LeftResult
    noise_m: float
    noise_left_m: float
    widened: float
    warnings: list[str]
    slow_below_Hz: float
    parameters: tuple[LearnedParameterResult, ...]
    gears: tuple[GearDiagnosis, ...]
    runs: tuple[LearnedRunResult, ...]
