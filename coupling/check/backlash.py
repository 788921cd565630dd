"""What an error of the backlash or hysteresis costs an exact command, found by simulating it.

No formula of the gears alone tells that.  A gear that does not reverse is off by the error dB of its
half width B, and one that changes it by 2 dB, as long as its link follows.  But in the backlash only the
damper d holds the link.  An error dB that swings on the flank with omega leaves it with v = omega dB,
which the damper takes off within I / d, over a way of

    v I / d = dB / (2 zeta),

zeta being the damping ratio on the flank: many times dB, up to the other flank, 2 B away, and some more
where it comes back from there.  So the moving robot is simulated, under the command that the motion of
the links and the gears' own equation give,

    q = phi - e,   d e' + S(e) = T(t),

without controller, limits of drives and polish, which are about micrometres: a second for half a minute
of path.
"""

from __future__ import annotations

import numpy as np

from coupling.events import Progress, Watch, unwatched
from coupling.inverse.inversion import DesiredMotion, MovingRobot, fine_times
from coupling.inverse.links import solve_links
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from coupling.results.outlook import Replay
from coupling.robot.simulated_model import SimulatedModel
from coupling.run.robustness import VARIATIONS

# Longest distance of the times at which the tool is looked at [s], that of a controller's rows.
_MAX_SAMPLE_DISTANCE = 0.004
# Differences of gears that are looked at.
_GEARS = ("backlash", "hysteresis")


def gear_replays(
    moving: MovingRobot, model: SimulatedModel, motion: DesiredMotion, watch: Watch
) -> tuple[Replay, ...]:
    """Return what robots with other gears leave, as `coupling.run.robustness` varies them.

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
    desired = SampledPath.of(motion.path).refined(_MAX_SAMPLE_DISTANCE).path
    loads = motion.wrench.refined(desired.time)
    return tuple(
        Replay.of(robot.what, robot.simulate(command, loads, "dynamic"), desired)
        for robot in robots
    )


def exact_command(
    moving: MovingRobot, motion: DesiredMotion, watch: Watch = unwatched
) -> JointPath:
    """Return the motion of the drives that keeps the tool on its path, row by row as solved for."""
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
