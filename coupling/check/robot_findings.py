"""Findings on the robots of a case without a run: limits, clearance, gears and motors along the path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.check.clearance import Clearance, clearance_around
from coupling.errors import BuildError, HostError, SimulationError
from coupling.events import Watch, unwatched
from coupling.inverse.diagnosis import GearLoads, diagnosed, loads_along
from coupling.inverse.inversion import DesiredMotion, MovingRobot
from coupling.inverse.joint_limits import JointLimits
from coupling.inverse.links import rigid_motion
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.path.linear import arc_length, interpolate_rows
from coupling.results.drive_result import DriveMotion
from coupling.results.expected_deviation import ExpectedDeviation
from coupling.results.gear_result import GearDiagnosis
from coupling.results.limit_warning import LimitWarning
from coupling.results.replay import Replay
from coupling.results.run_result import ChainResult
from coupling.robot.simulated_model import SimulatedModel
from coupling.run.drive_motion import drive_motions
from coupling.run.exact_command import exact_command, expected_deviation, finely_sampled
from coupling.run.fmu_pool import FmuPool
from coupling.run.gear_loads import exceeded, wanted_of
from coupling.run.predicted_motor_torques import PredictedMotorTorque, predict_motor_torques
from coupling.run.robot_results import chain_of
from coupling.run.robustness import VARIATIONS
from elastic_robot.errors import RobotFileError

# Robots are simulated by the C core whatever the case's FMUs are: the model is the same, in a hundredth
# of the time.
_FMU_KIND = "native"
# Differences of gears that are looked at.
_GEARS = ("backlash", "hysteresis")


@dataclass(frozen=True)
class RobotFindings:
    """Findings on a robot of a case without a run.

    Attributes:
        path: Desired path of its tool, in its base.
        demands: Motion of the joints of the rigid robot along the path, beside their limits.
        motors: Torques of the motors along the path; none where no joint has one.
        backlash: Deviation under the exact command with another backlash in all gears; none where no
            gear has any.
        hysteresis: The same with other slip torques; None where no gear has elements.
        unknown: Reason why they are not known, or empty.
        warnings: Rated loads, gear and motor torques that are exceeded.
        expected: Deviation to expect of a corrected command; None where it is not known.
        joints: Motion of the joints of the rigid robot along the path.
        torque: Torques of its gears at rest [N m], at the times of `joints`, (n, joints).
    """

    name: str
    world_from_base: Frame
    path: ToolPath
    path_length: float
    demands: tuple[DriveMotion, ...]
    clearance: Clearance
    gears: tuple[GearDiagnosis, ...]
    motors: tuple[PredictedMotorTorque, ...]
    backlash: tuple[Replay, ...]
    hysteresis: tuple[Replay, ...] | None
    unknown: str
    warnings: tuple[LimitWarning, ...]
    expected: ExpectedDeviation | None
    chain: ChainResult
    joints: JointPath
    torque: np.ndarray


def examine_robots(
    case: Case,
    wrench: WrenchHistory,
    watch: Watch = unwatched,
    is_loaded: bool = False,
    rigid: JointPath | None = None,
) -> tuple[RobotFindings, ...]:
    """Return the findings on the robots of a case.

    Args:
        wrench: Wrenches on its tools along the desired path, world axes.
        is_loaded: Whether the wrenches are those of its process, so that it is known what to expect.
        rigid: Joint angles with the undeflected tools on their paths; None: they are planned.
    """
    robots = []
    with FmuPool(_FMU_KIND, watch) as models:
        for placed, motion in zip(
            case.robots, wanted_of(case.robots, case.desired, wrench, rigid), strict=True
        ):
            path, q = motion.path, motion.rigid.q[0]
            moving = MovingRobot(placed.description, placed.torque_curve)
            task = moving.task(motion)
            links = rigid_motion(moving.model, task)
            loads = loads_along(moving, links, task.wrench)
            gears, motors = diagnosed(moving, loads), predict_motor_torques(moving, links, loads)
            limits = JointLimits.of(placed.description, case.controller.max_acceleration)
            slips = any(joint.hysteresis for joint in moving.robot.joints)
            wrong, unknown = _gear_replays(moving, slips, models, motion, watch)
            backlash, hysteresis = (
                tuple(replay for replay in wrong if replay.name.startswith(kind))
                for kind in ("backlash", "hysteresis")
            )
            robots.append(
                RobotFindings(
                    placed.description.name,
                    placed.world_from_base,
                    path,
                    float(arc_length(path.position[0])[-1]),
                    drive_motions(motion.rigid, limits),
                    clearance_around(placed.description, path, q),
                    gears,
                    motors,
                    backlash,
                    hysteresis if slips else None,
                    unknown,
                    (
                        *exceeded(placed.provenance.ratings, motion.wrench, gears),
                        *(warning for replay in motors for warning in replay.warnings),
                    ),
                    _expected(case, placed, motion, watch) if is_loaded else None,
                    chain_of(placed.description, placed.world_from_base),
                    motion.rigid,
                    _torques(moving, loads, motion.rigid),
                )
            )
    return tuple(robots)


def _torques(moving: MovingRobot, loads: GearLoads, joints: JointPath) -> np.ndarray:
    """Return the torques of the gears at rest by joint, at the times of the joints' motion."""
    torque = np.zeros_like(joints.q[0])
    torque[:, moving.model.gear_joint] = interpolate_rows(joints.time, loads.time, loads.static)
    return torque


def _expected(
    case: Case, placed: PlacedRobot, motion: DesiredMotion, watch: Watch
) -> ExpectedDeviation | None:
    """Return the deviation to expect of one robot; None where it cannot be simulated."""
    try:
        return expected_deviation(placed, case.process_table.FORCE_FACTORS, motion, watch)
    except (BuildError, HostError, RobotFileError, SimulationError):
        return None


def _gear_replays(
    moving: MovingRobot, slips: bool, models: FmuPool, motion: DesiredMotion, watch: Watch
) -> tuple[tuple[Replay, ...], str]:
    """Return what an error of the gears leaves, or why it is not known, which keeps no other finding."""
    if not (slips or np.any(moving.backlash)):
        return (), ""
    try:
        model = models.of(moving.robot, moving.torque_curve)
        return gear_replays(moving, model, motion, watch), ""
    except (BuildError, HostError, RobotFileError, SimulationError) as error:
        return (), str(error)


def gear_replays(
    moving: MovingRobot, model: SimulatedModel, motion: DesiredMotion, watch: Watch
) -> tuple[Replay, ...]:
    """Return what robots with other gears leave, as `coupling.run.robustness` varies them.

    No formula of the gears alone tells that.  A gear that does not reverse is off by the error dB of its
    half width B, and one that changes it by 2 dB, as long as its link follows.  But in the backlash only
    the damper d holds the link.  An error dB that swings on the flank with omega leaves it with
    v = omega dB, which the damper takes off within I / d, over a way of

        v I / d = dB / (2 zeta),

    zeta being the damping ratio on the flank: many times dB, up to the other flank, 2 B away, and some
    more where it comes back from there.  So the moving robot is simulated, under `exact_command`: a
    second for half a minute of path.

    Args:
        motion: Path, joint angles of the undeflected robot along it and wrench on the tool.

    Returns:
        One for each variation of backlash and hysteresis, but for those that no gear has.
    """
    robots = [
        model.differing(variation.difference, variation.name)
        for variation in VARIATIONS
        if not variation.difference.amounts.keys().isdisjoint(_GEARS)
    ]
    robots = [robot for robot in robots if robot.robot is not model.robot]
    if not robots:
        return ()
    command = exact_command(moving, motion, watch)
    desired, loads = finely_sampled(motion)
    return tuple(
        Replay.of(robot.what, robot.simulate(command, loads, "dynamic"), desired)
        for robot in robots
    )
