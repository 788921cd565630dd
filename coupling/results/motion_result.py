"""identified.json of a motion, what recordings tell of a robot."""

from __future__ import annotations

from coupling.results.base import ResultPart
from coupling.results.parameter_result import FitResult

# What has no link encoder has no figure.
Figures = tuple[float | None, ...]


class WindUpShareResult(ResultPart):
    """Share of a cause in motor less link over time, by joint with an encoder."""

    name: str
    wind_up: tuple[tuple[float, ...], ...]


class RecordingResult(ResultPart):
    """A recording, and what is left of it, by joint."""

    name: str
    held_out: bool
    rows: int
    wind_up_rad: Figures
    wind_up_without_lines_rad: Figures
    wind_up_lag_alone_rad: Figures
    torque_relative: Figures
    slow_torque_relative: Figures
    time: tuple[float, ...]
    measured_wind_up: tuple[tuple[float, ...], ...]
    left_wind_up: tuple[tuple[float, ...], ...]
    shares: tuple[WindUpShareResult, ...]
    measured_torque: tuple[tuple[float, ...], ...]
    left_torque: tuple[tuple[float, ...], ...]


class LinesResult(ResultPart):
    """Lines of an encoder."""

    joint: int
    periods: tuple[float, ...]


class MotionResult(FitResult):
    """Figures of an identification from motion; docs/motion.md says what they are."""

    what = "the figures of an identification from motion"

    converged: bool
    bandwidth_Hz: float
    noise_torque_Nm: tuple[float, ...]
    blocks: int
    remarks: tuple[str, ...]
    joints: tuple[int, ...]
    recordings: tuple[RecordingResult, ...]
    lines: tuple[LinesResult, ...]
    slow_error_rad: Figures
