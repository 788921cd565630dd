"""One step of the polish: what the linear robot promises of changes of a command in a window."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import piqp
from scipy import sparse

from coupling.inverse.joint_limits import JointLimits
from coupling.inverse.link_task import OF_ACCELERATION, OF_POSITION, OF_ROTATION
from coupling.inverse.response import AlongMotion
from coupling.inverse.spline import UniformSpline

# Unit of the quadratic programs' unknowns [rad].
_UNIT = 1e-6
# Windows that begin within this time are one [s].
_HARDLY = 0.06
# Weight of the command's acceleration beside that of the links'.
_SMOOTH = 0.1


@dataclass(frozen=True)
class RobotResponse:
    """Motion of the moving robot under a command, at evenly spaced times.

    Attributes:
        deviation: Deviation of the tool from its path [m], [rad], (k, 6).
        deflection: Elastic coordinates [rad], (k, m).
    """

    deviation: np.ndarray
    deflection: np.ndarray

    @property
    def largest(self) -> float:
        """Largest distance from the path [m]."""
        return float(np.linalg.norm(self.deviation[:, :3], axis=1).max())


@dataclass(frozen=True)
class ObservedTimes:
    """Times at which the tool is watched: even ones from a start.

    Attributes:
        start, spacing: First time, distance of the times [s].
        count: Number of times.
    """

    start: float
    spacing: float
    count: int

    def rows(self, begin: float, end: float) -> range:
        """Return the numbers of the times in a stretch."""
        first = max(0, int(np.ceil((begin - self.start) / self.spacing)))
        last = min(self.count - 1, int(np.floor((end - self.start) / self.spacing)))
        return range(first, last + 1)

    def times(self, rows: range) -> np.ndarray:
        """Return the times of row numbers [s], (k,)."""
        times: np.ndarray = self.start + self.spacing * np.arange(rows.start, rows.stop)
        return times


@dataclass(frozen=True)
class Observation:
    """Observation of a robot while its command is polished.

    Attributes:
        motion: The motion about which the robot is linearised.
        limits: Limits of the drives.
        watched: Times at which the simulated tool is watched.
    """

    motion: AlongMotion
    limits: JointLimits
    watched: ObservedTimes

    @property
    def scale(self) -> np.ndarray:
        """Weights of position and rotation, (6,)."""
        return np.repeat([OF_POSITION, OF_ROTATION], 3)


@dataclass(frozen=True)
class Window:
    """A stretch in which the command may change.

    Attributes:
        begin, end: First and last time [s].
        watched: Time until which the tool is watched [s].
    """

    begin: float
    end: float
    watched: float

    def within(self, other: Window) -> bool:
        """Return whether a window begins in another one, or hardly before."""
        return other.begin - _HARDLY < self.begin < other.end


@dataclass(frozen=True)
class Step:
    """Quadratic model of a window's sum of squares, in the changes of its coefficients.

    Attributes:
        free: Numbers of the coefficients that change.
        hessian: Second derivatives [1/rad^2], (free joints, free joints).
        gradient: First derivatives [1/rad], (free joints,).
        limits: Limits of the drives.
        command: The command as it is.
    """

    free: range
    hessian: np.ndarray
    gradient: np.ndarray
    limits: JointLimits
    command: UniformSpline

    @classmethod
    def of(
        cls, view: Observation, command: UniformSpline, response: RobotResponse, window: Window
    ) -> Step:
        """Return the model that the robot linearised about its motion gives."""
        first = int(np.ceil((window.begin - command.start) / command.spacing)) + command.degree
        last = int(np.floor((window.end - command.start) / command.spacing)) - 1
        first, last = max(first, command.degree), min(last, command.intervals - 1)
        free = range(first, max(last, first) + 1)
        rows = view.watched.rows(
            command.start + command.spacing * (free.start - command.degree), window.watched
        )
        here = slice(rows.start, rows.stop)
        by_change = view.motion.response(
            command,
            free,
            view.watched.times(rows),
            response.deflection[here],
            response.deflection[: rows.start + 1],
        )
        joints = command.coefficients.shape[1]
        promised = (view.scale[:, None, None] * by_change).reshape(-1, len(free) * joints)
        missing = (view.scale * response.deviation[here]).ravel()
        differences = _differences(command, free, 2)
        weight = _SMOOTH * OF_ACCELERATION / command.spacing**2
        curvature = weight * np.kron(differences.change, np.eye(joints))
        bent = weight * differences.present.ravel()
        return cls(
            free,
            promised.T @ promised + curvature.T @ curvature,
            promised.T @ missing + curvature.T @ bent,
            view.limits,
            command,
        )

    def change(self, damping: float) -> np.ndarray:
        """Return the change of the coefficients that lowers the model most [rad], (free, joints).

        Few limits bind: a quadratic program under those that the best change passes, again as long as
        its answer passes others, finds what all of them together would.
        """
        damped = self.hessian + damping * self.hessian.diagonal().max() * np.eye(len(self.gradient))
        change = -np.linalg.solve(damped, self.gradient)
        rows, low, high = self._limits
        bound = np.zeros(len(low), dtype=bool)
        while True:
            moved = rows @ change
            over = ((moved < low) | (moved > high)) & ~bound
            if not over.any():
                return change.reshape(len(self.free), -1)
            bound |= over
            change = self._bounded(damped, rows[bound].toarray(), low[bound], high[bound])

    @cached_property
    def _limits(self) -> tuple[sparse.csr_array, np.ndarray, np.ndarray]:
        """Limits of the drives on a change (n,):  low <= rows @ change <= high [rad]."""
        command, free = self.command, self.free
        # Coefficients before the window that share intervals with it.
        margin = min(command.degree, free.start)
        around = command.coefficients[free.start - margin : free.stop + command.degree]
        rows, lower, upper = [], [], []
        for joint, own in enumerate(np.eye(around.shape[1])):
            drive = UniformSpline(0.0, command.spacing, around[:, [joint]], command.degree)
            each, low, high = self.limits.of_joint(joint).rows(drive)
            rows.append(sparse.kron(each[:, margin : margin + len(free)], own[None], format="csr"))
            # The command as it is keeps the limits but for rounding: no change is always allowed.
            lower.append(np.minimum(low, 0.0))
            upper.append(np.maximum(high, 0.0))
        return sparse.vstack(rows, format="csr"), np.concatenate(lower), np.concatenate(upper)

    def _bounded(
        self, damped: np.ndarray, rows: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> np.ndarray:
        """Return the best change under some limits [rad], (n,): a quadratic program."""
        scale = self.hessian.diagonal().max()
        solver = piqp.DenseSolver()
        solver.settings.eps_abs, solver.settings.eps_rel = 1e-9, 1e-9
        gradient = self.gradient / (scale * _UNIT)
        solver.setup(damped / scale, gradient, None, None, rows, low / _UNIT, high / _UNIT)
        if solver.solve() != piqp.PIQP_SOLVED:
            return np.zeros(len(self.gradient))
        change: np.ndarray = _UNIT * solver.result.x
        return change


@dataclass(frozen=True)
class _Differences:
    """Differences of coefficients, (k, joints), and how some coefficients change them, (k, free)."""

    present: np.ndarray
    change: np.ndarray


def _differences(command: UniformSpline, free: range, order: int) -> _Differences:
    """Return the differences of an order that some coefficients change."""
    first, stop = max(free.start - order, 0), min(free.stop + order, len(command.coefficients))
    rows = np.diff(np.eye(stop - first), order, axis=0)
    present = np.diff(command.coefficients[first:stop], order, axis=0)
    return _Differences(present, rows[:, free.start - first : free.stop - first])
