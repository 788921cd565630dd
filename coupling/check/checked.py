"""A case looked at robot by robot, without a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.case import Case
from coupling.check.joints import JointDemand, joint_demands
from coupling.check.room import Room, room_around
from coupling.inverse.diagnosis import GearDiagnosis
from coupling.inverse.joint_limits import JointLimits
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.robot.cell import Placement
from coupling.robot.robot import LimitWarning
from coupling.run.gear_loads import diagnose_robot, wanted_of
from coupling.run.load_limits import passed


@dataclass(frozen=True)
class CheckedRobot:
    """What can be said of a robot of a case without a run.

    Attributes:
        name: Of the robot's description.
        placement: Place of its base in the world.
        path: Desired path of its tool, in its base.
        way: Length of the path [m].
        demands: What the path asks of the joints of the robot that does not give way.
        room: What is left around the path.
        gears: What the gears go through.
        warnings: Rated loads and gear torques that are passed.
    """

    name: str
    placement: Placement
    path: ToolPath
    way: float
    demands: tuple[JointDemand, ...]
    room: Room
    gears: tuple[GearDiagnosis, ...]
    warnings: tuple[LimitWarning, ...]


def checked(case: Case, wrench: WrenchHistory) -> tuple[CheckedRobot, ...]:
    """Return what can be said of the robots of a case.

    Args:
        case: The case.
        wrench: Wrenches on its tools along the desired path, world axes.

    Raises:
        PlanningError: If a robot cannot follow its path.
    """
    found = []
    for placed, wanted in zip(
        case.robots, wanted_of(case.robots, case.desired, wrench), strict=True
    ):
        path, q, gears = wanted.path, wanted.rigid.q[0], diagnose_robot(placed, wanted)
        limits = JointLimits.of(placed.description, case.controller.max_acceleration)
        found.append(
            CheckedRobot(
                placed.description.name,
                placed.placement,
                path,
                float(np.linalg.norm(np.diff(path.position[0], axis=0), axis=1).sum()),
                joint_demands(path.time, q, limits),
                room_around(placed.description, path, q),
                gears,
                tuple(passed(placed.ratings, wanted.wrench, gears)),
            )
        )
    return tuple(found)
