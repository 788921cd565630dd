"""case.toml -> validated objects, ready to run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.case.place import PlaceTable
from coupling.case.plant import PlantTable, StudyTable
from coupling.case.robots import (
    ControllerTable,
    CouplingTable,
    DiscrepancyTable,
    PartTable,
    RobotTable,
    SupportTable,
    drive_of,
)
from coupling.case.stability import StabilityTable
from coupling.errors import CaseError, PlanningError, cause_of, locate_errors, one_of
from coupling.events import Watch, unwatched
from coupling.files.toml_file import Schema, load_toml, require_kind, validate
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.process import ProcessSchema
from coupling.process.authors_code import authors_code, find_process
from coupling.robot.differences import Plant
from coupling.robot.mounting import Mounting
from coupling.robot.touch_off import RestingRobot, TouchOff, UntouchableError
from coupling.solve import METHODS
from coupling.toolpaths import TOOL_PATHS
from coupling.toolpaths.instants import NO_CORNERS, Corners
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.task import Task
from coupling.toolpaths.tilt import APPROACH

_DEFAULT_METHOD = "inverse"
# Name of a file that says nothing of its case.
_ANY_CASE = "case"


class CaseFile(Schema):
    """The whole file; the tables of a tool path, a process and a method depend on their kind."""

    robot: RobotTable
    support: SupportTable | None = None
    part: PartTable
    tool_path: dict[str, Any]
    process: dict[str, Any]
    coupling: CouplingTable = CouplingTable()
    compensation: dict[str, Any] = {}
    controller: ControllerTable = ControllerTable()
    discrepancy: DiscrepancyTable | None = None
    plant: PlantTable | None = None
    study: StudyTable = StudyTable()
    place: PlaceTable = PlaceTable()
    stability: StabilityTable = StabilityTable()


class TouchOffError(CaseError):
    """A robot of a case cannot touch a point of the part.

    Attributes:
        robot: Name of the robot in the case.
        point: The point by its number, from 1.
    """

    def __init__(self, words: str, robot: str, point: int) -> None:
        super().__init__(words)
        self.robot, self.point = robot, point


def load_case(
    path: str | Path,
    workspace: Path | None = None,
    watch: Watch = unwatched,
    touches_off: bool = True,
) -> Case:
    """Read a case file (format: docs/case_file.md) and everything it names.

    Args:
        workspace: Folder for files that a process leaves; a new temporary one unless given.
        touches_off: Whether the part is touched off, where the case says so.

    Raises:
        CaseError: With file, table, key, what was expected and what was got; caused by a TouchOffError
            if a robot cannot touch the part.
    """
    path = Path(path)
    if path.is_dir():
        raise CaseError(f"{path}: expected a case file, got a folder: give the case.toml in it")
    data = load_toml(path, CaseError)
    require_kind(data, "case", path, CaseError)
    file = validate(data, CaseFile, CaseError, str(path), path.parent)
    tool_path = _variant(path, "tool_path", "kind", file.tool_path, TOOL_PATHS)
    compensation = {"method": _DEFAULT_METHOD, **file.compensation}
    method = _variant(path, "compensation", "method", compensation, METHODS)
    process_table = _process_table(path, file.process)
    with locate_errors(str(path), CaseError):
        task, corners = _task(tool_path, file.part.part(), process_table)
    robots = [_read_placed_robot("forming", file.robot, _tcp_shift(task, process_table), path)]
    if file.support is not None:
        robots.append(_read_placed_robot("support", file.support, np.zeros(3), path))
    if touches_off and len(file.part.touched):
        with locate_errors(f"{path}: part: touch_off", CaseError):
            part, robots = _touched_off(file, task, process_table, robots)
        with locate_errors(str(path), CaseError):
            task, corners = _task(tool_path, part, process_table)
    plant: Plant | None = None
    if file.plant is not None:
        with locate_errors(f"{path}: plant", CaseError):
            models = [
                (robot.description, robot.torque_curve, robot.drive, robot.mounting)
                for robot in robots
            ]
            plant = file.plant.plant(models, path.parent)
    with locate_errors(str(path), CaseError):
        if workspace is not None:
            task = replace(task, workspace=workspace)
        if file.support is not None:
            task = _with_support(task, file.support, process_table)
        motion, task = task.motion, replace(task.sampled, watch=watch)
        with authors_code(lambda what: CaseError(f"process: {what}")):
            process = process_table.process(task)
    coupling = file.coupling.resolved(process)
    if file.discrepancy is not None:
        with locate_errors(f"{path}: discrepancy", CaseError):
            robots = [_add_discrepancy(robots, file.discrepancy, motion.path)]
    tables = {
        "part": file.part,
        "tool_path": tool_path,
        "process": process_table,
        "coupling": coupling,
        "compensation": method,
        "controller": file.controller,
    }
    return Case(
        name=path.stem,
        title=_title(path),
        robots=tuple(robots),
        mode=file.robot.mode,
        fmu=file.robot.fmu,
        tool_path=tool_path,
        corners=corners,
        motion=motion,
        task=task,
        process=process,
        process_table=process_table,
        coupling=coupling,
        method=method,
        controller=file.controller.controller(),
        discrepancy=file.discrepancy,
        plant=plant,
        study=file.study,
        place=file.place,
        stability=file.stability,
        resolved=_resolve(file, robots, tables, path.parent),
    )


def _title(path: Path) -> str:
    """Return what people call a case; `init` and runs name every file alike."""
    return (path.resolve().parent.name or path.stem) if path.stem == _ANY_CASE else path.stem


def _resolve(
    file: CaseFile, robots: list[PlacedRobot], tables: Mapping[str, Schema], folder: Path
) -> dict[str, Any]:
    """Return a case as plain data; optional tables are in it where the file says anything in them."""

    def data(table: Schema) -> dict[str, Any]:
        return table.model_dump(exclude_none=True, mode="json")

    resolved = {"robot": file.robot.resolved(folder, robots[0].drive)}
    if file.support is not None:
        resolved["support"] = file.support.resolved(folder, robots[1].drive)
    resolved |= {name: data(table) for name, table in tables.items()}
    for name in ("discrepancy", "plant", "study", "place", "stability"):
        table = getattr(file, name)
        if table != CaseFile.model_fields[name].default:
            resolved[name] = table.resolved(folder) if name == "plant" else data(table)
    return resolved


def _variant(
    path: Path, table: str, key: str, data: dict[str, Any], variants: Mapping[str, type[Schema]]
) -> Any:
    """Validate a table whose schema is chosen by one of its keys."""
    if key not in data:
        expected = ", ".join(variants)
        raise CaseError(f"{path}: {table}: key {key!r} is missing: expected one of {expected}")
    name = str(data[key])
    if name not in variants:
        raise CaseError(f"{path}: {table}: {key}: {one_of(variants, name)}")
    return validate(data, variants[name], CaseError, f"{path}: {table}", path.parent)


def _process_table(path: Path, data: dict[str, Any]) -> ProcessSchema:
    """Validate [process], whose schema is shipped or the user's own."""
    if "model" not in data:
        raise CaseError(f"{path}: process: key 'model' is missing")
    with locate_errors(f"{path}: process: model", CaseError):
        model, schema = find_process(str(data["model"]), path.parent)
    return validate({**data, "model": model}, schema, CaseError, f"{path}: process", path.parent)


def _task(
    tool_path: ToolPathTable, part: Frame, process_table: ProcessSchema
) -> tuple[Task, Corners]:
    """Return the task, with the point of a tool's sphere that is its TCP, and the corners.

    The process is evaluated where its force has corners, too.
    """
    diameter = process_table.forming_tool_diameter

    def task(corners: Corners) -> Task:
        untilted = tool_path.untilted(part, corners)
        tool_task = tool_path.task(part, corners, untilted)
        if diameter is None:
            return tool_task
        return untilted.on_sphere(tool_task, tool_path.tilt, 0.5 * diameter)

    task_of_part = task(NO_CORNERS)
    corners = process_table.corners(task_of_part)
    return (task(corners) if len(corners) else task_of_part), corners


def _tcp_shift(task: Task, process_table: ProcessSchema) -> np.ndarray:
    """Return from the tip of the tool to the TCP on or in its sphere, tool axes [m], (3,)."""
    diameter = process_table.forming_tool_diameter or 0.0
    return 0.5 * diameter * (task.contact - APPROACH)


def _read_placed_robot(
    name: str, table: RobotTable | SupportTable, tcp_shift: np.ndarray, path: Path
) -> PlacedRobot:
    """Read the robot that a table of a case describes."""
    with locate_errors(f"{path}: {'robot' if name == 'forming' else name}", CaseError):
        robot = table.robot(path.parent)
        provenance = table.provenance(path.parent, robot)
        drive = drive_of(robot, table.drive, provenance.servos_confirmed)
    at = table.world_from_base()
    mounting = Mounting(at.rotation, tcp_shift)
    home = np.deg2rad(table.home_deg)
    description, curve = mounting.of(robot), table.torque_curve
    return PlacedRobot(name, description, curve, home, at, mounting, drive, provenance=provenance)


def _touched_off(
    file: CaseFile, task: Task, process_table: ProcessSchema, robots: list[PlacedRobot]
) -> tuple[Frame, list[PlacedRobot]]:
    """Return the part where it really is, and the robots with what they then take for the world.

    The forming robot is commanded to the points as [part] has them, and where it rests with its sag the
    part is.  The second robot touches the same real points.  Tools are held as at the start of the path.
    """
    tools = [task.forming]
    if file.support is not None:
        tools.append(_with_support(task, file.support, process_table).desired.tools[1])
    part = task.part
    placed_robots: list[PlacedRobot] = []
    for robot, tool in zip(robots, tools, strict=True):
        points = part.points(file.part.touched)
        rotation = tool.rotations[0][0]
        resting = RestingRobot(
            robot.description, robot.torque_curve, robot.home, robot.world_from_base
        )
        try:
            with locate_errors(f"{robot.name} robot", PlanningError, CaseError):
                if not placed_robots:
                    touch_off = TouchOff.of(points, resting.tool_at(points, rotation))
                    part = touch_off.real_from_shown @ part
                else:
                    touch_off = TouchOff.of(resting.command_for(points, rotation), points)
        except CaseError as error:
            if (cause := cause_of(error, UntouchableError)) is None:
                raise
            raise TouchOffError(str(error), robot.name, cause.point) from cause
        placed_robots.append(replace(robot, touch_off=touch_off))
    return part, placed_robots


def _add_discrepancy(
    robots: list[PlacedRobot], table: DiscrepancyTable, desired: ToolPath
) -> PlacedRobot:
    """Return the only robot of a case with what it was measured to do beyond its model."""
    if len(robots) > 1:
        raise CaseError(
            "expected the case of one robot, got that of a cell of two: remove the table"
        )
    return replace(robots[0], discrepancy=table.along(desired))


def _with_support(task: Task, table: SupportTable, process_table: ProcessSchema) -> Task:
    """Return the task with a supporting tool, where the process knows two tools."""
    diameter = process_table.forming_tool_diameter
    if diameter is None:
        raise CaseError(
            "process: model: expected one for two tools with [support], as isf-force-law and"
            f" sheet-fem, got {process_table.model!r}"
        )
    return replace(task, support=table.support(task, diameter))
