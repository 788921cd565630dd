"""The links' least squares (docs/inverse.md, 1), dense, on Pinocchio and SciPy."""

import numpy as np
import pinocchio as pin
from scipy.interpolate import BSpline

from coupling.inverse.link_model import LinkModel
from coupling.inverse.link_task import (
    OF_ACCELERATION,
    OF_ANGLE,
    OF_BALANCE,
    OF_POSITION,
    OF_ROTATION,
    LinkTask,
)
from coupling.inverse.links import equilibrium_angles
from elastic_robot.kinematics import base_from_tool, tcp_force_gradient, tcp_jacobian

_EDGE = 10


def basis(task: LinkTask, times: np.ndarray) -> np.ndarray:
    """Values, rates, accelerations of all B-splines at times, (3, k, coefficients)."""
    knots = task.start + task.spacing * np.arange(-5, task.intervals + 6)
    splines = BSpline(knots, np.eye(task.intervals + 5), 5)
    return np.stack([splines(times, nu=order) for order in range(3)])


def points(task: LinkTask) -> np.ndarray:
    """Nodes, and the middles of the outermost intervals."""
    edge = min(_EDGE, task.intervals // 2)
    middles = task.start + task.spacing * (np.arange(task.intervals) + 0.5)
    return np.concatenate([task.nodes, middles[:edge], middles[task.intervals - edge :]])


def loads(model: LinkModel, theta, rate, acceleration, wrench):
    """Loads (n,), derivatives (3, n, n), Jacobian (6, n), position and rotation of the TCP."""
    chain, data = model.chain, model.chain.model.createData()
    by = np.array(pin.computeRNEADerivatives(chain.model, data, theta, rate, acceleration))
    load, jacobian = data.tau.copy(), tcp_jacobian(chain, data, theta)
    load -= jacobian.T @ wrench
    by[0] -= tcp_force_gradient(jacobian, wrench)
    chain.balancers.relieve(load, theta)
    chain.balancers.relieve_gradient(by[0], theta)
    tool = base_from_tool(chain, data, theta)
    return load, by, jacobian, tool.translation.copy(), tool.rotation.copy()


def equations(model: LinkModel, task: LinkTask, rigid: np.ndarray, coefficients: np.ndarray):
    """Weighted residuals r and their derivatives by all coefficients, of points, then of the ends.

    `rigid` and `coefficients` are those of the rigid robot's joints and of the motion.
    """
    chain, data, joints = model.chain, model.chain.model.createData(), model.chain.drive
    times = points(task)
    splines, wrenches = basis(task, times), task.wrench(times)
    desired = task.position(times), task.rotation(times).as_matrix()
    inertia = pin.crba(chain.model, data, chain.theta(task.guess[0])).diagonal()[model.tilts]
    stiffness = model.tilt_stiffness + inertia / task.spacing**2
    balance = OF_BALANCE * OF_POSITION * model.reach / stiffness
    tether = OF_ANGLE if len(joints) > 6 else 0.0
    residuals, rows = [], []

    def add(weight, errors, by_motion, k):
        """`by_motion`: derivatives by theta, theta', theta'', (3, e, angles)."""
        residuals.append(weight * errors)
        by = np.einsum("mea,mc->eca", by_motion, splines[:, k])
        rows.append(np.atleast_1d(weight)[:, None] * by.reshape(len(errors), -1))

    unit = np.eye(model.size)
    for k, wrench in enumerate(wrenches):
        theta, rate, acceleration = splines[:, k] @ coefficients
        load, by, jacobian, place, axes = loads(model, theta, rate, acceleration, wrench)
        turn = pin.log3(axes @ desired[1][k].T)
        none = np.zeros((6, model.size))
        weights = np.repeat([OF_POSITION, OF_ROTATION], 3)
        error = np.concatenate([place - desired[0][k], turn])
        add(weights, error, np.array([jacobian, none, none]), k)
        tilts = by[:, model.tilts]
        tilts[0] += model.tilt_stiffness[:, None] * unit[model.tilts]
        tilts[1] += model.tilt_damping[:, None] * unit[model.tilts]
        missing = load[model.tilts] + model.tilt_stiffness * theta[model.tilts]
        missing += model.tilt_damping * rate[model.tilts]
        add(balance, missing, tilts, k)
        wanted, still = splines[:, k] @ rigid, np.zeros((len(joints), model.size))
        bent = np.array([still, still, unit[joints]])
        add(OF_ACCELERATION, acceleration[joints] - wanted[2], bent, k)
        add(tether, theta[joints] - wanted[0], bent[::-1], k)
    heavy = OF_BALANCE * OF_POSITION * model.reach
    for time, order, angles, values in ends(model, task):
        at_end = basis(task, np.array([time]))[order, 0] * task.spacing**order
        residuals.append(heavy * (at_end @ coefficients[:, angles] - values))
        rows.append(heavy * np.einsum("ea,c->eca", unit[angles], at_end).reshape(len(angles), -1))
    return np.concatenate(residuals), np.vstack(rows)


def ends(model: LinkModel, task: LinkTask):
    """Time, order of the derivative, angles and values of what is given at the ends."""
    everything, zero = np.arange(model.size), np.zeros(model.size)
    first, last = task.nodes[[0, -1]]
    time = task.nodes[:1]
    wrench = task.wrench(time)[0]
    if task.begins == "rest":
        pose = task.position(time)[0], task.rotation(time)[0]
        stands = equilibrium_angles(model, task.guess[0], *pose, wrench)
        yield from ((first, 0, everything, stands), (first, 1, everything, zero))
        yield first, 2, everything, zero
    elif task.begins == "loaded":
        theta = model.chain.theta(task.guess[:1])
        load = model.desk.loads(theta, 0.0 * theta, 0.0 * theta, wrench[None])[0, model.tilts]
        yield first, 0, model.tilts, -load / model.tilt_stiffness
        yield first, 1, model.tilts, 0.0 * load
    if task.ends == "rest":
        yield from ((last, order, everything, zero) for order in (1, 2))
