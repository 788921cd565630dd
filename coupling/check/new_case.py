"""A folder with a case that runs as it stands: a process to begin with, a robot that reaches it."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import tomlkit
from tomlkit import TOMLDocument

from coupling import files
from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.check.new_robot import RobotChoice, new_robot
from coupling.check.typical_gears import HEAVY_SPINDLE
from coupling.errors import CaseError, PlanningError, one_of
from coupling.files.atomic_file import make_folder_of, write_atomically
from coupling.files.foreign_description import is_foreign
from coupling.files.robot_file import find_robot, load_robot, shipped_robots
from coupling.files.toml_file import document
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.robot.batch.part_placement import PartPlacement, part_placements
from coupling.robot.inverse_kinematics import InverseKinematics
from elastic_robot.description import Robot
from elastic_robot.errors import RobotFileError

CASE = "case.toml"
# Places that are tried with the whole path.
_MAX_CANDIDATES = 20
# Samples of it that are looked at: beside the corners a path is smooth.
_SAMPLES = 200


@dataclass(frozen=True)
class OwnFile:
    """A file of an example that its case needs and the user will replace.

    Attributes:
        name: Its name beside the new case.
    """

    example: str
    name: str
    key: str
    value: object


@dataclass(frozen=True)
class Start:
    """A process to begin with.

    Attributes:
        cell: Example with two robots; None where the process knows one tool alone.
    """

    case: str
    about: str
    cell: str | None = None
    files: tuple[OwnFile, ...] = field(default=())


STARTS = {
    "isf-force-law": Start("cone", "a cone formed in a sheet, force from a formula", "two_robots"),
    "sheet-fem": Start(
        "cone_fem",
        "a cone formed in a sheet, force from finite elements (pip install 'elastic-robot-fmu[fem]')",
        "two_robots_fem",
    ),
    "milling-force": Start("milling_20000", "a slot milled in aluminium, force of every tooth"),
    "external": Start(
        "external_template",
        "a program of your own, which reads path.csv and writes wrench.csv",
        files=(
            OwnFile(
                "process_template.py", "process.py", "command", ["{python}", "{case}/process.py"]
            ),
        ),
    ),
    "measured": Start(
        "measured_line",
        "a force measured along the path",
        files=(OwnFile("measured/line_force.csv", "force.csv", "file", "force.csv"),),
    ),
}


@dataclass(frozen=True)
class NewCase:
    """A case to be written.

    Attributes:
        remarks: Sentences on a robot file that was written for it.
    """

    texts: dict[str, str]
    about: str
    remarks: tuple[str, ...] = ()


def new_case(
    robot: str,
    process: str,
    two_robots: bool,
    folder: Path,
    choice: RobotChoice | None = None,
    tolerance_mm: float | None = None,
) -> NewCase:
    """Return a case with a robot and a process; part and home posture suit the robot.

    Args:
        robot: A shipped robot's name, whose file is copied, a robot file, which is named, or a robot as
            others describe it, for which one is written.
        choice: Links and gears of a robot that others describe; None: all is guessed.
        process: Name in `STARTS`.
        two_robots: A second robot of the same kind supports the sheet from behind.
        tolerance_mm: Deviation that the part allows [mm]; None: it is not stated.

    Raises:
        CaseError: If there is no such process, or none for two robots; or the tolerance is none.
        ElasticRobotError: If the robot file cannot be read.
        PlanningError: If the robot cannot follow the path of the example wherever it lies.
    """
    if process not in STARTS:
        raise CaseError(f"--process: {one_of(STARTS, process)}")
    if tolerance_mm is not None and not 0.0 < tolerance_mm < math.inf:
        raise CaseError(f"--tolerance-mm: expected a length > 0, got {tolerance_mm:g}")
    start = STARTS[process]
    choice = choice or RobotChoice()
    new_description = new_robot(robot, choice, folder) if is_foreign(robot) else None
    source = example(f"cases/{_example_name(start, process, two_robots)}.toml")
    shown = load_case(source)
    case, texts = document(source, CaseError), dict[str, str]()
    if new_description is None:
        file = find_robot(robot)
        described, name_in_case = load_robot(file), Path(os.path.relpath(file, folder)).as_posix()
        if robot in shipped_robots():
            name_in_case = file.name
            texts[name_in_case] = file.read_text(encoding="utf-8")
    else:
        name_in_case = new_description.file
        texts |= new_description.texts
        described = _load_unwritten(robot, name_in_case, texts, folder)
    tables = [placed.name.replace("forming", "robot") for placed in shown.robots]
    for table in tables:
        case[table]["description"] = name_in_case
        if any(joint.drive for joint in described.joints) and _has_confirmed_servos(texts):
            case[table]["drive"] = "servo"
    remarks: list[str] = []
    if process == "milling-force":
        case["part"]["touch_off"] = True
        if name_in_case in texts and choice.tip is None and _is_bare(texts[name_in_case]):
            spindle = HEAVY_SPINDLE if new_description is None else new_description.spindle
            texts[name_in_case] = spindle.on_flange(texts[name_in_case])
            described = _load_unwritten(robot, name_in_case, texts, folder)
            remarks.append(
                f"{name_in_case}: TCP and payload are those of a spindle of {spindle.mass:g} kg whose"
                f" tool ends {1e3 * spindle.reach:g} mm before the flange: give yours"
            )
    title = "by the elastic robot of the paper"
    if described != load_robot(find_robot(_NAME_IN_EXAMPLES)):
        title = f"by the robot {described.name}"
        try:
            _seat(case, shown, described, tables)
        except PlanningError as cause:
            if new_description is None:
                raise
            # The robot file is of use without a case.
            return NewCase(
                new_description.texts,
                "the robot file alone",
                (*new_description.remarks, f"No case: {cause}"),
            )
    if tolerance_mm is not None:
        case["part"]["tolerance_mm"] = tolerance_mm
    for own_file in start.files:
        texts[own_file.name] = example(own_file.example).read_text(encoding="utf-8")
        case["process"][own_file.key] = own_file.value
    head = f"# Made by elastic-robot init from the example {source.name}, for {robot}.\n#\n"
    text = head + tomlkit.dumps(case).replace("by the elastic robot of the paper", title)
    return NewCase(
        {CASE: text, **texts},
        start.about,
        (*remarks, *(() if new_description is None else new_description.remarks)),
    )


def _is_bare(text: str) -> bool:
    """Return whether a robot file's TCP is at its flange, so that it has no tool."""
    return not any(tomlkit.parse(text).get("tcp", {}).get("position", [0.0]))


def _has_confirmed_servos(texts: Mapping[str, str]) -> bool:
    """Return whether no robot file of a case says that its servos are not confirmed."""
    return all(tomlkit.parse(text).get("servos_confirmed", True) for text in texts.values())


def _load_unwritten(robot: str, name: str, texts: Mapping[str, str], folder: Path) -> Robot:
    """Return the robot of a file, by its name among the texts that are to be written into a folder."""
    content = tomlkit.parse(texts[name])
    urdf = content.get("urdf")
    if urdf is not None and urdf["file"] not in texts and "://" not in urdf["file"]:
        urdf["file"] = str((folder / urdf["file"]).resolve())
    with tempfile.TemporaryDirectory() as scratch:
        for file, text in {**texts, name: tomlkit.dumps(content)}.items():
            Path(scratch, file).write_text(text, encoding="utf-8")
        try:
            return load_robot(Path(scratch, name))
        except RobotFileError as cause:
            text = str(cause).replace(f"{scratch}{os.sep}", "")
            raise RobotFileError(f"{robot}: {text}") from cause


# Robot of the examples, for which they are as they stand.
_NAME_IN_EXAMPLES = "icme2008"


def example(name: str) -> Path:
    """Return an example's file.

    Args:
        name: Its place in the folder of examples, such as "cases/cone.toml".
    """
    package = Path(files.__path__[0])
    checkout = package.parents[1]
    here = checkout if (checkout / "pyproject.toml").is_file() else package
    return here / "examples" / name


def _example_name(start: Start, process: str, two_robots: bool) -> str:
    if not two_robots:
        return start.case
    if start.cell is None:
        names = ", ".join(name for name, other in STARTS.items() if other.cell)
        raise CaseError(f"--two-robots: expected a process for two tools, {names}, got {process!r}")
    return start.cell


def _seat(case: TOMLDocument, shown: Case, robot: Robot, tables: list[str]) -> None:
    """Put a case's part where the robot reaches it; a second robot stands opposite."""
    part = shown.task.part
    points = part.coordinates(shown.task.forming.position[0])
    base_from_tool = shown.task.forming.rotations[0][0]
    half_size = float(np.abs(points).max())
    for seat in part_placements(robot, base_from_tool, half_size, _MAX_CANDIDATES):
        home = np.round(np.rad2deg(seat.home), 1) + 0.0
        if not all(_follows(robot, np.deg2rad(home), path) for path in _shifted_paths(shown, seat)):
            continue
        for table in tables:
            case[table]["home_deg"] = home.tolist()
        case["part"]["position_m"] = seat.position.tolist()
        if "support" in tables:
            opposite = [2.0 * float(seat.position[0]), 0.0, 0.0]
            case["support"]["base_position_m"] = opposite
        return
    raise PlanningError(
        f"{robot.name}: expected a place for the part of the example, got none where the whole path"
        " can be followed: describe part and home posture yourself"
    )


def _shifted_paths(shown: Case, seat: PartPlacement) -> list[ToolPath]:
    """Return the paths of an example's tools with its part at a seat, each in its robot's base."""
    paths = []
    for table, path in zip(shown.robots, shown.desired.tools, strict=True):
        rows = np.unique(np.linspace(0, len(path.time) - 1, _SAMPLES).astype(int))
        shift = np.zeros(6)
        shift[:3] = seat.position - shown.task.part.position
        shifted = path.at_rows(rows).displaced(shift)
        if table.name == "support":
            # It stands on the other side of the part, turned by half a turn about the vertical.
            centre = [2.0 * seat.position[0], 0.0, 0.0]
            shifted = shifted.transformed(Frame.of_rpy(centre, [0.0, 0.0, np.pi]).inverse())
        paths.append(shifted)
    return paths


def _follows(robot: Robot, home: np.ndarray, path: ToolPath) -> bool:
    try:
        InverseKinematics(robot, home).plan(path)
    except PlanningError:
        return False
    return True


def write_case(case: NewCase, folder: Path) -> Path:
    """Write the files of a case into a folder, which is made; return the first, the case file.

    Raises:
        CaseError: If one of them is there already, or cannot be written.
    """
    for name in case.texts:
        if (folder / name).exists():
            raise CaseError(f"{folder / name}: expected a new file, got one that is there already")
    make_folder_of(folder / CASE, CaseError)
    for name, text in case.texts.items():
        write_atomically(folder / name, text, CaseError)
    return folder / next(iter(case.texts))
