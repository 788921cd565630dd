"""The lighter form, without parameters: a command less what was measured, its slow part.

The paper's mirroring with the robot itself in place of its model.  It needs no model of the gears, and
it repeats: a robot that does the same under the same command is put right where its deviation is slow.
What is fast stays, a gear's passage through its play above all; and beyond some hertz the robot answers
with its own modes, so that subtracting would add.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import make_interp_spline

from coupling.learn.passes import Seen, Simulated
from coupling.learn.smoothing import SlowPart
from coupling.path.deviation import less_constant
from coupling.path.histories import JointPath, ToolPath
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.kinematics import tcp_jacobian
from elastic_robot.trajectory import Trajectory

# Frequency up to which a deviation is subtracted [Hz]: of 1, 2, 3 and 5 Hz the one that leaves least on
# the example robots of docs/learn.md, whose lowest modes are at 7 to 12 Hz; 5 Hz diverges.
CUT_OFF = 2.0
# How long the correction takes to come and to go at the ends [s].
_BLEND = 0.5
# Passes that find the clock.
_CLOCK_PASSES = 3


def measured_deviation(seen: Seen, desired: ToolPath) -> tuple[np.ndarray, float]:
    """Return measured less desired positions [m], (n, 3), behind the clock that fits best, and that [s].

    Args:
        seen: What was measured, aligned with the run.
        desired: Desired path of the tool.
    """
    path, clock = Simulated(desired), 0.0
    for _ in range(_CLOCK_PASSES):
        off = seen.position - path.position(seen.time + clock)
        speed = path.position(seen.time + clock, 1)
        clock += float(np.sum((off - off.mean(axis=0)) * speed) / max(np.sum(speed**2), 1e-12))
    return seen.position - path.position(seen.time + clock), clock


def mirrored(
    robot: Robot,
    command: JointPath,
    time: np.ndarray,
    deviation: np.ndarray,
    cut_off: float = CUT_OFF,
) -> JointPath:
    """Return the command with the slow part of a deviation subtracted.

    Its mean is not: that is as good as the measuring frame.

    Args:
        robot: The robot, for its kinematics.
        command: Motion of the drives under which it was measured.
        time: Rising [s], (n,).
        deviation: Measured less desired positions [m], (n, 3), base axes.
        cut_off: Frequency up to which it is subtracted [Hz].
    """
    mean = SlowPart.of(time, cut_off)
    slow = mean(deviation)
    at = mean.time
    slow = less_constant(at, slow)
    # A smooth step from 0 to 1, at rest up to its second derivative at both ends.
    rise = np.clip(np.minimum(at - at[0], at[-1] - at) / _BLEND, 0.0, 1.0)
    slow = slow * (rise**3 * (10.0 - 15.0 * rise + 6.0 * rise**2))[:, None]
    rates, accelerations = (given[0] if given else None for given in (command.qd, command.qdd))
    motion = Trajectory(command.time, command.q[0], rates, accelerations)
    # A clock that is off reaches a little beyond the command.
    angles = motion.at(np.clip(at, command.time[0], command.time[-1]))[0]
    chain = build_chain(robot)
    data = chain.model.createData()
    turned = np.empty((len(at), chain.joint_count))
    for k, theta in enumerate(chain.theta(angles)):
        jacobian = tcp_jacobian(chain, data, theta)[:, chain.drive]
        wanted = np.concatenate([-slow[k], np.zeros(3)])
        turned[k] = np.linalg.lstsq(jacobian, wanted, rcond=1e-6)[0]
    zero = [(1, np.zeros(chain.joint_count)), (2, np.zeros(chain.joint_count))]
    spline = make_interp_spline(at, turned, 5, bc_type=(zero, zero))
    inside = (command.time >= at[0]) & (command.time <= at[-1])
    added = [np.zeros_like(command.q[0]) for _ in range(3)]
    for order, values in enumerate(added):
        values[inside] = spline(command.time[inside], order)
    blocks = (command.q, command.qd, command.qdd)
    moved = [(own[0] + more,) if own else () for own, more in zip(blocks, added, strict=True)]
    return JointPath(command.time, *moved)
