"""What programs are made of: a robot's command, of a run folder or of a table."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.case.file import load_case
from coupling.case.robots import drive_of
from coupling.errors import ProgramError
from coupling.export.frames import controller_from_base
from coupling.export.preconditions import (
    remark_on,
    remark_on_ends,
    require_poses,
    require_robots,
    require_same_robot,
)
from coupling.files.controller_axes import ControllerAxes, controller_axes
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


def command_of_table(file: Path, robot: str) -> tuple[RobotCommand, ...]:
    """Return the command of a table for a robot that stands as in its file, clock from zero.

    The base of the program is the controller's own robot frame, and nothing acts on the tool.
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
    command = RobotCommand(
        name=file.stem,
        placed=placed,
        joints=joints,
        wrench=WrenchHistory.none(instants),
        desired=None,
        part=controller_from_base(axes).inverse(),
        axes=axes,
        controller=controller,
        fmu=DEFAULT_KIND,
        remark=remark_on_ends(joints),
    )
    return (command,)


def _axes(case: Case, placed: PlacedRobot) -> ControllerAxes:
    file = find_robot(case.resolved[placed.table]["description"])
    return controller_axes(file, len(placed.description.joints))
