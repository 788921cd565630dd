"""case.toml -> validated objects, ready to run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.case_tables import (
    CompensationTable,
    CouplingTable,
    PartTable,
    RobotTable,
    SupportTable,
)
from coupling.errors import CaseError
from coupling.files.robot_file import find_robot, load_robot
from coupling.files.toml_file import Schema, load_toml, nearest, validate
from coupling.path.histories import ToolPath
from coupling.process import Process, Task
from coupling.process.plugin import find_process
from coupling.robot.cell import Placement
from coupling.solve.relaxation import SCHEMES, Scheme
from coupling.toolpaths import TOOL_PATHS
from coupling.toolpaths.part import Part
from coupling.toolpaths.support import Support
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError


class _CaseFile(Schema):
    """The whole file; the tables of a tool path and a process depend on their kind."""

    robot: RobotTable
    support: SupportTable | None = None
    part: PartTable
    tool_path: dict[str, Any]
    process: dict[str, Any]
    coupling: CouplingTable = CouplingTable()
    compensation: CompensationTable = CompensationTable()


@dataclass(frozen=True)
class PlacedRobot:
    """A robot of a case.

    Attributes:
        name: "forming", or "support" for the second robot of a cell.
        description: The robot.
        torque_curve: "linear", "backlash" or "spline".
        home: Joint angles where inverse kinematics starts [rad].
        placement: Of its base in the world, which is the base of the first robot.
    """

    name: str
    description: Robot
    torque_curve: str
    home: np.ndarray
    placement: Placement


@dataclass(frozen=True)
class Case:
    """A validated case.

    Attributes:
        name: The file's name without ending.
        robots: One robot, or forming and supporting robot of a cell.
        settings: Table [robot].
        part: Placement of the part.
        desired: Desired tool path; in a cell, those of both tools.
        support: What the supporting tool is to do, in a cell.
        process: Process model.
        coupling: Table [coupling].
        compensation: Table [compensation].
        resolved: The case as plain data with every default filled in and paths absolute.
    """

    name: str
    robots: tuple[PlacedRobot, ...]
    settings: RobotTable
    part: Part
    desired: ToolPath
    support: Support | None
    process: Process
    coupling: CouplingTable
    compensation: CompensationTable
    resolved: dict[str, Any]

    @property
    def robot(self) -> Robot:
        """The robot that holds the tool; in a cell, the forming tool."""
        return self.robots[0].description

    @property
    def home(self) -> np.ndarray:
        """Its joint angles where inverse kinematics starts [rad]."""
        return self.robots[0].home

    def scheme(self) -> Scheme:
        """Return a new relaxation scheme."""
        return SCHEMES[self.coupling.scheme](self.coupling.relaxation)


def load_case(path: str | Path, workspace: Path | None = None) -> Case:
    """Read a case file (format: docs/case_file.md) and everything it names.

    Args:
        path: The file.
        workspace: Folder for files that a process leaves; a new temporary one unless given.

    Raises:
        CaseError: With file, table, key, value found and what is needed.
    """
    path = Path(path)
    data = load_toml(path, CaseError)
    file = validate(data, _CaseFile, CaseError, str(path))
    robots = [_placed_robot(path, "robot", file.robot, _AT_THE_ORIGIN)]
    if file.support is not None:
        robots.append(_placed_robot(path, "support", file.support, file.support.placement()))
    tool_path = _variant(path, "tool_path", "kind", file.tool_path, TOOL_PATHS)
    process_table = _process_table(path, file.process)
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
        if workspace is not None:
            task = replace(task, workspace=workspace)
        if file.support is None:
            support, process = None, process_table.process(task)
        else:
            support = _support(file.support, task, process_table)
            process = process_table.supported_process(task, support)
    except CaseError as cause:
        raise CaseError(f"{path}: {cause}") from cause
    resolved = file.model_dump(exclude_none=True)
    for table in ("robot", "support"):
        if table in resolved:
            description = resolved[table]["description"]
            resolved[table]["description"] = _resolved(description, path.parent)
    resolved["tool_path"] = tool_path.model_dump(exclude_none=True, mode="json")
    resolved["process"] = process_table.model_dump(exclude_none=True, mode="json")
    return Case(
        name=path.stem,
        robots=tuple(robots),
        settings=file.robot,
        part=part,
        desired=desired if support is None else ToolPath.of_tools([desired, support.desired]),
        support=support,
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
    return validate(data, known[data[key]], CaseError, f"{path}: {table}", path.parent)


def _process_table(path: Path, data: dict[str, Any]) -> Any:
    """Validate [process], whose schema is shipped or the user's own."""
    if "model" not in data:
        raise CaseError(f"{path}: process: key 'model' is missing; it is needed")
    try:
        model, schema = find_process(str(data["model"]), path.parent)
    except CaseError as cause:
        raise CaseError(f"{path}: process: model: {cause}") from cause
    return validate({**data, "model": model}, schema, CaseError, f"{path}: process", path.parent)


_AT_THE_ORIGIN = Placement(np.zeros(3), Rotation.identity())


def _placed_robot(
    path: Path, table: str, keys: RobotTable | SupportTable, placement: Placement
) -> PlacedRobot:
    """Read the robot that a table describes."""
    try:
        robot = load_robot(find_robot(keys.description, path.parent))
    except ElasticRobotError as cause:
        raise CaseError(f"{path}: {table}: description: {cause}") from cause
    if len(keys.home_deg) != len(robot.joints):
        raise CaseError(
            f"{path}: {table}: home_deg: found {len(keys.home_deg)} angles; needed are"
            f" {len(robot.joints)}, one for each joint"
        )
    name = "forming" if table == "robot" else table
    return PlacedRobot(name, robot, keys.torque_curve, np.deg2rad(keys.home_deg), placement)


def _resolved(description: str, folder: Path) -> str:
    """Return a shipped robot's name as it is, another one's file as an absolute path."""
    file = find_robot(description, folder)
    shipped = description == file.stem and "/" not in description
    return description if shipped else str(file.resolve())


def _support(table: SupportTable, task: Task, process_table: Any) -> Support:
    """Return what the supporting tool is to do, where the process knows two tools."""
    if not hasattr(process_table, "supported_process"):
        raise CaseError(
            f"process: model {process_table.model!r} knows one tool; needed with [support] is one"
            " that knows two, as isf-force-law and sheet-fem"
        )
    return table.support(task, process_table.tool_diameter_m)
