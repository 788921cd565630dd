"""Motion of the links with the tool on its path: least squares over the whole path.

The tilts' equations of motion do not contain the drives.  With the tool on its path they form a
boundary value problem, which may be unstable in either direction of time; solved over the whole path
at once it is well-posed (Devasia, Chen and Paden 1996, docs/references.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.inverse.band import NormalEquations
from coupling.inverse.link_model import LinkDerivatives, LinkModel, LinkState
from coupling.inverse.link_task import (
    DEGREE,
    WEIGHTS,
    End,
    GaussNewtonStep,
    LinkMotion,
    LinkTask,
    interpolating,
)
from coupling.inverse.spline import UniformSpline, stencil

_ORDERS = 3
# Joints that a pose of the tool holds.
_HELD = 6
# Points whose derivatives are held in memory at once.
_CHUNK = 2000
# Intervals at each end whose middles are collocated as well: a quintic spline has solutions of its own
# there beside those of the differential equation.
_EDGE = 10
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
        state, by = model.linearised(theta, rest, rest, load)
        turn = (Rotation.from_matrix(state.rotation[0]) * rotation.inv()).as_rotvec()
        missed = np.concatenate([state.position[0] - position, turn])
        step = np.zeros(model.size)
        step[model.tilts] = -state.load[0, model.tilts] / model.tilt_stiffness
        step[model.tilts] -= theta[0, model.tilts]
        missed += by.jacobian[0] @ step
        drives = by.jacobian[0][:, model.chain.drive]
        step[model.chain.drive] = -np.linalg.lstsq(drives, missed, rcond=None)[0]
        theta[0] += step
        if np.abs(step).max() < _SETTLED:
            break
    return theta[0]


@dataclass(frozen=True)
class _Points:
    """Collocation points that lie at the same place of their intervals."""

    intervals: range
    place: float
    position: np.ndarray
    rotation: np.ndarray
    wrench: np.ndarray
    rigid: np.ndarray
    rigid_acceleration: np.ndarray


class LinkProblem:
    """The least squares problem of a `LinkTask`.

    Args:
        model: The robot.
        task: Desired motion.
    """

    def __init__(self, model: LinkModel, task: LinkTask) -> None:
        self._model, self._task = model, task
        stiffness = model.tilt_stiffness + model.tilt_inertia(task.guess[0]) / task.spacing**2
        self._balance = WEIGHTS.balance * WEIGHTS.position * model.reach / stiffness
        # The pose holds up to six joints; what more of them do by themselves is held here.
        self._tether = WEIGHTS.tether if model.chain.joint_count > _HELD else 0.0
        self._rigid = interpolating(task, model.chain.theta(task.guess))
        self._static_tilts = self._at_rest_under_load(task.guess[:1], task.nodes[:1])[
            0, model.tilts
        ]
        # A gear that carries nothing there must not be moved by what least squares leave.
        self._standing = self._start() if task.begins == "rest" else None
        count, edge = task.intervals, min(_EDGE, task.intervals // 2)
        chunks = np.linspace(0, count, -(-count // _CHUNK) + 1).astype(int)
        self._groups = [
            *(self._points(range(a, b), 0.0) for a, b in pairwise(chunks.tolist())),
            self._points(range(count - 1, count), 1.0),
            *(self._points(outer, 0.5) for outer in (range(edge), range(count - edge, count))),
        ]

    def _points(self, intervals: range, place: float) -> _Points:
        task = self._task
        times = task.start + task.spacing * (np.arange(intervals.start, intervals.stop) + place)
        rigid = _derivatives(self._rigid, intervals, place)[:, :, self._model.chain.drive]
        return _Points(
            intervals,
            place,
            task.position(times),
            task.rotation(times).as_matrix(),
            task.wrench(times),
            rigid[0],
            rigid[2],
        )

    def guess(self) -> UniformSpline:
        """Return the motion of the rigid robot with the tilts that its loads at rest ask for."""
        task = self._task
        return interpolating(task, self._at_rest_under_load(task.guess, task.nodes))

    def _at_rest_under_load(self, q: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return the angles of the rigid robot with the tilts that its loads at rest ask for."""
        model = self._model
        theta = model.chain.theta(q)
        rest = np.zeros_like(theta)
        load = model.load(theta, rest, rest, self._task.wrench(times))
        theta[:, model.tilts] = -load[:, model.tilts] / model.tilt_stiffness
        return theta

    def _start(self) -> np.ndarray:
        """Return the angles at which a motion begins at rest."""
        task, time = self._task, self._task.nodes[:1]
        return equilibrium_angles(
            self._model,
            task.guess[0],
            task.position(time)[0],
            task.rotation(time)[0],
            task.wrench(time)[0],
        )

    def solve(self, tolerance: float = 1e-9, iterations: int = 12) -> LinkMotion:
        """Return the motion of the links.

        Args:
            tolerance: Largest change of an angle that one more iteration would make [rad], by how much
                smaller the last one was than the one before; they shrink faster than that.
            iterations: Iterations at most.
        """
        motion, log, before = self.guess(), [], 0.0
        for _ in range(iterations):
            motion, report = self._improved(motion)
            log.append(report)
            if report.step**2 <= tolerance * max(before, tolerance):
                break
            before = report.step
        return LinkMotion(motion, tuple(log), self.error(motion))

    def error(self, motion: UniformSpline) -> np.ndarray:
        """Return the distance of the tool from its path at the nodes [m], (intervals + 1,)."""
        errors = []
        for points in self._groups:
            if points.place == 0.5:
                continue
            theta = _derivatives(motion, points.intervals, points.place)[0]
            position, _ = self._model.placement(theta)
            errors.append(np.linalg.norm(position - points.position, axis=1))
        return np.concatenate(errors)

    def residuals(self, motion: UniformSpline) -> np.ndarray:
        """Return all weighted residuals [1], (rows,): half of the sum of their squares is minimised."""
        parts = []
        for points in self._groups:
            theta, rate, acceleration = _derivatives(motion, points.intervals, points.place)
            state = self._model.state(theta, rate, acceleration, points.wrench)
            errors = self._errors(points, state, theta, rate, acceleration)
            parts += [error.ravel() for error in errors]
        return np.concatenate([*parts, *(end.residual(motion) for end in self._ends())])

    def gradient(self, motion: UniformSpline) -> np.ndarray:
        """Return the derivative of half the sum of squares by the coefficients [1/rad], (n, angles)."""
        return self._normal_equations(motion)[0].gradient

    def _improved(self, motion: UniformSpline) -> tuple[UniformSpline, GaussNewtonStep]:
        equations, worst = self._normal_equations(motion)
        step = equations.solve()
        better = UniformSpline(motion.start, motion.spacing, motion.coefficients + step, DEGREE)
        return better, GaussNewtonStep(*worst, float(np.abs(step).max()))

    def _normal_equations(
        self, motion: UniformSpline
    ) -> tuple[NormalEquations, tuple[float, float, float]]:
        """Return an iteration's equations, and the largest errors of position, rotation and torque."""
        model = self._model
        equations = NormalEquations(motion.intervals, model.size, DEGREE, motion.spacing)
        worst = np.zeros(3)
        for points in self._groups:
            theta, rate, acceleration = _derivatives(motion, points.intervals, points.place)
            state, by = model.linearised(theta, rate, acceleration, points.wrench)
            pose, balance, *others = self._errors(points, state, theta, rate, acceleration)
            squares = self._squares(by, pose, balance, *others)
            equations.add(points.intervals.start, points.place, *squares)
            missing = np.abs(balance / self._balance) if len(model.tilts) else np.zeros(1)
            here = (
                np.linalg.norm(pose[:, :3], axis=1).max() / WEIGHTS.position,
                np.linalg.norm(pose[:, 3:], axis=1).max() / WEIGHTS.rotation,
                missing.max(),
            )
            worst = np.maximum(worst, here)
        for end in self._ends():
            equations.add_condition(end.start, end.row, end.quantities, end.residual(motion))
        return equations, (float(worst[0]), float(worst[1]), float(worst[2]))

    def _errors(
        self,
        points: _Points,
        state: LinkState,
        theta: np.ndarray,
        rate: np.ndarray,
        acceleration: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return weighted errors: pose (k, 6), balance (k, t), acceleration and angle (k, joints)."""
        model = self._model
        turn = Rotation.from_matrix(state.rotation @ points.rotation.swapaxes(1, 2)).as_rotvec()
        pose = np.hstack(
            [WEIGHTS.position * (state.position - points.position), WEIGHTS.rotation * turn]
        )
        tilts = model.tilts
        spring = model.tilt_stiffness * theta[:, tilts] + model.tilt_damping * rate[:, tilts]
        balance = self._balance * (state.load[:, tilts] + spring)
        relative = acceleration[:, model.chain.drive] - points.rigid_acceleration
        apart = self._tether * (theta[:, model.chain.drive] - points.rigid)
        return pose, balance, WEIGHTS.acceleration * relative, apart

    def _squares(
        self,
        by: LinkDerivatives,
        pose: np.ndarray,
        balance: np.ndarray,
        curvature: np.ndarray,
        apart: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return D^T D and D^T r by theta, theta', theta'' at every point."""
        model = self._model
        count, size = len(pose), model.size
        rows = by.load[:, :, model.tilts]
        each = np.arange(len(model.tilts))
        rows[:, 0, each, model.tilts] += model.tilt_stiffness
        rows[:, 1, each, model.tilts] += model.tilt_damping
        flat = np.ascontiguousarray(rows.transpose(0, 2, 1, 3)).reshape(count, -1, _ORDERS * size)
        flat *= self._balance[:, None]
        squares = (flat.swapaxes(1, 2) @ flat).reshape(count, _ORDERS, size, _ORDERS, size)
        gradient = (balance[:, None] @ flat).reshape(count, _ORDERS, size)
        jacobian = by.jacobian
        jacobian[:, :3] *= WEIGHTS.position
        jacobian[:, 3:] *= WEIGHTS.rotation
        squares[:, 0, :, 0] += jacobian.swapaxes(1, 2) @ jacobian
        gradient[:, 0] += (pose[:, None] @ jacobian)[:, 0]
        drive = model.chain.drive
        squares[:, 2, drive, 2, drive] += WEIGHTS.acceleration**2
        gradient[:, 2, drive] += WEIGHTS.acceleration * curvature
        squares[:, 0, drive, 0, drive] += self._tether**2
        gradient[:, 0, drive] += self._tether * apart
        return squares, gradient

    def _ends(self) -> list[_Condition]:
        """Return the conditions at the ends of the motion.

        A motion that begins at rest has the tilts at rest under their static loads by their equation.
        """
        model, task = self._model, self._task
        # Heavier than everything else, so that it holds to rounding.
        heavy = WEIGHTS.balance * WEIGHTS.position * model.reach
        # Derivatives by the distance of the nodes: all rows are angles.
        value, rate, acceleration = (
            heavy * stencil(np.array(0.0), DEGREE, order)[:DEGREE] for order in range(_ORDERS)
        )
        everything = np.arange(model.size)
        everything, tilts = np.arange(model.size), model.tilts
        conditions: dict[End, list[tuple[np.ndarray, np.ndarray, np.ndarray]]] = {
            "rest": [(row, everything, np.zeros(model.size)) for row in (rate, acceleration)],
            "loaded": [
                (value, tilts, heavy * self._static_tilts),
                (rate, tilts, np.zeros(len(tilts))),
            ],
            "free": [],
        }
        stands = (value, everything, heavy * self._standing) if self._standing is not None else None
        return [
            *(_Condition(0, *condition) for condition in conditions[task.begins]),
            *([] if stands is None else [_Condition(0, *stands)]),
            *(_Condition(task.intervals, *condition) for condition in conditions[task.ends]),
        ]


@dataclass(frozen=True)
class _Condition:
    """A combination of neighbouring coefficients of some quantities that is to have a value."""

    start: int
    row: np.ndarray
    quantities: np.ndarray
    target: np.ndarray

    def residual(self, motion: UniformSpline) -> np.ndarray:
        rows = motion.coefficients[self.start : self.start + len(self.row)]
        residual: np.ndarray = self.row @ rows[:, self.quantities] - self.target
        return residual


def _derivatives(motion: UniformSpline, intervals: range, place: float) -> np.ndarray:
    """Return values, rates and accelerations at one place of several intervals, (3, k, quantities)."""
    weights = np.stack(
        [
            stencil(np.array(place), motion.degree, order) / motion.spacing**order
            for order in range(_ORDERS)
        ]
    )
    count = len(intervals)
    values = np.zeros((_ORDERS, count, motion.coefficients.shape[1]))
    for j, weight in enumerate(weights.T):
        if weight.any():
            rows = motion.coefficients[intervals.start + j : intervals.start + j + count]
            values += weight[:, None, None] * rows
    return values
