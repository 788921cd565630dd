"""A robot whose gears have hysteresis, simulated plainly: Runge and Kutta's steps on Pinocchio.

M theta'' + h - J^T w + S(x) + d x' + sum f s / a = 0 in the rows of x, with s = clip(s + dx, +-a) from
the start of each step on: no event is located, and nothing is shared with the inverse.
"""

from dataclasses import replace

import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv

from coupling.path.histories import ToolPath
from coupling.path.joint_path import JointPath
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.gear_parts import StopElement
from elastic_robot.kinematics import tcp_jacobian
from elastic_robot.parameters import Parameters
from elastic_robot.torque_curves import TORQUE_CURVES

ANGLES = (2e-5, 6e-5, 1.5e-4)  # [rad]


def with_hysteresis(robot: Robot, torques: tuple[float, ...]) -> Robot:
    """Give each elastic joint three elements that together slip at a torque [N m]; 0: none."""
    joints = tuple(
        replace(joint, hysteresis=tuple(StopElement(torque / 3.0, a) for a in ANGLES))
        if torque and joint.stiffness is not None
        else joint
        for joint, torque in zip(robot.joints, torques, strict=True)
    )
    return replace(robot, joints=joints)


def replayed(
    robot: Robot,
    curve: str,
    command: JointPath,
    wrench,
    deflection: np.ndarray,
    step: float,
    end: float = np.inf,
) -> tuple[ToolPath, np.ndarray]:
    """Return the tool's path and deflections (k, m) under a command, from a deflection at rest.

    To that the elements came from unloaded.

    Args:
        robot, curve: The robot and its gears' torque curve.
        command: Motion of the drives.
        wrench: Function from times to wrenches (k, 6).
        deflection: Elastic coordinates at the first time [rad], (m,).
        step: Length of a step [s].
        end: Last time, where the command does not end before [s].
    """
    chain = build_chain(robot)
    model, data, rows = chain.model, chain.model.createData(), chain.elastic
    parameters = Parameters.of(robot)
    law, damping = TORQUE_CURVES[curve].build(parameters), parameters.damping
    gears = [joint for joint in robot.joints if joint.stiffness is not None]
    own = [
        (int(k), stop.slip_torque, stop.slip_angle)
        for k, joint in zip(chain.torsions, gears, strict=True)
        for stop in joint.hysteresis
    ]
    of = np.array([k for k, _, _ in own], dtype=int)
    a = np.array([angle for *_, angle in own])
    stiff = np.array([torque / angle for _, torque, angle in own])
    sums = np.zeros((len(damping), len(own)))
    sums[of, np.arange(len(own))] = stiff
    first, last = float(command.time[0]), min(float(command.time[-1]), end)
    count = round((last - first) / step)
    times = first + step / 2.0 * np.arange(2 * count + 1)
    times[-1] = min(times[-1], last)
    q, qd, qdd = command.trajectory.at(times)
    loads = wrench(times)
    loaded = loads.any(axis=1)
    block = np.ix_(rows, rows)

    # Links move, not deflections: where a drive's acceleration jumps, theirs does not.
    drives, rates, bends = (np.array([chain.theta(row) for row in rows_]) for rows_ in (q, qd, qdd))
    bends[:, rows] = 0.0

    def acceleration(j, y, v, s, before):
        theta, rate = drives[j].copy(), rates[j].copy()
        x, theta[rows], rate[rows] = y - drives[j, rows], y, v
        need = pin.rnea(model, data, theta, rate, bends[j])
        if loaded[j]:
            need = need - loads[j] @ tcp_jacobian(chain, data, theta)
        stretched = np.minimum(np.maximum(s + x[of] - before[of], -a), a)
        pull = need[rows] + law.torque(x) + damping * (v - rates[j, rows]) + sums @ stretched
        _, found, failed = dposv(pin.crba(model, data, theta)[block], -pull)
        assert not failed
        return found

    x = deflection
    y, v, s = drives[0, rows] + x, rates[0, rows].copy(), np.clip(x[of], -a, a)
    found, deflections = np.empty((count + 1, 7)), np.empty((count + 1, len(x)))
    h = times[2] - times[0]
    for n in range(count + 1):
        theta = drives[2 * n].copy()
        theta[rows] = y
        pin.forwardKinematics(model, data, theta)
        found[n] = pin.SE3ToXYZQUAT(pin.updateFramePlacement(model, data, chain.tcp))
        deflections[n] = x
        if n == count:
            break
        a1 = acceleration(2 * n, y, v, s, x)
        v2 = v + 0.5 * h * a1
        a2 = acceleration(2 * n + 1, y + 0.5 * h * v, v2, s, x)
        v3 = v + 0.5 * h * a2
        a3 = acceleration(2 * n + 1, y + 0.5 * h * v2, v3, s, x)
        v4 = v + h * a3
        a4 = acceleration(2 * n + 2, y + h * v3, v4, s, x)
        y = y + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
        v = v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        before, x = x, y - drives[2 * n + 2, rows]
        s = np.minimum(np.maximum(s + x[of] - before[of], -a), a)
    return ToolPath(times[::2], found), deflections
