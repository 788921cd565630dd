"""identified.json of a motion, what recordings tell of a robot."""

from __future__ import annotations

from typing import Annotated

from coupling.results.base import From, ResultFile, ResultPart
from coupling.results.parameter_result import ParameterResult

# What has no link encoder has no figure.
Figures = tuple[float | None, ...]


class MotionParameterResult(ParameterResult):
    """A number of the robot or its encoders."""

    term: Annotated[str, From("parameter.term")]


class WindUpShareResult(ResultPart):
    """Share of a cause in motor less link over time, by joint with an encoder."""

    name: str
    wind_up: tuple[tuple[float, ...], ...]


class RecordingResult(ResultPart):
    """A recording, and what is left of it, by joint."""

    name: str
    held_out: bool
    rows: int
    wind_up_rad: Annotated[Figures, From("wind_up")]
    wind_up_without_lines_rad: Annotated[Figures, From("without_lines")]
    wind_up_lag_alone_rad: Annotated[Figures, From("lag_alone")]
    torque_relative: Annotated[Figures, From("torque")]
    slow_torque_relative: Annotated[Figures, From("slow_torque")]
    time: tuple[float, ...]
    measured_wind_up: tuple[tuple[float, ...], ...]
    left_wind_up: tuple[tuple[float, ...], ...]
    shares: tuple[WindUpShareResult, ...]
    measured_torque: tuple[tuple[float, ...], ...]
    left_torque: tuple[tuple[float, ...], ...]


class TermResult(ResultPart):
    """What is left of a joint of a recording that was held out, with and without a term."""

    term: str
    joint: int
    wind_up_rad: tuple[float | None, float | None]
    torque_relative: tuple[float, float]
    likelier: float | None = None


class LinesResult(ResultPart):
    """Lines of an encoder."""

    joint: int
    periods: tuple[float, ...]


class MotionResult(ResultFile):
    """Figures of an identification from motion; docs/motion.md says what they are."""

    what = "the figures of an identification from motion"

    refusal: str
    converged: bool
    bandwidth_Hz: float
    noise_torque_Nm: tuple[float, ...]
    blocks: int
    remarks: tuple[str, ...]
    joints: tuple[int, ...]
    parameters: tuple[MotionParameterResult, ...]
    recordings: tuple[RecordingResult, ...]
    lines: tuple[LinesResult, ...]
    slow_error_rad: Figures
    terms: tuple[TermResult, ...]
