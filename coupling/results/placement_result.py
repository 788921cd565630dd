"""place.json, the settings that a placement has found."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

from pydantic import Field

from coupling.results.base import ResultFile, ResultPart, Unbounded
from coupling.results.cut_result import CutStability
from coupling.results.expected_deviation import ExpectedDeviation
from coupling.results.gear_result import GearDiagnosis


class DemandValues(ResultPart):
    """Constraints on a setting, the demands of [place].

    Attributes:
        conditioning: Smallest conditioning of the Jacobian, `FollowingRobot.conditioning` [1].
        clear_share: Share of a torque's range by which it stays clear of zero at least.
    """

    joint_margin: Annotated[float, Field(alias="joint_margin_rad")]
    conditioning: Annotated[float, Field(alias="least_conditioning")]
    clear_share: float


class SettingResult(ResultPart):
    """What one setting comes to."""

    sparse: ClassVar = ("file", "expected", "stability")

    file: str | None = None
    setting: dict[str, float]
    admitted: bool
    cost_m: Unbounded
    moved_m: float
    exposure_m: float
    expected: ExpectedDeviation | None = None
    compliance_m_N: float
    conditioning: float
    limit_margin_rad: Unbounded
    rate_share: float
    motor_share: float = 0.0
    gears: tuple[GearDiagnosis, ...]
    stability: CutStability | None = None

    def in_words(self, free: Sequence[str]) -> str:
        """Return the values of free variables in words."""
        words = []
        for name in free:
            key, unit = (
                (f"{name}_m", "m") if f"{name}_m" in self.setting else (f"{name}_deg", "deg")
            )
            words.append(f"{name.replace('_', ' ')} {round(self.setting[key], 4):g} {unit}")
        return ", ".join(words)


class MapAxes(ResultPart):
    """Axes of a map in map.csv, its rows and columns, and its setting of tool and base."""

    setting: str
    across: str
    up: str
    shape: tuple[int, int]

    @property
    def plane(self) -> tuple[str, str]:
        """Names of both axes."""
        return self.across, self.up


class PlacementResult(ResultFile):
    """Figures of a placement; docs/place.md says what they are."""

    what = "the figures of a placement"
    sparse: ClassVar = ("tolerance_m",)

    case: str
    robot: str
    tolerance_m: float | None = None
    optimise: str
    forced: bool
    demands: DemandValues
    limited_joints: int
    ranges: dict[str, tuple[float, float]]
    free: tuple[str, ...]
    places_s: tuple[float, ...]
    settings: int
    filling: int
    refused: dict[str, int]
    present_setting: dict[str, float]
    present: SettingResult | None
    best: Annotated[tuple[SettingResult, ...], Field(min_length=1)]
    maps: tuple[MapAxes, ...]
    version: str

    @property
    def unknown(self) -> str:
        """What is taken to be off of the gears, in words."""
        slips = any(gear.hysteresis_error is not None for gear in self.best[0].gears)
        return f"backlash 20 %{', hysteresis 30 %' if slips else ''} off"

    @property
    def settings_by_name(self) -> list[tuple[str, SettingResult]]:
        """Settings by their names, the present one first where it can follow the path."""
        present = [] if self.present is None else [("as it is", self.present)]
        return present + [(str(setting.file), setting) for setting in self.best]
