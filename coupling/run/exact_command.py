"""The command that keeps a robot exactly on its path, for what is to be known before one is computed.

The motion of the links and the gears' own equation give it,

    q = phi - e,   d e' + S(e) = T(t),

without controller, limits of drives and polish, which are about micrometres.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coupling.case.case import PlacedRobot
from coupling.events import Progress, Watch, unwatched
from coupling.fmu.worker import WorkerProcesses
from coupling.inverse.inversion import DesiredMotion, MovingRobot, fine_times
from coupling.inverse.links import solve_links
from coupling.path.frame import AT_THE_ORIGIN
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from coupling.results.expected_deviation import ExpectedDeviation
from coupling.results.outlook import DrawnDeviation
from coupling.run.expected_robots import ExpectedRobots, drawn_replays
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.run.replayed_command import ReplayedCommand
from coupling.run.robustness import replayed
from elastic_robot.fmi.interface import IDEAL

# Longest distance of the times at which the tool is looked at [s], that of a controller's rows.
_MAX_SAMPLE_DISTANCE = 0.004
# Robots that are drawn, without and with usual values of what their files leave out.
_DRAWS = (16, 16)


def finely_sampled(motion: DesiredMotion) -> tuple[ToolPath, WrenchHistory]:
    """Return a desired path, and the wrench along it, at times as near as a controller's rows."""
    desired = SampledPath.of(motion.path).refined(_MAX_SAMPLE_DISTANCE).path
    return desired, motion.wrench.refined(desired.time)


def exact_command(
    moving: MovingRobot, motion: DesiredMotion, watch: Watch = unwatched
) -> JointPath:
    """Return the motion of the drives that keeps the tool on its path, row by row as it is solved for.

    Args:
        watch: Function called with the progress of the work.
    """
    task = moving.task(motion)

    def progress(completed: int, total: int) -> None:
        watch(Progress("solving for the motion of the links", completed, total))

    links = solve_links(moving.model, task, progress=progress).theta
    time = fine_times(links)
    wind_up = moving.wind_up(links, time, moving.torque(links, time, task.wrench), motion.wrench)
    chain = moving.model.chain
    outputs = np.stack([links.at(time, order)[:, chain.drive] for order in range(3)])
    states = np.stack([wind_up.angle, wind_up.rate, np.gradient(wind_up.rate, time, axis=0)])
    outputs[:, :, moving.model.gear_joint] -= states
    motors = chain.kinematic_errors.at_motor(outputs)
    return JointPath(time, *((values,) for values in motors))


def _thinned(exact: JointPath) -> JointPath:
    """Return rows no nearer than a controller's, as a simulation takes a step to every one."""
    step = max(round(_MAX_SAMPLE_DISTANCE / float(exact.time[1] - exact.time[0])), 1)
    rows = np.append(np.arange(0, len(exact.time) - 1, step), len(exact.time) - 1)
    blocks = (tuple(part[rows] for part in block) for block in (exact.q, exact.qd, exact.qdd))
    return JointPath(exact.time[rows], *blocks)


def expected_deviation(
    placed: PlacedRobot,
    force_factors: tuple[float, float] | None,
    motion: DesiredMotion,
    watch: Watch = unwatched,
) -> ExpectedDeviation | None:
    """Return the deviation to expect of a command that keeps the model of one robot on its path.

    Args:
        force_factors: Lowest and highest real force over the process's, by its source; None: unknown.
        motion: Path, joint angles of the undeflected robot along it and wrench on the tool.
        watch: Function called with the progress of the work.

    Returns:
        The deviation, open above where the case has servos, as the command does without; None of a
        robot that nothing moves.

    Raises:
        SimulationError: If a robot cannot be simulated.
    """
    has_servo = placed.drive != IDEAL
    at_base = replace(
        placed, world_from_base=AT_THE_ORIGIN, drive=IDEAL, touch_off=None, discrepancy=None
    )
    desired, wrench = finely_sampled(motion)
    exact = exact_command(MovingRobot(placed.description, placed.torque_curve), motion, watch)
    joints = _thinned(exact)
    expected = ExpectedRobots.among([at_base], force_factors, bool(np.any(wrench.wrench)))
    if has_servo:
        gears_alone = tuple(value for value in expected.values if value.drive is None)
        expected = replace(expected, values=gears_alone)
    with (
        FmuPool("native", watch) as models,
        FmuPool("native", processes=WorkerProcesses()) as others,
    ):
        cell, simulated = cell_of([at_base], models)
        command = ReplayedCommand(cell, simulated, joints, wrench, desired)
        single = replayed(command)
        if not single:
            return None
        drawn = DrawnDeviation.among(drawn_replays(command, expected, others, _DRAWS, watch))
    figure = ExpectedDeviation.among(max(replay.deviation.maximum for replay in single), drawn)
    return figure.model_copy(update={"is_whole": figure.is_whole and not has_servo})
