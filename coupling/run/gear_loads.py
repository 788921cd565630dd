"""What the gears of a case's robots go through along its path, beside what the robots are rated for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from coupling.case.case import PlacedRobot
from coupling.files.provenance import Ratings
from coupling.inverse.diagnosis import diagnose
from coupling.inverse.inversion import DesiredMotion, MovingRobot
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.results.gear_result import GearDiagnosis
from coupling.results.limit_warning import LimitWarning
from coupling.robot.inverse_kinematics import InverseKinematics


def diagnose_robots(
    robots: Sequence[PlacedRobot],
    desired: ToolPath,
    wrench: WrenchHistory,
    rigid: JointPath | None = None,
) -> tuple[tuple[GearDiagnosis, ...], ...]:
    """Return what the gears of every robot go through with their tools on their paths.

    No run is needed: the wrench may be what the process answers to the desired path.

    Args:
        rigid: Joint angles with the undeflected tools on their paths; None: they are planned.
    """
    motions = wanted_of(robots, desired, wrench, rigid)
    return tuple(
        diagnose(MovingRobot(placed.description, placed.torque_curve), motion)
        for placed, motion in zip(robots, motions, strict=True)
    )


def wanted_of(
    robots: Sequence[PlacedRobot],
    desired: ToolPath,
    wrench: WrenchHistory,
    rigid: JointPath | None = None,
) -> tuple[DesiredMotion, ...]:
    """Return path, joint angles and wrench of every robot, axes of its base; as `diagnose_robots`."""
    motions = []
    joints_of = planned_joints(robots, desired) if rigid is None else rigid
    for placed, path, load, joints in zip(
        robots, desired.tools, wrench.tools, joints_of.robots, strict=True
    ):
        to_base = placed.world_from_base.inverse()
        motions.append(DesiredMotion(path.transformed(to_base), joints, load.transformed(to_base)))
    return tuple(motions)


def planned_joints(robots: Sequence[PlacedRobot], desired: ToolPath) -> JointPath:
    """Return the joint angles of all robots with the undeflected tools on their paths.

    Raises:
        UnreachableError: If a robot cannot follow its path.
    """
    return JointPath.of_robots(
        [
            InverseKinematics(placed.description, placed.home).plan(
                path.transformed(placed.world_from_base.inverse())
            )
            for placed, path in zip(robots, desired.tools, strict=True)
        ]
    )


def at_samples(wrench: WrenchHistory, path: ToolPath, samples: ToolPath) -> WrenchHistory:
    """Return what acts on tools at some of their times, springs included.

    Args:
        path: Paths that they take, at the times of the wrenches.
    """
    return WrenchHistory(samples.time, wrench.on(path).at(samples.time))


def load_warnings(
    robots: Sequence[PlacedRobot],
    wrench: WrenchHistory,
    gears: Sequence[Sequence[GearDiagnosis]],
) -> tuple[LimitWarning, ...]:
    """Return one warning for each rated load and each gear's torque that is passed."""
    return tuple(
        warning
        for placed, load, gear_loads in zip(robots, wrench.tools, gears, strict=True)
        for warning in exceeded(
            placed.provenance.ratings, load, gear_loads, placed.name if len(robots) > 1 else ""
        )
    )


def exceeded(
    ratings: Ratings, wrench: WrenchHistory, gears: Sequence[GearDiagnosis], robot: str = ""
) -> Iterator[LimitWarning]:
    """Yield a warning for each rating of one robot that is passed."""
    force = np.linalg.norm(wrench.force[0], axis=1)
    worst = int(force.argmax())
    if ratings.payload is not None and force[worst] > ratings.payload:
        time = float(wrench.time[worst])
        yield LimitWarning.of("payload", float(force[worst]), ratings.payload, time, robot=robot)
    for gear in gears:
        at = gear.torque_time, gear.joint, robot
        effort = ratings.efforts.get(gear.joint)
        if effort is not None and gear.torque > effort:
            yield LimitWarning.of("effort", gear.torque, effort, *at)
        rated = ratings.gears.get(gear.joint)
        if rated is None:
            continue
        # The graver of both is the one that is said.
        limits = {"gear-torque-emergency": rated.emergency, "gear-torque-peak": rated.peak}
        for name, limit in limits.items():
            if limit is not None and gear.torque > limit:
                yield LimitWarning.of(name, gear.torque, limit, *at)
                break
