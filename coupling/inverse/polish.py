"""Last improvement of a command: Gauss and Newton's method on the simulated robot, where it misses.

A gear by itself does not feel what the others and the tilts do; the simulated robot does.  Where its
tool leaves the path by more than is wanted, the command's own coefficients around are corrected by what
the robot linearised along its motion promises, within the limits of the drives, as far as the simulation
confirms it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coupling.inverse.limits import JointLimits
from coupling.inverse.links import Weights
from coupling.inverse.response import AlongMotion
from coupling.inverse.spline import UniformSpline

# A window begins so long before the first sample that is too far off and ends so long after the last
# one [s]: what a gear's crossing costs is best prepared before it.
_BEFORE, _AFTER = 0.12, 0.06
# How long the tool is watched after the last change [s]: most of a period of the slowest mode.
_RINGING = 0.1
# Windows that are closer are joined, longer ones are cut [s].
_LONGEST = 0.6
# A step is halved at most so often.
_HALVINGS = 5
# A pass that lowers the sum of squares by less is the last one.
_WORTH = 0.05

# Deviation of position [m] and rotation [rad] of the tool under a command at evenly spaced times, (k, 6).
Simulate = Callable[[UniformSpline], np.ndarray]


@dataclass(frozen=True)
class Watched:
    """Times at which the tool is watched: even ones from a start.

    Attributes:
        start, spacing: [s].
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
        """Return the times of numbers [s]."""
        times: np.ndarray = self.start + self.spacing * np.arange(rows.start, rows.stop)
        return times


@dataclass(frozen=True)
class Polish:
    """Where and how well a command is to be improved.

    Attributes:
        motion: The motion about which the robot is linearised.
        limits: What the drives can do.
        simulate: Runs a command on the moving robot.
        watched: Times of what it answers.
        goal: Distance from the path that is left alone [m].
        weights: What counts how much.
    """

    motion: AlongMotion
    limits: JointLimits
    simulate: Simulate
    watched: Watched
    goal: float
    weights: Weights = Weights()

    def run(self, command: UniformSpline, passes: int = 8) -> UniformSpline:
        """Return the command improved, or as it was.

        Args:
            command: Command within the limits.
            passes: Linearisations at most.
        """
        deviation = self.simulate(command)
        before = self._cost(deviation).sum()
        for number in range(passes):
            windows = self._windows(deviation)
            if not windows:
                break
            # Neighbours wait for each other: the tool still rings from one where the next begins.
            command, deviation = self._improved(
                command, deviation, windows[number % 2 :: 2] or windows
            )
            after = self._cost(deviation).sum()
            if number % 2 and after > (1.0 - _WORTH) * before:
                break
            if number % 2:
                before = after
        return command

    def _cost(self, deviation: np.ndarray) -> np.ndarray:
        """Return the weighted sum of squares at each time."""
        weights = self._scale()
        cost: np.ndarray = np.sum((weights * deviation) ** 2, axis=1)
        return cost

    def _scale(self) -> np.ndarray:
        return np.repeat([self.weights.position, self.weights.rotation], 3)

    def _windows(self, deviation: np.ndarray) -> list[tuple[float, float]]:
        """Return the stretches in which the command is to change [s]."""
        off = np.linalg.norm(deviation[:, :3], axis=1) > self.goal
        times = self.watched.times(range(self.watched.count))[off]
        windows: list[tuple[float, float]] = []
        for time in times.tolist():
            begin, end = time - _BEFORE, time + _AFTER
            if windows and begin < windows[-1][1] + _RINGING and end - windows[-1][0] < _LONGEST:
                windows[-1] = windows[-1][0], end
            elif not windows or end > windows[-1][1]:
                windows.append((max(begin, windows[-1][1]) if windows else begin, end))
        return windows

    def _improved(
        self, command: UniformSpline, deviation: np.ndarray, windows: list[tuple[float, float]]
    ) -> tuple[UniformSpline, np.ndarray]:
        """Return a better command and its deviation; windows that promise but do not keep stay."""
        steps = [self._step(command, deviation, window) for window in windows]
        gains = np.ones(len(windows))
        rows = [self.watched.rows(a, b + _RINGING) for a, b in windows]
        cost = self._cost(deviation)
        best, found = command, deviation
        for _ in range(_HALVINGS):
            trial = command.coefficients.copy()
            for gain, (free, step) in zip(gains, steps, strict=True):
                trial[free.start : free.stop] += gain * step
            candidate = UniformSpline(command.start, command.spacing, trial, command.degree)
            answer = self.simulate(candidate)
            changed = self._cost(answer)
            worse = [changed[r].sum() > cost[r].sum() for r in rows]
            if changed.sum() < self._cost(found).sum():
                best, found = candidate, answer
            if not any(worse):
                break
            gains[worse] *= 0.25
        return best, found

    def _step(
        self, command: UniformSpline, deviation: np.ndarray, window: tuple[float, float]
    ) -> tuple[range, np.ndarray]:
        """Return the coefficients of a window and their change that the linear robot asks for."""
        begin, end = window
        first = int(np.ceil((begin - command.start) / command.spacing)) + command.degree
        last = int(np.floor((end - command.start) / command.spacing)) - 1
        last = min(last, command.intervals - 1)
        free = range(max(first, command.degree), max(last, first) + 1)
        rows = self.watched.rows(begin, end + _RINGING)
        response = self.motion.response(command, free, self.watched.times(rows))
        joints = command.coefficients.shape[1]
        scale = self._scale()
        promised = (scale[:, None, None] * response).reshape(-1, len(free) * joints)
        missing = (scale * deviation[rows.start : rows.stop]).ravel()
        differences = _second_differences(command, free)
        curvature = self.weights.acceleration * 0.1 * np.kron(differences.change, np.eye(joints))
        bent = self.weights.acceleration * 0.1 * differences.present.ravel()
        hessian = promised.T @ promised + curvature.T @ curvature
        gradient = promised.T @ missing + curvature.T @ bent
        step = -np.linalg.solve(
            hessian + 1e-12 * np.trace(hessian) * np.eye(len(hessian)), gradient
        )
        return free, step.reshape(len(free), joints)


@dataclass(frozen=True)
class _Differences:
    """Second derivatives' control points that some coefficients change, and how: (k, free)."""

    present: np.ndarray
    change: np.ndarray


def _second_differences(command: UniformSpline, free: range) -> _Differences:
    first, last = max(free.start - 2, 0), min(free.stop, len(command.coefficients) - 2)
    count = last - first
    rows = np.zeros((count, len(command.coefficients[first : last + 2])))
    for k in range(count):
        rows[k, k : k + 3] = 1.0, -2.0, 1.0
    rows /= command.spacing**2
    present = rows @ command.coefficients[first : last + 2]
    change = rows[:, free.start - first : free.stop - first]
    return _Differences(present, change)
