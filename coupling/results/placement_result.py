"""place.json, the settings that a placement has found."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from coupling.results.base import From, ResultFile, ResultPart
from coupling.results.run_result import GearResult


class DemandsResult(ResultPart):
    """Demands of [place]."""

    joint_margin_rad: float
    least_conditioning: Annotated[float, From("conditioning")]
    clear_share: float


class SettingResult(ResultPart):
    """What one setting comes to."""

    sparse: ClassVar = ("file",)

    file: str | None = None
    setting: dict[str, float]
    admitted: bool
    cost_m: float | None
    moved_m: float
    exposure_m: float
    compliance_m_N: float
    conditioning: float
    limit_margin_rad: float | None
    rate_share: float
    motor_share: float = 0.0
    gears: tuple[GearResult, ...]


class MapResult(ResultPart):
    """A map in map.csv."""

    setting: Annotated[str, From("name")]
    across: str
    up: str
    shape: Annotated[tuple[int, int], From("deviation.shape")]


class PlacementResult(ResultFile):
    """Figures of a placement; docs/place.md says what they are."""

    what = "the figures of a placement"

    case: Annotated[str, From("case.name")]
    robot: Annotated[str, From("robot.name")]
    optimise: Annotated[str, From("goal.objective")]
    forced: Annotated[bool, From("goal.forced")]
    demands: Annotated[DemandsResult, From("goal.demands")]
    limited_joints: int
    ranges: dict[str, tuple[float, float]]
    free: tuple[str, ...]
    places_s: Annotated[tuple[float, ...], From("stations.time")]
    settings: Annotated[int, From("looked_at")]
    filling: Annotated[int, From("case.place.settings")]
    refused: dict[str, int]
    present_setting: dict[str, float]
    present: SettingResult | None
    best: Annotated[tuple[SettingResult, ...], Field(min_length=1)]
    maps: tuple[MapResult, ...]
    version: str

    @property
    def unknown(self) -> str:
        """What is taken to be off of the gears, in words."""
        slips = any(gear.hysteresis_30_percent_m is not None for gear in self.best[0].gears)
        return f"backlash 20 %{', hysteresis 30 %' if slips else ''} off"

    @property
    def named(self) -> list[tuple[str, SettingResult]]:
        """Settings by their names, the present one first where it can follow the path."""
        present = [] if self.present is None else [("as it is", self.present)]
        return present + [(str(setting.file), setting) for setting in self.best]
