"""Forming force of single point incremental forming from a force law, closed on the actual path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from coupling.errors import CaseError
from coupling.files.toml_file import Positive
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process.base import (
    MemorylessProcess,
    Process,
    ProcessResponse,
    ProcessSchema,
    WithIdentity,
)
from coupling.process.corners import level_crossings
from coupling.process.force_laws import ForceLaw
from coupling.toolpaths.instants import Corners
from coupling.toolpaths.support import SupportingTool
from coupling.toolpaths.task import Task

# Step-downs after which the force is steady.
_RAMP = 4.0


def scallop_height(step_down: float, wall_angle: float, tool_diameter: float) -> float:
    """Return the scallop height dh [m] that a step-down leaves on a wall.

    Solves dz = 2 sin(alpha) sqrt(dh (d - dh)) for the smaller dh [Aerens2010].

    Args:
        step_down: dz [m].
        wall_angle: alpha [rad].
        tool_diameter: d [m].

    Raises:
        ValueError: If the step is larger than the tool can leave.

    Example:
        >>> round(1e6 * scallop_height(1e-3, np.deg2rad(45.0), 10e-3), 3)  # um
        50.253
    """
    chord = step_down / (2.0 * np.sin(wall_angle))
    if chord > 0.5 * tool_diameter:
        raise ValueError(
            f"step-down {1e3 * step_down:.4g} mm is larger than a tool of {1e3 * tool_diameter:.4g} mm"
            f" can leave at {np.rad2deg(wall_angle):.4g} deg"
        )
    half = 0.5 * tool_diameter
    return float(half - np.sqrt(half**2 - chord**2))


def steady_force(
    tensile_strength: float,
    thickness: float,
    tool_diameter: float,
    scallop: float,
    wall_angle: float,
) -> tuple[float, float]:
    """Return the steady axial and radial forming force [N].

    F_z = 0.0716 R_m t^1.57 d^0.41 dh^0.09 alpha cos(alpha) with R_m in MPa, lengths in mm, alpha in
    degrees; F_r = F_z tan((alpha + beta)/2), cos(beta) = 1 - 2 dh/d [Aerens2010].

    Args:
        tensile_strength: R_m [Pa].
        thickness: t of the sheet [m].
        tool_diameter: d [m].
        scallop: dh [m].
        wall_angle: alpha [rad].

    Example:
        >>> scallop = scallop_height(1e-3, np.deg2rad(45.0), 10e-3)
        >>> axial, radial = steady_force(105e6, 1e-3, 10e-3, scallop, np.deg2rad(45.0))
        >>> round(axial)
        470
    """
    axial = (
        0.0716
        * (1e-6 * tensile_strength)
        * (1e3 * thickness) ** 1.57
        * (1e3 * tool_diameter) ** 0.41
        * (1e3 * scallop) ** 0.09
        * np.rad2deg(wall_angle)
        * np.cos(wall_angle)
    )
    contact = np.arccos(1.0 - 2.0 * scallop / tool_diameter)
    return float(axial), float(axial * np.tan(0.5 * (wall_angle + contact)))


@dataclass(frozen=True)
class IsfForceLaw(MemorylessProcess):
    """Steady forming force, raised where the actual tool goes deeper than the desired one.

    F = ramp(depth) max(0, F_s + k_p p) along d: away from the sheet (+z of the part) and radially
    towards its z axis, in the ratio of the steady forces.  p is how far the actual TCP is beyond
    the desired one against d.  The ramp rises linearly with the desired depth, from the sheet's
    plane over the first contours, where the force is not yet steady.

    Attributes:
        part: base_from_part.
        desired: Desired path of the tool.
        axial, radial: Steady force [N].
        penetration_stiffness: k_p [N/m].
        ramp_depth: Depth at which the force is steady [m].
        height: Height of the TCP above the lowest point of the tool, along the part's z axis [m].
    """

    part: Frame
    desired: ToolPath
    axial: float
    radial: float
    penetration_stiffness: float
    ramp_depth: float
    height: float = 0.0

    def law(self) -> ForceLaw:
        """Return the law; its force is zero in air moves."""
        constants = {
            "part_position": self.part.points(np.array([0.0, 0.0, self.height])),
            "base_from_part": self.part.rotation.as_matrix(),
            "axial": self.axial,
            "radial": self.radial,
            "penetration_stiffness": self.penetration_stiffness,
            "ramp_depth": self.ramp_depth,
        }
        desired = np.column_stack([self.desired.time, self.desired.position[0]])
        return ForceLaw("sheet_forming", constants, desired)


class IsfForceLawTable(ProcessSchema):
    """Keys of the material and the tool; see docs/case_file.md.

    wall_angle_deg and step_down_m are those of the tool path unless given here; ramp_depth_m is
    four step-downs unless given.  In a cell support_share is the share of the forming force that the
    supporting tool takes, and pinch_stiffness_N_m that of the sheet between both tools.
    """

    FORMULA: ClassVar[bool] = True
    # By 19 % it missed one measured force; on another sheet it may miss to the other side.
    FORCE_FACTORS: ClassVar[tuple[float, float] | None] = (0.81, 1.19)

    model: Literal["isf-force-law"]
    sheet_thickness_m: Positive
    tensile_strength_Pa: Positive
    tool_diameter_m: Positive
    penetration_stiffness_N_m: Annotated[float, Field(ge=0.0)]
    wall_angle_deg: Annotated[float, Field(gt=0.0, lt=90.0)] | None = None
    step_down_m: Positive | None = None
    ramp_depth_m: Positive | None = None
    support_share: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    pinch_stiffness_N_m: Annotated[float, Field(ge=0.0)] = 0.0

    @property
    def forming_tool_diameter(self) -> float:
        """Diameter of the forming tool's sphere [m]."""
        return self.tool_diameter_m

    def corners(self, task: Task) -> Corners:
        """Return the times at the sheet's plane, and at the depth from which the force is steady."""
        _, step_down = self._wall(task)
        levels = (task.height, task.height - self._ramp(step_down))
        return level_crossings(task.forming, task.part, levels)

    def process(self, task: Task) -> Process:
        """Return the force law for a task, of one tool or between two.

        Raises:
            CaseError: If wall angle or step-down are neither here nor in the tool path, the step is
                too large for the tool, or the share of a supporting tool is not given.
        """
        if task.support is None:
            return self._forming(task)
        if self.support_share is None:
            raise CaseError(
                "process: key support_share is missing: with [support], give the share of the forming"
                " force that the supporting tool takes, 0 to 1"
            )
        return DoubleSided(
            self._forming(task),
            task.support,
            self.support_share,
            self.pinch_stiffness_N_m,
            identity=self.identity(task),
        )

    def _wall(self, task: Task) -> tuple[float, float]:
        """Return wall angle [rad] and step-down [m]."""
        angle = task.wall_angle if self.wall_angle_deg is None else np.deg2rad(self.wall_angle_deg)
        step_down = task.step_down if self.step_down_m is None else self.step_down_m
        if angle is None or step_down is None:
            raise CaseError(
                "process: the tool path has no wall angle and step-down: give the keys"
                " wall_angle_deg and step_down_m"
            )
        return angle, step_down

    def _ramp(self, step_down: float) -> float:
        """Return the depth at which the force is steady [m]."""
        return self.ramp_depth_m or _RAMP * step_down

    def _forming(self, task: Task) -> IsfForceLaw:
        angle, step_down = self._wall(task)
        try:
            scallop = scallop_height(step_down, angle, self.tool_diameter_m)
        except ValueError as cause:
            raise CaseError(f"process: {cause}") from cause
        axial, radial = steady_force(
            self.tensile_strength_Pa, self.sheet_thickness_m, self.tool_diameter_m, scallop, angle
        )
        return IsfForceLaw(
            part=task.part,
            desired=task.forming,
            axial=axial,
            radial=radial,
            penetration_stiffness=self.penetration_stiffness_N_m,
            ramp_depth=self._ramp(step_down),
            height=task.height,
            identity=self.identity(task),
        )


@dataclass(frozen=True)
class DoubleSided(WithIdentity):
    """The forming force of a law, a share of it on the supporting tool, and what both pinch.

    S = max(0, s F + k c) acts on the supporting tool away from the sheet: F is the size of the forming
    force, c how much closer the tools are than commanded, across the sheet.  What S exceeds s F by,
    the pinch, presses the forming tool back as well; where F is zero the sheet is out of reach.

    Attributes:
        law: Forming force on the forming tool alone.
        support: Task of the supporting tool.
        share: s, from 0 to 1.
        stiffness: k, of the sheet between the tools [N/m].
    """

    law: Process
    support: SupportingTool
    share: float
    stiffness: float

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return the wrenches on both tools along their actual paths."""
        response = self.law.evaluate(path.tools[0])
        alone = response.wrench
        size = np.linalg.norm(alone.force[0], axis=1)
        support = self.support.at(path.time)
        closing = -support.opening(path)
        borne = np.maximum(self.share * size + self.stiffness * closing, 0.0) * (size > 0.0)
        pinch = borne - self.share * size
        wrench = np.concatenate([alone.wrench, np.zeros_like(alone.wrench)])
        wrench[0, :, :3] -= pinch[:, None] * support.direction
        wrench[1, :, :3] = borne[:, None] * support.direction
        return ProcessResponse(
            WrenchHistory(path.time, wrench),
            stiffness=self._stiffness(response, size, borne, support),
        )

    def _stiffness(
        self, alone: ProcessResponse, size: np.ndarray, borne: np.ndarray, support: SupportingTool
    ) -> np.ndarray | None:
        """Return the stiffness of both tools by both's displacements; None where the law has none.

        With n across the sheet, S = s |F| + k c and dc = n . (dx1 - dx2), where the tools pinch

            dF1 = dF - k dc n,  dF2 = (s d|F| + k dc) n,

        and the law's own dF where they do not: what it shares there is left out, as its reaction to
        the tool's own displacement would not be symmetric.
        """
        if alone.stiffness is None:
            return None
        law, force, normal = alone.stiffness, alone.wrench.force[0], support.direction
        along = np.divide(force, size[:, None], out=np.zeros_like(force), where=size[:, None] > 0.0)
        growth = np.einsum("ni,nij->nj", along, law)  # -d|F|/dx1
        shared = self.share * normal[:, :, None] * growth[:, None, :]
        pressed = (borne > 0.0)[:, None, None]
        pinch = pressed * self.stiffness * normal[:, :, None] * normal[:, None, :]
        forming = np.concatenate([law + pinch, -pinch], axis=2)
        supporting = np.concatenate([pressed * shared - pinch, pinch], axis=2)
        return np.concatenate([forming, supporting], axis=1)
