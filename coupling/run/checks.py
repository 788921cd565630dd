"""The checks of every command: in the order in which they run, warn and stand in a page."""

from __future__ import annotations

from typing import Any

from coupling.results.run_result import RunResult
from coupling.results.section import Section
from coupling.run.check import Check
from coupling.run.cut_check import CUT_STABILITY
from coupling.run.drive_motion import DRIVE_MOTION
from coupling.run.expected_robots import DRAWN_ROBOTS
from coupling.run.gear_check import GEAR_LOADS
from coupling.run.path_checks import OTHER_MODE, TOOL_GAP, UNLOADED_PATHS
from coupling.run.plant import PLANT_REPLAY
from coupling.run.robustness import ROBUSTNESS
from coupling.run.sampling import SAMPLING
from coupling.run.simulated_motor_torques import MOTOR_TORQUES

CHECKS: tuple[Check[Any], ...] = (
    UNLOADED_PATHS,
    OTHER_MODE,
    ROBUSTNESS,
    DRAWN_ROBOTS,
    PLANT_REPLAY,
    MOTOR_TORQUES,
    CUT_STABILITY,
    GEAR_LOADS,
    SAMPLING,
    DRIVE_MOTION,
    TOOL_GAP,
)


def check_sections(figures: RunResult) -> list[Section]:
    """Return what the checks of a run say, of the content of its result.json."""
    return [section for check in CHECKS for section in check.sections(figures)]
