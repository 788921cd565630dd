"""Table [process] of a milling cut: cutter, stock, material, spindle."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from coupling.errors import CaseError, one_of
from coupling.files.toml_file import Positive
from coupling.process.base import ProcessSchema
from coupling.process.corners import level_crossings
from coupling.process.cutting_data import MATERIALS, CuttingData, of_kienzle
from coupling.process.cutting_force import Cutter, CuttingCoefficients
from coupling.process.engaged_arcs import ArcsOverTime, RemovedStock, StatedArcs
from coupling.process.milling_force import (
    FORCES,
    SAMPLES_PER_TOOTH,
    MeanForce,
    Milling,
    ToothPassing,
)
from coupling.process.stock import RawStock
from coupling.toolpaths.instants import Corners
from coupling.toolpaths.spindle import ProgrammedSpindle
from coupling.toolpaths.task import Task

# A sample is as long as it is stated, to so much of it.
_ROUNDED = 1e-6
# Speeds are one if they differ by less.
_SAME_SPEED = 1e-3
# A whole turn of pitch angles, to so much [deg].
_TURN, _ROUNDING = 360.0, 0.01
_COEFFICIENTS = ("K_tc_Pa", "K_rc_Pa", "K_ac_Pa", "K_te_N_m", "K_re_N_m", "K_ae_N_m")

# No material has a larger coefficient, in any unit.
Coefficient = Annotated[float, Field(ge=0.0, le=1e15)]
Corner = Annotated[list[float], Field(min_length=2, max_length=2)]


def _closes(angles: list[float]) -> list[float]:
    if abs(sum(angles) - _TURN) > _ROUNDING:
        raise ValueError(
            f"expected angles from each tooth to the next, 360 deg in all, got {sum(angles):g} deg"
        )
    return angles


class MillingForceTable(ProcessSchema):
    """Keys of cutter, stock, material and spindle; see docs/milling.md.

    force is "tooth-passing" (resolved in time) or "mean" (over a revolution); engagement is "stock",
    what the path meets of the stock that it removes, or stated for the whole path, "slot", "up" or
    "down", the latter two with radial_depth_m.
    """

    FORMULA: ClassVar[bool] = True
    # K_tc of 7075 by the sources of the review, over that of its first [MillingReview2021, table 5].
    FORCE_FACTORS: ClassVar[tuple[float, float] | None] = (0.78, 1.72)

    model: Literal["milling-force"]
    force: Literal["tooth-passing", "mean"] = "tooth-passing"
    cutter_diameter_m: Positive
    teeth: Annotated[int, Field(ge=1)]
    helix_deg: Annotated[float, Field(ge=0.0, lt=80.0)]
    pitch_deg: Annotated[list[Positive], Field(min_length=2), AfterValidator(_closes)] | None = None
    runout_m: Annotated[float, Field(ge=0.0)] = 0.0
    runout_deg: float = 0.0
    end_edge_m: Annotated[float, Field(ge=0.0)] | None = None
    spindle_speed_rpm: Positive | None = None
    spindle_max_rpm: Positive | None = None
    spindle_power_W: Positive | None = None
    spindle_torque_Nm: Positive | None = None
    engagement: Literal["stock", "slot", "up", "down"] = "stock"
    radial_depth_m: Positive | None = None
    surface_z_m: float = 0.0
    stock_m: Annotated[list[Corner], Field(min_length=2, max_length=2)] | None = None
    raster_m: Positive | None = None
    material: str | None = None
    kc11_Pa: Positive | None = None
    kienzle_exponent: Annotated[float, Field(ge=0.0, lt=1.0)] | None = None
    radial_ratio: Coefficient = 0.4
    axial_ratio: Coefficient = 0.2
    K_tc_Pa: Coefficient | None = None
    K_rc_Pa: Coefficient | None = None
    K_ac_Pa: Coefficient | None = None
    K_te_N_m: Coefficient | None = None
    K_re_N_m: Coefficient | None = None
    K_ae_N_m: Coefficient | None = None

    @model_validator(mode="after")
    def _teeth_fit(self) -> MillingForceTable:
        if self.pitch_deg is not None and len(self.pitch_deg) != self.teeth:
            raise ValueError(
                f"pitch_deg: expected {self.teeth} angles, one for each tooth, got"
                f" {len(self.pitch_deg)}"
            )
        if self.runout_m >= 0.5 * self.cutter_diameter_m:
            raise ValueError(
                f"runout_m: expected less than half of cutter_diameter_m, {self.cutter_diameter_m}, got"
                f" {self.runout_m}"
            )
        if self.end_edge_m is not None and self.end_edge_m > 0.5 * self.cutter_diameter_m:
            raise ValueError(
                f"end_edge_m: expected at most half of cutter_diameter_m, {self.cutter_diameter_m}, got"
                f" {self.end_edge_m}"
            )
        return self

    @model_validator(mode="after")
    def _radial_depth_fits(self) -> MillingForceTable:
        depth, diameter = self.radial_depth_m, self.cutter_diameter_m
        if (depth is not None) != (self.engagement in ("up", "down")):
            raise ValueError(
                "radial_depth_m: expected a depth for up and down, none for a slot or a stock, got"
                f" {'none' if depth is None else depth} for {self.engagement}"
            )
        if depth is not None and depth > diameter:
            raise ValueError(
                f"radial_depth_m: expected at most cutter_diameter_m, {diameter}, got {depth}"
            )
        return self

    @model_validator(mode="after")
    def _stock_fits(self) -> MillingForceTable:
        if self.stock_m is None:
            return self
        if self.engagement != "stock":
            raise ValueError(
                f"stock_m: expected none where engagement is stated, got one for {self.engagement}: take"
                " one of them out"
            )
        low, high = self.stock_m
        if not all(a < b for a, b in zip(low, high, strict=True)):
            raise ValueError(f"stock_m: expected [lowest, highest] corner, got {low}, {high}")
        return self

    @model_validator(mode="after")
    def _one_material(self) -> MillingForceTable:
        stated = [key for key in _COEFFICIENTS if getattr(self, key) is not None]
        sources = [
            key for key in ("material", "kc11_Pa") if getattr(self, key) is not None
        ] + stated[:1]
        if len(sources) != 1:
            got = " and ".join(sources) if sources else "none"
            raise ValueError(
                f"expected material, or kc11_Pa with kienzle_exponent, or {_COEFFICIENTS[0]} to"
                f" {_COEFFICIENTS[-1]}, got {got}: give one of them"
            )
        if self.material is not None and self.material not in MATERIALS:
            raise ValueError(f"material: {one_of(MATERIALS, self.material)}")
        missing = [key for key in _COEFFICIENTS if stated and key not in stated]
        if missing:
            raise ValueError(f"{missing[0]}: expected all six coefficients, got none of this name")
        if (self.kc11_Pa is None) != (self.kienzle_exponent is None):
            raise ValueError("expected kc11_Pa and kienzle_exponent, got one of them: give both")
        return self

    @property
    def cutting_data(self) -> CuttingData | None:
        """Data of a material that is named; None where coefficients are given."""
        return None if self.material is None else MATERIALS[self.material]

    def corners(self, task: Task) -> Corners:
        """Return the times at which the tool's tip crosses the raw surface."""
        return level_crossings(task.forming, task.part, (self.surface_z_m,))

    def process(self, task: Task) -> MeanForce | ToothPassing:
        """Return the milling force along a task's path.

        Raises:
            CaseError: If the path's samples are too far apart for its teeth, it never feeds, or its
                program has another spindle speed.
        """
        cutter = Cutter(
            radius=0.5 * self.cutter_diameter_m,
            teeth=self.teeth,
            helix=float(np.deg2rad(self.helix_deg)),
            speed=self._speed(task.spindle) * 2.0 * np.pi / 60.0,
            pitch=None if self.pitch_deg is None else tuple(np.deg2rad(self.pitch_deg).tolist()),
            runout=self.runout_m,
            runout_angle=float(np.deg2rad(self.runout_deg)),
        )
        longest = float(np.diff(task.desired.time).max())
        limit = cutter.tooth_period / SAMPLES_PER_TOOTH
        if self.force == "tooth-passing" and longest > (1.0 + _ROUNDED) * limit:
            raise CaseError(
                f"process: expected samples at most {1e3 * limit:.4g} ms apart, as a tooth passes"
                f" every {1e3 * cutter.tooth_period:.4g} ms, got {1e3 * longest:.4g} ms: lower"
                ' sample_s, or set force = "mean"'
            )
        tips = task.part.coordinates(task.forming.position[0])
        rates = np.linalg.norm(np.gradient(tips[:, :2], task.forming.time, axis=0), axis=1)
        if not np.any(rates > 1e-6):
            raise CaseError("process: the tool path never moves in the part's x-y plane")
        milling = Milling(
            part=task.part,
            desired=task.forming,
            cutter=cutter,
            coefficients=self._coefficients(rates, cutter.tooth_period),
            engaged=self._engaged(task),
            end_edge=self.end_edge_m or 0.0,
        )
        return FORCES[self.force](milling, identity=self.identity(task))

    def _engaged(self, task: Task) -> ArcsOverTime:
        """Return the arcs of the cutter along a task's path."""
        time, radius = task.forming.time, 0.5 * self.cutter_diameter_m
        tips = task.part.coordinates(task.forming.position[0])
        low, high = (None, None) if self.stock_m is None else map(np.array, self.stock_m)
        raw = RawStock(self.surface_z_m, low, high)
        removed = RemovedStock(time, tips, raw, radius, self.raster_m)
        if self.engagement == "stock":
            return removed
        width = np.clip((self.radial_depth_m or self.cutter_diameter_m) / radius, 0.0, 2.0)
        arc = float(np.arccos(1.0 - width))
        start, end = {"slot": (0.0, np.pi), "up": (0.0, arc), "down": (np.pi - arc, np.pi)}[
            self.engagement
        ]
        return StatedArcs(removed, start, end)

    def _speed(self, programmed: ProgrammedSpindle | None) -> float:
        """Return the speed of the spindle [1/min]: the case's, or the program's."""
        stated = self.spindle_speed_rpm
        if programmed is None:
            if stated is None:
                raise CaseError(
                    "process: spindle_speed_rpm: expected a speed, got none, and none in a program:"
                    " give it"
                )
            return stated
        if programmed.problems:
            raise CaseError(programmed.problems[0])
        (place, speed), *others = programmed.speeds
        if others:
            raise CaseError(
                f"process: expected one speed of the spindle in all cuts, got {speed:g} 1/min in {place}"
                f" and {others[0][1]:g} in {others[0][0]}: give each its own program"
            )
        if not speed > 0.0:
            raise CaseError(
                f"{place}: expected a speed of the spindle above 0 1/min, got {speed:g}"
            )
        if stated is not None and abs(stated - speed) > _SAME_SPEED * speed:
            raise CaseError(
                f"process: spindle_speed_rpm: expected {speed:g}, as {place} has it, got {stated:g}:"
                " change one of them, or leave the key out"
            )
        return speed

    def _coefficients(self, rates: np.ndarray, tooth_period: float) -> CuttingCoefficients:
        """Return the coefficients; Kienzle's at the mean chip of a slot at the path's usual feed."""
        if self.cutting_data is not None:
            return self.cutting_data.coefficients
        if self.kc11_Pa is not None and self.kienzle_exponent is not None:
            feed = float(np.median(rates[rates > 1e-6]))
            return of_kienzle(
                self.kc11_Pa,
                self.kienzle_exponent,
                self.radial_ratio,
                self.axial_ratio,
                2.0 / np.pi * feed * tooth_period,
            )
        return CuttingCoefficients(*(getattr(self, key) for key in _COEFFICIENTS))
