"""Motion of the links with the tool on its path: least squares over the whole path.

The tilts' equations of motion do not contain the drives.  With the tool on its path they form a
boundary value problem, which may be unstable in either direction of time; solved over the whole path
at once it is well-posed (Devasia, Chen and Paden 1996, docs/references.md).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.linalg import LinAlgError
from scipy.spatial.transform import Rotation

from coupling.inverse.link_model import LinkModel
from coupling.inverse.link_task import (
    DEGREE,
    OF_ACCELERATION,
    OF_ANGLE,
    OF_BALANCE,
    OF_POSITION,
    OF_ROTATION,
    LinkMotion,
    LinkTask,
    interpolating,
)
from coupling.inverse.spline import UniformSpline, stencil
from coupling.native.desk_links import (
    REACH,
    DesiredPoses,
    EndConditions,
    GaussNewtonStep,
    LinkIterations,
    LinkPath,
)
from coupling.native.desk_robot import ReachRules

_ORDERS = 3
# Joints that a pose of the tool holds.
_HELD = 6
# Instants whose desired poses are computed at once.
_CHUNK = 10_000
# Intervals at each end whose middles are collocated as well: a quintic spline has solutions of its own
# there beside those of the differential equation.
_EDGE = 10
# Nodes over which the end of what is solved at once dies out: at first 2 s at 4 ms.  Twice as many where
# changes that were solved for twice differ by more [rad] than the next iteration corrects to rounding;
# those of the last one differ by less.
_LAG, _MINDED, _AGREED = 512, 1e-7, 1e-10
# Part of the diagonal that is added to it where rounding has made the matrix indefinite; a Gauss-Newton
# iteration repairs what the next one finds.
_DAMPING = 1e-13
# Largest change of an angle that one more iteration would make [rad], by how much smaller the last one
# was than the one before; they shrink faster than that.  Iterations usually, and at most.
_TOLERANCE, _USUAL, _MOST = 1e-9, 2, 12
# How the tool is brought to its path under static tilts, to begin with.
_NEAR = ReachRules(tolerance=1e-3, iterations=3, damping=1e-3, least=1e-12, largest_step=0.1)
# Newton's method from the rigid robot's angles: each iteration contracts by the tilts' share of the sag.
_ITERATIONS, _SETTLED = 30, 1e-15


def equilibrium_angles(
    model: LinkModel, q: np.ndarray, position: np.ndarray, rotation: Rotation, wrench: np.ndarray
) -> np.ndarray:
    """Return the angles of the chain with the tool on a pose and the tilts in balance, (angles,).

    Args:
        model: The robot.
        q: Angles of the rigid robot that has its tool there [rad], (joints,).
        position: Position of the TCP [m], (3,).
        rotation: base_from_tool.
        wrench: Wrench on the robot at the TCP, base axes [N, N m], (6,).
    """
    theta = model.chain.theta(q[None])
    rest, load = np.zeros_like(theta), wrench[None]
    for _ in range(_ITERATIONS):
        state = model.desk.linearised(theta, rest, rest, load)
        turn = (Rotation.from_matrix(state.rotation[0]) * rotation.inv()).as_rotvec()
        missed = np.concatenate([state.position[0] - position, turn])
        step = np.zeros(model.size)
        step[model.tilts] = -state.load[0, model.tilts] / model.tilt_stiffness
        step[model.tilts] -= theta[0, model.tilts]
        missed += state.jacobian[0] @ step
        drives = state.jacobian[0][:, model.chain.drive]
        step[model.chain.drive] = -np.linalg.lstsq(drives, missed, rcond=None)[0]
        theta[0] += step
        if np.abs(step).max() < _SETTLED:
            break
    return theta[0]


def solve_links(
    model: LinkModel,
    task: LinkTask,
    progress: Callable[[int, int], None] = lambda done, total: None,
    lag: int = _LAG,
) -> LinkMotion:
    """Return the motion of the links along a whole path.

    Args:
        model: The robot.
        task: Desired motion of the links.
        progress: Function called with the numbers of iterations done and expected.
        lag: Nodes over which the end of what is solved at once is taken to die out at first.
    """
    path = link_path(model, task)
    motion = _static_motion(model, task, path.nodes)
    log, before = list[GaussNewtonStep](), 0.0
    iterations = LinkIterations(model.desk, path, lag)
    while len(log) < _MOST:
        solved = iterations.change(motion.coefficients)
        solved = solved or iterations.change(motion.coefficients, _DAMPING)
        if solved is None:
            raise LinAlgError("the links' equations are not positive definite")
        change, figures = solved
        if figures.cut > _MINDED:
            lag *= 2
            iterations = LinkIterations(model.desk, path, lag)
            continue
        np.add(motion.coefficients, change, out=motion.coefficients)
        log.append(figures)
        progress(len(log), max(len(log) + 1, _USUAL))
        if figures.step**2 <= _TOLERANCE * max(before, _TOLERANCE) and figures.cut <= _AGREED:
            break
        before = figures.step
    progress(len(log), len(log))
    return LinkMotion(motion, tuple(log), _distances(model, path, motion))


def _distances(model: LinkModel, path: LinkPath, motion: UniformSpline) -> np.ndarray:
    """Return the distances of the tool from its path at the nodes [m], (intervals + 1,)."""
    position, _ = model.desk.placements(_at_nodes(motion))
    distances: np.ndarray = np.linalg.norm(position - path.nodes.position, axis=1)
    return distances


def _at_nodes(motion: UniformSpline) -> np.ndarray:
    """Return a spline at its nodes, any unit, (intervals + 1, quantities)."""
    count = motion.intervals + 1
    weights = stencil(np.array(0.0), DEGREE, 0)[:-1].tolist()
    values = np.zeros((count, motion.coefficients.shape[1]))
    for j, weight in enumerate(weights):
        values += weight * motion.coefficients[j : j + count]
    return values


def rigid_motion(model: LinkModel, task: LinkTask) -> UniformSpline:
    """Return the motion of the rigid robot with the tilts that its loads at rest ask for."""
    return interpolating(task, _at_rest_under_load(model, task.guess, task.wrench(task.nodes)))


def _static_motion(model: LinkModel, task: LinkTask, nodes: DesiredPoses) -> UniformSpline:
    """Return the motion with these tilts and, where the robot is regular, the tool on its path."""
    theta = np.empty((len(task.guess), model.size))
    for first in range(0, len(theta), _CHUNK):
        here = slice(first, first + _CHUNK)
        theta[here] = _at_rest_under_load(model, task.guess[here], nodes.wrench[here])
        reached = model.desk.reach(_NEAR, nodes.position[here], nodes.quaternion[here], theta[here])
        came = reached.error < _NEAR.tolerance
        theta[here][came] = reached.theta[came]
    return interpolating(task, theta)


def _at_rest_under_load(model: LinkModel, q: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """Return the angles of the rigid robot with the tilts that its loads at rest ask for."""
    theta = model.chain.theta(q)
    rest = np.zeros_like(theta)
    load = model.desk.loads(theta, rest, rest, wrench)
    theta[:, model.tilts] = -load[:, model.tilts] / model.tilt_stiffness
    return theta


def link_path(model: LinkModel, task: LinkTask) -> LinkPath:
    """Return what the links are to do, node by node."""
    count, edge = task.intervals, min(_EDGE, task.intervals // 2)
    outer = np.concatenate([np.arange(edge), np.arange(count - edge, count)])
    weights = [
        [stencil(np.array(place), DEGREE, order) / task.spacing**order for order in range(_ORDERS)]
        for place in (0.0, 0.5)
    ]
    stiffness = model.tilt_stiffness + model.tilt_inertia(task.guess[0]) / task.spacing**2
    return LinkPath(
        np.array(weights),
        _desired(task, task.nodes),
        _desired(task, task.start + task.spacing * (outer + 0.5)),
        interpolating(task, task.guess).coefficients,
        OF_BALANCE * OF_POSITION * model.reach / stiffness,
        OF_POSITION,
        OF_ROTATION,
        OF_ACCELERATION,
        # The pose holds up to six joints; what more of them do by themselves is held here.
        OF_ANGLE if model.chain.joint_count > _HELD else 0.0,
        _end_conditions(model, task),
    )


def _desired(task: LinkTask, times: np.ndarray) -> DesiredPoses:
    """Return what is desired at times (k,) [s]."""
    desired = DesiredPoses(*(np.empty((len(times), columns)) for columns in (3, 4, 6)))
    for first in range(0, len(times), _CHUNK):
        here = slice(first, first + _CHUNK)
        desired.position[here] = task.position(times[here])
        desired.quaternion[here] = task.rotation(times[here]).as_quat()
        desired.wrench[here] = task.wrench(times[here])
    return desired


def _end_conditions(model: LinkModel, task: LinkTask) -> EndConditions:
    """Return the conditions at the ends of the motion.

    A motion that begins at rest has the tilts at rest under their static loads by their equation.
    """
    # Heavier than everything else, so that it holds to rounding.
    heavy = OF_BALANCE * OF_POSITION * model.reach
    # Derivatives by the distance of the nodes: all rows are angles.
    value, rate, acceleration = (
        heavy * stencil(np.array(0.0), DEGREE, order)[: REACH - 1] for order in range(_ORDERS)
    )
    everything, tilts = np.arange(model.size), model.tilts
    still, held = np.zeros(model.size), np.zeros(len(tilts))
    rest = [(row, everything, still) for row in (rate, acceleration)]
    nobody = np.zeros(0, dtype=int), np.zeros(0)
    conditions = [(0, value, *nobody)]
    if task.begins == "rest":
        # A gear that carries nothing there must not be moved by what least squares leave.
        conditions += [
            (0, *row) for row in [*rest, (value, everything, heavy * _start(model, task))]
        ]
    elif task.begins == "loaded":
        (static,) = _at_rest_under_load(model, task.guess[:1], task.wrench(task.nodes[:1]))
        conditions += [(0, value, tilts, heavy * static[tilts]), (0, rate, tilts, held)]
    if task.ends == "rest":
        conditions += [(task.intervals, *row) for row in rest]
    return EndConditions(
        np.concatenate([np.full(len(angles), first) for first, _, angles, _ in conditions]),
        np.concatenate([angles for _, _, angles, _ in conditions]),
        np.concatenate([np.tile(row, (len(angles), 1)) for _, row, angles, _ in conditions]),
        np.concatenate([target for *_, target in conditions]),
    )


def _start(model: LinkModel, task: LinkTask) -> np.ndarray:
    """Return the angles at which a motion begins at rest."""
    time = task.nodes[:1]
    return equilibrium_angles(
        model,
        task.guess[0],
        task.position(time)[0],
        task.rotation(time)[0],
        task.wrench(time)[0],
    )
