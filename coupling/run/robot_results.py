"""What a result tells of its robots beside the case: where their numbers come from, and their links."""

from __future__ import annotations

import warnings
from contextlib import suppress
from pathlib import Path

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.files.robot_file import find_robot, robot_numbers
from coupling.files.sources import Number, by_source
from coupling.path.frame import AT_THE_ORIGIN, Frame
from coupling.results.run_result import ChainResult, RobotResult, TouchOffResult, three
from coupling.robot.batch.rigid_robot import RigidRobot
from coupling.run.execute import Run
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError


def drawn_robots(case: Case, run: Run) -> tuple[RobotResult, ...]:
    """Return name, file, sources, links and touched-off part of the robots of a run.

    `links_m` is at the middle row of the command, base, centres of the joints and TCP in the world [m].
    """
    drawn = []
    for placed, joints in zip(case.robots, run.correction.joints.robots, strict=True):
        table = case.resolved[placed.table]
        numbers: list[Number] = []
        # The run rests on what was read at its start: a file that is gone meanwhile spoils no result.
        with suppress(ElasticRobotError):
            _, numbers = robot_numbers(find_robot(table["description"]))
        points = RigidRobot(placed.description).points(joints.q[0][len(joints.time) // 2])
        drawn.append(
            RobotResult(
                name=placed.name,
                title=placed.description.name,
                description=Path(table["description"]).name,
                torque_curve=placed.torque_curve,
                drive=placed.drive,
                sources=by_source(numbers),
                files={name: str(file) for name, file in placed.provenance.files.items()},
                stiffness_range_Nm_rad=placed.provenance.stiffness_range,
                touch_off=touch_off_of(case, placed),
                links_m=tuple(map(three, np.round(placed.world_from_base.points(points), 6))),
                chain=chain_of(placed.description, placed.world_from_base),
            )
        )
    return tuple(drawn)


def chain_of(robot: Robot, world_from_base: Frame = AT_THE_ORIGIN) -> ChainResult:
    """Return the joints of a robot, as pages draw them."""
    last_from_tool = Frame.of_rpy(robot.tcp_position, robot.tcp_rpy)
    return ChainResult(
        base_pose=world_from_base.pose,
        origins_m=tuple(three(np.array(joint.origin)) for joint in robot.joints),
        axes=tuple(three(np.array(joint.axis)) for joint in robot.joints),
        tool_pose=last_from_tool.pose,
    )


def touch_off_of(case: Case, placed: PlacedRobot) -> TouchOffResult | None:
    """Return where the part really is and how far a robot's own frame of it is off; None without."""
    touch_off, part = placed.touch_off, case.task.part
    if touch_off is None:
        return None
    with warnings.catch_warnings():
        # A part that stands upright has roll and yaw about one axis; any pair of them will do.
        warnings.simplefilter("ignore", UserWarning)
        rpy = part.rotation.as_euler("xyz", degrees=True)
    shown = touch_off.real_from_shown
    return TouchOffResult(
        part_position_m=three(part.position),
        part_rpy_deg=three(rpy),
        shift_m=three(part.position - shown.coordinates(part.position)),
        turn_rad=three(shown.rotation.as_rotvec()),
        residual_m=touch_off.residual,
    )
