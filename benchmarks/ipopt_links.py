"""The links along 40 nodes of the ISO 9283 path, by CasADi with IPOPT and by ours.

    pip install casadi; python -m benchmarks.ipopt_links --page performance

CasADi differentiates the sum of squares of docs/inverse.md, IPOPT minimises it without constraints from
the motion of the rigid robot, with a quasi-Newton matrix: the exact one takes minutes to build.
"""

from __future__ import annotations

import argparse
import time
from functools import reduce
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

from benchmarks.inverse_tasks import iso_task
from benchmarks.stopwatch import timed
from benchmarks.task import ROBOT
from coupling.inverse.inversion import DesiredMotion, MovingRobot
from coupling.inverse.link_model import LinkModel
from coupling.inverse.links import link_path, rigid_motion, solve_links
from coupling.native.desk_links import LinkPath
from coupling.path.histories import WrenchHistory
from coupling.robot.inverse_kinematics import InverseKinematics
from docs.scripts.page import replace, table

# Rows of the path, every 20 ms: 40 nodes 4 ms apart in mid-motion.
_ROWS = np.arange(400, 409)
# Iterations, tolerance and CPU time that IPOPT may take [s].
_ITERATIONS, _TOLERANCE, _LONGEST = 200, 1e-12, 30.0


def robot_at(
    model: LinkModel, theta: ca.SX, rate: ca.SX, bend: ca.SX, wrench: ca.SX
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return loads of all angles, position and rotation of the TCP: Newton and Euler's equations."""
    chain, data = model.chain.model, model.chain.model.createData()
    rotation, origin = ca.SX.eye(3), ca.SX.zeros(3)
    omega, alpha, speedup = ca.SX.zeros(3), ca.SX.zeros(3), -ca.SX(chain.gravity.linear)
    axes, origins, pushes = [], [], []
    for i in range(model.size):
        placement, body = chain.jointPlacements[i + 1], chain.inertias[i + 1]
        unit = pin.neutral(chain)
        unit[i] = 1.0
        pin.forwardKinematics(chain, data, unit)
        axis = pin.log3(placement.rotation.T @ data.liMi[i + 1].rotation)
        arm = ca.mtimes(rotation, placement.translation)
        origin = origin + arm
        speedup = speedup + ca.cross(alpha, arm) + ca.cross(omega, ca.cross(omega, arm))
        skew = pin.skew(axis)
        turn = ca.SX.eye(3) + ca.sin(theta[i]) * skew + (1.0 - ca.cos(theta[i])) * (skew @ skew)
        rotation = ca.mtimes(rotation, ca.mtimes(placement.rotation, turn))
        along = ca.mtimes(rotation, axis)
        alpha = alpha + along * bend[i] + ca.cross(omega, along) * rate[i]
        omega = omega + along * rate[i]
        lever = ca.mtimes(rotation, body.lever)
        inertia = ca.mtimes(rotation, ca.mtimes(body.inertia, rotation.T))
        force = body.mass * (
            speedup + ca.cross(alpha, lever) + ca.cross(omega, ca.cross(omega, lever))
        )
        moment = ca.mtimes(inertia, alpha) + ca.cross(omega, ca.mtimes(inertia, omega))
        pushes.append((force, moment + ca.cross(origin + lever, force)))
        axes.append(along)
        origins.append(origin)
    tcp = chain.frames[model.chain.tcp].placement
    tool = origin + ca.mtimes(rotation, tcp.translation)
    loads = []
    for i, (along, start) in enumerate(zip(axes, origins, strict=True)):
        force = reduce(lambda a, b: a + b, (push[0] for push in pushes[i:])) - wrench[:3]
        moment = reduce(lambda a, b: a + b, (push[1] for push in pushes[i:]))
        moment = moment - wrench[3:] - ca.cross(tool, wrench[:3])
        loads.append(ca.dot(along, moment - ca.cross(start, force)))
    return ca.vertcat(*loads), tool, ca.mtimes(rotation, tcp.rotation)


def residuals(model: LinkModel, path: LinkPath) -> ca.Function:
    """Return weighted residuals of a point, from its motion and what is desired there."""
    size, joints = model.size, model.chain.joint_count
    theta, rate, bend = (ca.SX.sym(name, size) for name in ("theta", "rate", "bend"))
    position, rotation, wrench = ca.SX.sym("p", 3), ca.SX.sym("R", 3, 3), ca.SX.sym("w", 6)
    rigid = ca.SX.sym("rigid", joints)
    load, tool, axes = robot_at(model, theta, rate, bend, wrench)
    apart = ca.mtimes(axes, rotation.T)
    turn = 0.5 * ca.inv_skew(apart - apart.T)
    tilts, drives = model.tilts.tolist(), model.chain.drive.tolist()
    torque = load[tilts] + model.tilt_stiffness * theta[tilts] + model.tilt_damping * rate[tilts]
    rows = ca.vertcat(
        path.of_position * (tool - position),
        path.of_rotation * turn,
        path.balance * torque,
        path.of_acceleration * (bend[drives] - rigid),
    )
    arguments = [theta, rate, bend, position, ca.vec(rotation), wrench, rigid]
    return ca.Function("residuals", arguments, [rows])


def by_ipopt(model: LinkModel, path: LinkPath, start: np.ndarray) -> tuple[np.ndarray, str, int]:
    """Return the coefficients [rad], (intervals + 5, angles), IPOPT's verdict and its iterations."""
    count, edge, size = path.intervals, len(path.middles.position) // 2, model.size
    outer = np.concatenate([np.arange(edge), np.arange(count - edge, count)])
    first = np.concatenate([np.arange(count + 1), outer])
    place = np.concatenate([np.zeros(count + 1, dtype=int), np.ones(len(outer), dtype=int)])
    splines = np.zeros((3, len(first), count + 6))
    for k, (begin, which) in enumerate(zip(first, place, strict=True)):
        splines[:, k, begin : begin + 6] = path.weights[which]
    splines = splines[:, :, : count + 5]
    unknown = ca.MX.sym("c", size, count + 5)
    motion = [ca.mtimes(unknown, basis.T) for basis in splines]
    both = (path.nodes, path.middles)
    position = np.concatenate([poses.position for poses in both]).T
    turned = np.concatenate([_matrices(poses.quaternion) for poses in both]).T
    wrench = np.concatenate([poses.wrench for poses in both]).T
    rigid = (splines[2] @ path.rigid).T
    rows = residuals(model, path).map(len(first))(*motion, position, turned, wrench, rigid)
    ends = path.ends
    held = [
        ca.dot(unknown[int(angle), int(begin) : int(begin) + 5], weights[None]) - target
        for begin, angle, weights, target in zip(
            ends.first, ends.angle, ends.weights, ends.target, strict=True
        )
    ]
    square = 0.5 * ca.sumsqr(rows) + 0.5 * ca.sumsqr(ca.vertcat(*held))
    options: Any = {
        "print_time": False,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "tol": _TOLERANCE,
            "max_iter": _ITERATIONS,
            "max_cpu_time": _LONGEST,
            "hessian_approximation": "limited-memory",
        },
    }
    problem: Any = {"x": ca.vec(unknown), "f": square}
    solver = ca.nlpsol("links", "ipopt", problem, options)
    found = np.array(solver(x0=start.ravel())["x"]).reshape(count + 5, size)
    statistics = solver.stats()
    return found, statistics["return_status"], statistics["iter_count"]


def _matrices(quaternion: np.ndarray) -> np.ndarray:
    """Return rotation matrices by columns, (k, 9)."""
    turned = [pin.Quaternion(row).toRotationMatrix().T.ravel() for row in quaternion]
    return np.array(turned).reshape(-1, 9)


def main() -> None:
    """Print the table, and write it into a page."""
    parser = argparse.ArgumentParser(description="The links by CasADi with IPOPT.")
    parser.add_argument("--page", help="name of the page that takes the table")
    options = parser.parse_args()
    whole = iso_task()
    path = whole.path.at_rows(_ROWS)
    joints = InverseKinematics(ROBOT, whole.plan().q[0][_ROWS[0]]).plan(path)
    moving = MovingRobot(ROBOT, "backlash")
    model, task = (
        moving.model,
        moving.task(DesiredMotion(path, joints, WrenchHistory.none(path.time))),
    )
    spent, ours = timed(lambda: solve_links(model, task).theta.coefficients)
    steps = len(solve_links(model, task).iterations)
    links, start = link_path(model, task), rigid_motion(model, task).coefficients
    begin = time.process_time()
    found, verdict, iterations = by_ipopt(model, links, start)
    other = time.process_time() - begin
    apart = np.abs(found - ours)[2:-2].max()
    body = [
        ("ours", f"{spent:.4f}", f"{steps}", ""),
        ("CasADi, IPOPT", f"{other:.2f}", f"{iterations}, {verdict}", f"{1e9 * apart:.3g}"),
    ]
    text = table(("solver", "time [s]", "iterations", "apart [nrad]"), body)
    print(text)
    if options.page:
        replace(options.page, "ipopt", text)


if __name__ == "__main__":
    main()
