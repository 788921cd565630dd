"""Tables of the case file that are the same in every case: robots, part, iteration."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, field_validator

from coupling.errors import CaseError, locate_errors, one_of
from coupling.files.provenance import Provenance, load_provenance
from coupling.files.robot_file import find_robot, load_robot
from coupling.files.toml_file import FilePath, Positive, Schema, Vector3
from coupling.native.robot_text import require_native
from coupling.path.controller import INTERPOLATIONS, Controller, Interpolation
from coupling.path.discrepancy import Discrepancy
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.process.base import Process, marched
from coupling.robot.robot_fmu import DEFAULT_KIND, FMU_KINDS
from coupling.solve.fixed_point import Tolerance
from coupling.solve.scheme import Scheme
from coupling.solve.schemes import SCHEMES
from coupling.toolpaths.support import STRATEGIES, Pinch, SupportingTool, support_along
from coupling.toolpaths.task import Task
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError, RobotFileError
from elastic_robot.fmi.interface import IDEAL, MODES, Mode
from elastic_robot.torque_curves import TORQUE_CURVES

# Smallest extent of touched points across their longest one that fixes a frame, as a share.
_PLANE = 0.02


def _one_of(names: Iterable[str]) -> BeforeValidator:
    """Refuse what is none of the names."""
    allowed = list(names)

    def check(value: object) -> object:
        if value not in allowed:
            raise ValueError(one_of(allowed, value))
        return value

    return BeforeValidator(check, json_schema_input_type=Literal.__getitem__(tuple(allowed)))


OneOfCurves = Annotated[str, _one_of(TORQUE_CURVES)]
OneOfDrives = Literal["ideal", "servo"]


def read_described_robot(description: str, folder: Path) -> Robot:
    """Return the robot of a shipped name or a file, which is relative to a folder."""
    with locate_errors("description", ElasticRobotError, CaseError):
        return load_robot(find_robot(description, folder))


def drive_of(
    robot: Robot, requested: OneOfDrives | None, servos_confirmed: bool = True
) -> OneOfDrives:
    """Return how a robot's drives move: as asked for, else as its servos do where its file has them.

    Args:
        requested: Value in the case; None: none.
        servos_confirmed: Whether measurements confirm them; else drives are ideal unless asked for.

    Raises:
        CaseError: If it has no motors for servos.
    """
    motors = any(joint.drive is not None for joint in robot.joints)
    if requested == IDEAL or (requested is None and not (motors and servos_confirmed)):
        return IDEAL
    if not motors:
        raise CaseError(
            f'drive: expected a [joint.drive] in the file of {robot.name} beside "{requested}", got none'
        )
    return "servo"


def resolved_description(description: str, folder: Path) -> str:
    """Return a shipped robot's name, or the absolute path of a file of the user's."""
    file = find_robot(description, folder)
    shipped = description == file.stem and "/" not in description
    return description if shipped else str(file.resolve())


class _MemberTable(Schema):
    """Keys of every robot of a cell."""

    description: str
    torque_curve: OneOfCurves = "backlash"
    drive: OneOfDrives | None = None
    home_deg: list[float]

    def robot(self, folder: Path) -> Robot:
        """Return the description, whose file is relative to a folder.

        Raises:
            CaseError: If it cannot be read or has another number of joints than home_deg.
        """
        robot = read_described_robot(self.description, folder)
        if len(self.home_deg) != len(robot.joints):
            raise CaseError(
                f"home_deg: expected {len(robot.joints)} angles, one for each joint, got"
                f" {len(self.home_deg)}"
            )
        return robot

    def provenance(self, folder: Path, robot: Robot) -> Provenance:
        """Return where the numbers of the description are from; `robot` is the one that was read."""
        return load_provenance(find_robot(self.description, folder), robot)

    def resolved(self, folder: Path, drive: str) -> dict[str, Any]:
        """Return the table with a file of the user's as an absolute path, and how its drives move."""
        description = resolved_description(self.description, folder)
        return self.model_dump() | {"description": description, "drive": drive}


class RobotTable(_MemberTable):
    """[robot]: description (name or path), torque_curve, drive, mode, fmu, home_deg, base_rpy_deg.

    The world frame of a case has its origin in the base of this robot, and its axes before base_rpy_deg
    turns it against gravity.
    """

    mode: Annotated[Mode, _one_of(MODES)] = "dynamic"
    fmu: Annotated[str, _one_of(FMU_KINDS)] = DEFAULT_KIND
    base_rpy_deg: Vector3 = [0.0, 0.0, 0.0]

    def robot(self, folder: Path) -> Robot:
        """Return the description, as every robot's, no larger than the kind of its FMU holds."""
        robot = super().robot(folder)
        with locate_errors("description", RobotFileError, CaseError):
            if self.fmu == DEFAULT_KIND:
                require_native(robot)
        return robot

    def world_from_base(self) -> Frame:
        """Return the robot's frame: the world's."""
        return Frame.of_rpy([0.0, 0.0, 0.0], np.deg2rad(self.base_rpy_deg))


class SupportTable(_MemberTable):
    """[support]: a second robot with a supporting tool at the sheet's back.

    description, torque_curve, drive and home_deg as in [robot]; base_position_m and base_rpy_deg place
    its base in the world.
    """

    base_position_m: Vector3
    base_rpy_deg: Vector3 = [0.0, 0.0, 0.0]
    strategy: Annotated[str, _one_of(STRATEGIES)] = "following"
    gap_m: Positive
    tool_diameter_m: Positive

    def world_from_base(self) -> Frame:
        """Return the frame of the robot's base in the world."""
        return Frame.of_rpy(self.base_position_m, np.deg2rad(self.base_rpy_deg))

    def support(self, task: Task, forming_tool_diameter: float) -> SupportingTool:
        """Return the desired path of the supporting tool along a task's path."""
        if task.wall_angle is None and self.strategy == "fixed-height":
            raise CaseError(
                "support: strategy: expected 'following', as the tool path has no wall, got"
                " 'fixed-height': change it, or use a cone or pyramid"
            )
        pinch = Pinch(
            task.wall_angle or 0.0, self.gap_m, forming_tool_diameter, self.tool_diameter_m
        )
        return support_along(self.strategy, task.part, task.forming, task.height, pinch)


class PartTable(Schema):
    """[part]: placement of the part frame in the world, or of what the controller shows of it.

    Attributes:
        tolerance_mm: Deviation that the part allows of the tool's path; reports judge by it.
    """

    position_m: Vector3
    rpy_deg: Vector3 = [0.0, 0.0, 0.0]
    touch_off: bool | list[Vector3] = False
    tolerance_mm: Positive | None = None

    @field_validator("touch_off")
    @classmethod
    def _determines_a_frame(cls, value: bool | list[Vector3]) -> bool | list[Vector3]:
        if isinstance(value, bool) or len(value) == 1:
            return value
        points = np.array(value).reshape(-1, 3)
        extents = np.zeros(2)
        if len(points) > 2:
            extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if extents[0] == 0.0 or extents[1] < _PLANE * extents[0]:
            raise ValueError(
                f"expected true, one point or at least three that are not on a line, got"
                f" {len(points)}{' on a line' if len(points) > 2 else ''}: touch more points"
            )
        return value

    @property
    def touched(self) -> np.ndarray:
        """Points that are touched, in the part frame [m], (n, 3); none where nothing is."""
        if isinstance(self.touch_off, bool):
            return np.zeros((int(self.touch_off), 3))
        return np.array(self.touch_off)

    def part(self) -> Frame:
        """Return the placement."""
        return Frame.of_rpy(self.position_m, np.deg2rad(self.rpy_deg))


class CouplingTable(Schema):
    """[coupling]: scheme, its first relaxation, and when the iteration ends."""

    scheme: Annotated[str, _one_of(SCHEMES)] | None = None
    relaxation: Positive = 1.0
    tolerance_m: Positive = 1e-6
    rms_tolerance_m: Positive | None = None
    force_tolerance: Positive = 1e-3
    max_evaluations: Annotated[int, Field(ge=2)] = 40

    def resolved(self, process: Process) -> CouplingTable:
        """Return the table with the scheme that suits a process, where it names none."""
        usual = "robin" if marched(process) is None else "anderson"
        return self.model_copy(update={"scheme": self.scheme or usual})

    def new_scheme(self) -> Scheme:
        """Return a new relaxation scheme; call `resolved` before."""
        assert self.scheme is not None
        return SCHEMES[self.scheme](self.relaxation)

    def tolerance(self) -> Tolerance:
        """Return the limits; the rms is half the maximum unless given."""
        rms = self.rms_tolerance_m or 0.5 * self.tolerance_m
        return Tolerance(self.tolerance_m, rms, self.force_tolerance)


class ControllerTable(Schema):
    """[controller]: cycle_s, interpolation, max_acceleration_rad_s2 of what takes the command."""

    # No controller is faster or slower, and a mistaken unit would fill the memory with rows.
    cycle_s: Annotated[float, Field(ge=1e-4, le=1.0)] = 0.004
    interpolation: Annotated[Interpolation, _one_of(INTERPOLATIONS)] = "quintic"
    max_acceleration_rad_s2: Positive | None = None

    def controller(self) -> Controller:
        """Return the controller of the robots."""
        return Controller(self.cycle_s, self.interpolation, self.max_acceleration_rad_s2)


class DiscrepancyTable(Schema):
    """[discrepancy]: file, a table that elastic-robot next writes."""

    file: FilePath

    def along(self, desired: ToolPath) -> Discrepancy:
        """Return the discrepancy of a path, which has to be the one that was measured."""
        discrepancy = Discrepancy.read(self.file)
        with locate_errors(str(self.file), CaseError):
            discrepancy.require_along(desired)
        return discrepancy
