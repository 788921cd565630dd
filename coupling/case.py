"""case.toml -> validated objects, ready to run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field
from scipy.spatial.transform import Rotation

from build_fmu import KINDS
from coupling.acceleration import SCHEMES, Scheme
from coupling.compensation import METHODS, MirrorSettings
from coupling.errors import CaseError
from coupling.iteration import Tolerance
from coupling.path import ToolPath
from coupling.process import PROCESSES, Process, Task
from coupling.toolpaths import TOOL_PATHS
from coupling.toolpaths.part import Part
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError
from elastic_robot.interface import MODES
from elastic_robot.robot_file import Vector3, find_robot, load_robot
from elastic_robot.toml_file import Positive, Schema, load_toml, nearest, validate
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
    mode: Annotated[str, _one_of(MODES)] = "quasistatic"
    fmu: Annotated[str, _one_of(KINDS)] = "python"
    home_deg: list[float]


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


class _CaseFile(Schema):
    """The whole file; the tables of a tool path and a process depend on their kind."""

    robot: RobotTable
    part: PartTable
    tool_path: dict[str, Any]
    process: dict[str, Any]
    coupling: CouplingTable = CouplingTable()
    compensation: CompensationTable = CompensationTable()


@dataclass(frozen=True)
class Case:
    """A validated case.

    Attributes:
        name: The file's name without ending.
        robot: The robot.
        settings: Table [robot].
        part: Placement of the part.
        desired: Desired tool path.
        process: Process model.
        coupling: Table [coupling].
        compensation: Table [compensation].
        resolved: The case as plain data with every default filled in and paths absolute.
    """

    name: str
    robot: Robot
    settings: RobotTable
    part: Part
    desired: ToolPath
    process: Process
    coupling: CouplingTable
    compensation: CompensationTable
    resolved: dict[str, Any]

    @property
    def home(self) -> np.ndarray:
        """Joint angles where inverse kinematics starts [rad]."""
        return np.deg2rad(self.settings.home_deg)

    def scheme(self) -> Scheme:
        """Return a new relaxation scheme."""
        return SCHEMES[self.coupling.scheme](self.coupling.relaxation)


def load_case(path: str | Path) -> Case:
    """Read a case file (format: docs/case_file.md) and everything it names.

    Raises:
        CaseError: With file, table, key, value found and what is needed.
    """
    path = Path(path)
    data = load_toml(path, CaseError)
    file = validate(data, _CaseFile, CaseError, str(path))
    try:
        robot_file = find_robot(file.robot.description, path.parent)
        robot = load_robot(robot_file)
    except ElasticRobotError as cause:
        raise CaseError(f"{path}: robot: description: {cause}") from cause
    if len(file.robot.home_deg) != len(robot.joints):
        raise CaseError(
            f"{path}: robot: home_deg: found {len(file.robot.home_deg)} angles; needed are"
            f" {len(robot.joints)}, one for each joint"
        )
    tool_path = _variant(path, "tool_path", "kind", file.tool_path, TOOL_PATHS)
    if hasattr(tool_path, "file"):
        tool_path = tool_path.model_copy(update={"file": (path.parent / tool_path.file).resolve()})
    process_table = _variant(path, "process", "model", file.process, PROCESSES)
    part = file.part.part()
    try:
        desired = tool_path.path(part)
        angle = getattr(tool_path, "wall_angle_deg", None)
        task = Task(
            part=part,
            desired=desired,
            wall_angle=None if angle is None else float(np.deg2rad(angle)),
            step_down=getattr(tool_path, "step_down_m", None),
        )
        process = process_table.process(task)
    except CaseError as cause:
        raise CaseError(f"{path}: {cause}") from cause
    resolved = file.model_dump(exclude_none=True)
    shipped = file.robot.description == robot_file.stem and "/" not in file.robot.description
    resolved["robot"]["description"] = (
        file.robot.description if shipped else str(robot_file.resolve())
    )
    resolved["tool_path"] = tool_path.model_dump(exclude_none=True, mode="json")
    resolved["process"] = process_table.model_dump(exclude_none=True, mode="json")
    return Case(
        name=path.stem,
        robot=robot,
        settings=file.robot,
        part=part,
        desired=desired,
        process=process,
        coupling=file.coupling,
        compensation=file.compensation,
        resolved=resolved,
    )


def _variant(path: Path, table: str, key: str, data: dict[str, Any], known: dict[str, Any]) -> Any:
    """Validate a table whose schema is chosen by one of its keys."""
    if key not in data:
        raise CaseError(f"{path}: {table}: key {key!r} is missing; known: {', '.join(known)}")
    if data[key] not in known:
        raise CaseError(
            f"{path}: {table}: {key}: found {data[key]!r}; {nearest(str(data[key]), list(known))}"
        )
    return validate(data, known[data[key]], CaseError, f"{path}: {table}")
