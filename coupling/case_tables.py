"""Tables of the case file that are the same in every case: robots, part, iteration."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError
from coupling.files.robot_file import Vector3
from coupling.files.toml_file import Positive, Schema, nearest
from coupling.fmu_export.build import KINDS
from coupling.process import Task
from coupling.robot.cell import Placement
from coupling.solve.fixed_point import Tolerance
from coupling.solve.mirror import METHODS, MirrorSettings
from coupling.solve.relaxation import SCHEMES
from coupling.toolpaths.part import Part
from coupling.toolpaths.support import STRATEGIES, Support, support_along
from elastic_robot.fmi.interface import MODES, Mode
from elastic_robot.torque_curves import TORQUE_CURVES


def _one_of(names: Iterable[str]) -> AfterValidator:
    """Refuse a text that is none of the names."""
    known = list(names)

    def check(value: str) -> str:
        if value not in known:
            raise ValueError(f"found {value!r}; {nearest(value, known)}")
        return value

    return AfterValidator(check)


class RobotTable(Schema):
    """[robot]: description (shipped name or path), torque_curve, mode, fmu, home_deg."""

    description: str
    torque_curve: Annotated[str, _one_of(TORQUE_CURVES)] = "backlash"
    mode: Annotated[Mode, _one_of(MODES)] = "quasistatic"
    fmu: Annotated[str, _one_of(KINDS)] = "python"
    home_deg: list[float]


class SupportTable(Schema):
    """[support]: a second robot with a supporting tool at the sheet's back.

    description, torque_curve and home_deg as in [robot]; base_position_m and base_rpy_deg place its
    base in the base of the first robot, which is the world frame of the cell.
    """

    description: str
    torque_curve: Annotated[str, _one_of(TORQUE_CURVES)] = "backlash"
    home_deg: list[float]
    base_position_m: Vector3
    base_rpy_deg: Vector3 = [0.0, 0.0, 0.0]
    strategy: Annotated[str, _one_of(STRATEGIES)] = "following"
    gap_m: Positive
    tool_diameter_m: Positive

    def placement(self) -> Placement:
        """Return where the robot stands."""
        rotation = Rotation.from_euler("xyz", self.base_rpy_deg, degrees=True)
        return Placement(np.array(self.base_position_m), rotation)

    def support(self, task: Task, forming_tool_diameter: float) -> Support:
        """Return what the supporting tool is to do along a task's path.

        Raises:
            CaseError: If it should stay at the rim of a wall that the path does not have.
        """
        if task.wall_angle is None and self.strategy == "fixed-height":
            raise CaseError(
                "support: strategy is 'fixed-height' and the tool path has no wall; needed is a cone"
                " or pyramid, or the strategy 'following'"
            )
        return support_along(
            self.strategy,
            task.part,
            task.desired,
            task.wall_angle or 0.0,
            self.gap_m,
            forming_tool_diameter,
            self.tool_diameter_m,
        )


class PartTable(Schema):
    """[part]: placement of the part frame in the robot's base."""

    position_m: Vector3
    rpy_deg: Vector3 = [0.0, 0.0, 0.0]

    def part(self) -> Part:
        """Return the placement; roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll)."""
        rotation = Rotation.from_euler("xyz", self.rpy_deg, degrees=True)
        return Part(np.array(self.position_m), rotation)


class CouplingTable(Schema):
    """[coupling]: scheme, its first relaxation, and when the iteration ends."""

    scheme: Annotated[str, _one_of(SCHEMES)] = "anderson"
    relaxation: Positive = 1.0
    tolerance_m: Positive = 1e-6
    rms_tolerance_m: Positive | None = None
    force_tolerance: Positive = 1e-3
    max_evaluations: Annotated[int, Field(ge=2)] = 40

    def tolerance(self) -> Tolerance:
        """Return the limits; the rms is half the maximum unless given."""
        rms = self.rms_tolerance_m or 0.5 * self.tolerance_m
        return Tolerance(self.tolerance_m, rms, self.force_tolerance)


class CompensationTable(Schema):
    """[compensation]: method and its settings."""

    method: Annotated[str, _one_of(METHODS)] = "mirror"
    tolerance_m: Positive = 1e-5
    gain: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    cutoff_Hz: Positive | None = None
    max_correction_rate_m_s: Positive = 0.05
    max_passes: Annotated[int, Field(ge=1)] = 12

    def settings(self) -> MirrorSettings:
        """Return the settings of the mirroring."""
        return MirrorSettings(
            self.tolerance_m,
            self.gain,
            self.cutoff_Hz,
            self.max_correction_rate_m_s,
            self.max_passes,
        )
