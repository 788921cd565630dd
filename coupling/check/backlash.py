"""What an error of the backlash or hysteresis costs an exact command, found by simulating it.

No formula of the gears alone tells that.  A gear that does not reverse is off by the error dB of its
half width B, and one that changes it by 2 dB, as long as its link follows.  But in the backlash only the
damper d holds the link.  An error dB that swings on the flank with omega leaves it with v = omega dB,
which the damper takes off within I / d, over a way of

    v I / d = dB / (2 zeta),

zeta being the damping ratio on the flank: many times dB, up to the other flank, 2 B away, and some more
where it comes back from there.  So the moving robot is simulated, under
`exact_command`: a second for half a minute of path.
"""

from __future__ import annotations

from coupling.events import Watch
from coupling.inverse.inversion import DesiredMotion, MovingRobot
from coupling.results.replay import Replay
from coupling.robot.simulated_model import SimulatedModel
from coupling.run.exact_command import exact_command, finely_sampled
from coupling.run.robustness import VARIATIONS

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
    desired, loads = finely_sampled(motion)
    return tuple(
        Replay.of(robot.what, robot.simulate(command, loads, "dynamic"), desired)
        for robot in robots
    )
