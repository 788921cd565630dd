"""What programs are made of: a robot's command, of a run folder or of a table."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.case.file import load_case
from coupling.case.robots import drive_of
from coupling.errors import ProgramError, locate_errors
from coupling.export.frames import controller_from_base
from coupling.export.preconditions import (
    remark_on,
    remark_on_ends,
    require_poses,
    require_robots,
    require_same_robot,
)
from coupling.files.controller_axes import ControllerAxes, controller_axes
from coupling.files.csv_table import WRENCH_COLUMNS, read_table
from coupling.files.provenance import load_provenance
from coupling.files.robot_file import find_robot, load_robot
from coupling.path.command_table import read_command
from coupling.path.controller import Controller
from coupling.path.frame import AT_THE_ORIGIN, Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.robot.mounting import AS_DESCRIBED
from coupling.robot.robot_fmu import DEFAULT_KIND
from coupling.run.stored_run import read_run

# The torque curve of a case that does not say another one.
_TORQUE_CURVE = "backlash"
# Longest command [s]; a mistaken unit would fill the memory with rows.
_MAX_DURATION = 20_000.0
# No controller's cycle is longer [s].
_LONGEST_CYCLE = 0.1
# Times closer to each other than this are one [s].
_SAME_TIME = 1e-6


@dataclass(frozen=True)
class RobotCommand:
    """The command of a robot, with what it needs to become a program and be judged.

    Attributes:
        wrench: Wrench on its tool, in the world.
        desired: Desired path of its tool at the wrench's instants, in the world; None where nobody
            knows.
        axes: Joint angles and frames of its controller.
        who: The robot, for messages; empty where there is one.
        remark: Remark on the command, or empty.
    """

    name: str
    placed: PlacedRobot
    joints: JointPath
    wrench: WrenchHistory
    desired: ToolPath | None
    part: Frame
    axes: ControllerAxes
    controller: Controller
    fmu: str
    who: str = ""
    remark: str = ""


def commands_of_run(folder: Path) -> tuple[RobotCommand, ...]:
    """Return the commands of a run's robots."""
    run, case = read_run(folder), load_case(folder / "case.toml")
    require_robots(folder, case, run)
    commands = []
    for placed in case.robots:
        stored = run.robots[placed.name]
        require_same_robot(folder, placed, stored)
        commands.append(
            RobotCommand(
                name=folder.resolve().name,
                placed=placed,
                joints=stored.joints,
                wrench=stored.wrench,
                desired=stored.desired,
                part=case.task.part,
                axes=_axes(case, placed),
                controller=case.controller,
                fmu=case.fmu,
                who=f"{placed.name} robot: " if len(case.robots) > 1 else "",
                remark=remark_on(stored),
            )
        )
    return tuple(commands)


def command_in_run(folder: Path, file: Path) -> tuple[RobotCommand, ...]:
    """Return the command of a table in place of a run's: one that was edited, or another program's.

    Robot, wrench, frames and desired path are the run's.

    Raises:
        CouplingError: As `commands_of_run`, or if the table is no command of the run's robot and time.
    """
    commands = commands_of_run(folder)
    if len(commands) > 1:
        raise ProgramError(
            f"{folder}: expected the run of one robot beside --command, got that of a cell of"
            f" {len(commands)}"
        )
    (command,) = commands
    table = read_command(file, len(command.placed.description.joints), ProgramError)
    start, end = float(command.joints.time[0]), float(command.wrench.time[-1])
    with locate_errors(str(file), ValueError, ProgramError):
        joints = replace(table.joints, time=_at(table.joints.time, (start, end)))
    latest = float(command.joints.time[-1]) + _last_cycle(joints)
    if joints.time[0] != start or not end <= joints.time[-1] <= latest:
        raise ProgramError(
            f"{file}: expected a command from {_span(command.joints)} as that of {folder}, whose wrench"
            f" it meets, got one from {_span(joints)}"
        )
    require_poses(file, command.placed, joints, table.poses)
    return (replace(command, name=file.stem, joints=joints, remark=remark_on_ends(joints)),)


def command_of_table(file: Path, robot: str, wrench: Path | None) -> tuple[RobotCommand, ...]:
    """Return the command of a table for a robot that stands as in its file, clock from zero.

    The base of the program is the controller's own robot frame.

    Args:
        wrench: Table of the wrench on the tool, in axes of the base; None: there is none.
    """
    described = find_robot(robot)
    description = load_robot(described)
    count = len(description.joints)
    table = read_command(file, count, ProgramError)
    start, length = table.joints.time[0], float(np.ptp(table.joints.time))
    if length > _MAX_DURATION:
        raise ProgramError(
            f"{file}: time: expected a command of at most {_MAX_DURATION:g} s, got one of {length:g} s:"
            " give seconds"
        )
    joints = replace(table.joints, time=table.joints.time - start)
    placed = PlacedRobot(
        name="forming",
        description=description,
        torque_curve=_TORQUE_CURVE,
        home=joints.q[0][0],
        world_from_base=AT_THE_ORIGIN,
        mounting=AS_DESCRIBED,
        provenance=load_provenance(described, description),
        drive=drive_of(description, None),
    )
    require_poses(file, placed, joints, table.poses)
    axes, controller = controller_axes(described, count), Controller()
    rows = controller.rows(0.0, length)
    instants = np.append(rows[rows < length - _SAME_TIME], length)
    none = WrenchHistory.none(instants)
    command = RobotCommand(
        name=file.stem,
        placed=placed,
        joints=joints,
        wrench=none
        if wrench is None
        else _find_wrench(wrench, start, instants, _last_cycle(joints)),
        desired=None,
        part=controller_from_base(axes).inverse(),
        axes=axes,
        controller=controller,
        fmu=DEFAULT_KIND,
        remark=remark_on_ends(joints),
    )
    return (command,)


def _find_wrench(file: Path, zero: float, instants: np.ndarray, cycle: float) -> WrenchHistory:
    """Return the wrench of a table at instants of a command, and at its own ones between them.

    Args:
        zero: Time in it that is zero of the command [s].
        instants: Rising from zero [s], (n,).
        cycle: Time before the command's end at which it may end, and is held [s].
    """
    rows = read_table(file, ("time", *WRENCH_COLUMNS), ProgramError)
    end = float(instants[-1])
    with locate_errors(str(file), ValueError, ProgramError):
        stated_loads = WrenchHistory(_at(rows[:, 0] - zero, (0.0, end)), rows[:, 1:])
    if stated_loads.time[0] > 0.0 or stated_loads.time[-1] < end - cycle:
        raise ProgramError(
            f"{file}: expected a wrench all along the command, from {zero:.9g} to {zero + end:.9g} s,"
            f" got one from {rows[0, 0]:.9g} to {rows[-1, 0]:.9g} s"
        )
    inside = (stated_loads.time >= 0.0) & (stated_loads.time <= end)
    first, last = (np.setdiff1d([t], stated_loads.time) for t in (0.0, end))
    during = WrenchHistory(
        np.concatenate([first, stated_loads.time[inside], last]),
        np.concatenate(
            [stated_loads.at(first), stated_loads.wrench[:, inside], stated_loads.at(last)], axis=1
        ),
    )
    load_instants = during.instants
    after = np.searchsorted(load_instants, instants)
    apart = load_instants[after] - instants, instants - np.append(-np.inf, load_instants)[after]
    return during.refined(np.union1d(load_instants, instants[np.minimum(*apart) > _SAME_TIME]))


def _axes(case: Case, placed: PlacedRobot) -> ControllerAxes:
    file = find_robot(case.resolved[placed.table]["description"])
    return controller_axes(file, len(placed.description.joints))


def _last_cycle(joints: JointPath) -> float:
    """Return by how much a command's last row may lie behind the end of what it is for [s]."""
    return min(float(joints.time[-1] - joints.time[-2]), _LONGEST_CYCLE) + _SAME_TIME


def _span(joints: JointPath) -> str:
    return f"{joints.time[0]:.9g} to {joints.time[-1]:.9g} s"


def _at(time: np.ndarray, ends: tuple[float, float]) -> np.ndarray:
    """Return times of which those that are ends but for rounding are these."""
    for end in ends:
        time = np.where(np.abs(time - end) <= _SAME_TIME, end, time)
    return time
