"""Last improvement of a command: Gauss and Newton's method on the simulated robot, where it misses.

A gear by itself does not feel what the others and the tilts do; the simulated robot does.  Where its
tool leaves the path by more than is wanted, the command's own coefficients around are corrected by what
the robot linearised along its motion promises, within the limits of the drives, as far as the simulation
confirms it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import piqp

from coupling.inverse.joint_limits import JointLimits
from coupling.inverse.links import Weights
from coupling.inverse.response import AlongMotion
from coupling.inverse.spline import UniformSpline

# A window begins so long before the first sample that is too far off and ends so long after the last
# one [s]: what a gear's crossing costs is best prepared before it.
_BEFORE, _AFTER = 0.12, 0.06
# How long the tool is watched after the last change [s].  A link whose gear floats in its play drifts on
# for longer than the robot rings.
_WATCHED = 0.8
# Windows that are closer are joined unless the result is longer [s].
_NEAR, _LONGEST = 0.1, 0.6
# Damping of a step, as part of the largest curvature of its sum of squares: at first, where a step has
# not helped, by how much it grows each time, and how often.
_DAMPING, _STRONGER, _TRIES = 1e-5, 5.0, 8
# A pass that lowers the sum of squares of its windows by less is no gain; after so many the polish ends.
_WORTH, _PATIENCE = 0.05, 3
# Unit of the quadratic programs' unknowns [rad].
_UNIT = 1e-6
# Weight of the command's acceleration beside that of the links'.
_SMOOTH = 0.1


@dataclass(frozen=True)
class Seen:
    """What the moving robot does under a command, at evenly spaced times.

    Attributes:
        deviation: Of the tool from its path [m], [rad], (k, 6).
        deflection: Elastic coordinates [rad], (k, m).
    """

    deviation: np.ndarray
    deflection: np.ndarray

    @property
    def largest(self) -> float:
        """Largest distance from the path [m]."""
        return float(np.linalg.norm(self.deviation[:, :3], axis=1).max())


Simulate = Callable[[UniformSpline], Seen]


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

    @property
    def end(self) -> float:
        """Last time [s]."""
        return self.start + self.spacing * (self.count - 1)

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
    weights: Weights = field(default_factory=Weights)

    def run(self, command: UniformSpline, passes: int = 20) -> UniformSpline:
        """Return the command improved, or as it was.

        Args:
            command: Command within the limits.
            passes: Linearisations at most.
        """
        seen, idle = self.simulate(command), 0
        best, least = command, seen.largest
        tried: list[_Window] = []
        for _ in range(passes):
            windows = [w for w in self._windows(seen) if not any(w.meets(t) for t in tried)]
            if not windows:
                break
            before = self._costs(seen, windows)
            command, seen = self._improved(command, seen, windows)
            gains = 1.0 - self._costs(seen, windows) / before
            if seen.largest < least:
                best, least = command, seen.largest
            # Once the command has changed elsewhere, what did not help may help.
            kept = [] if gains.max() >= _WORTH else tried
            tried = kept + [w for w, gain in zip(windows, gains, strict=True) if gain < _WORTH]
            idle = idle + 1 if gains.max() < _WORTH else 0
            if idle == _PATIENCE:
                break
        return best

    def _costs(self, seen: Seen, windows: list[_Window]) -> np.ndarray:
        """Return the weighted sums of squares from each window until the next, or the end."""
        begins = sorted(window.begin for window in windows)
        costs = []
        for window in windows:
            until = min((begin for begin in begins if begin > window.begin), default=np.inf)
            rows = self.watched.rows(window.begin, min(until, self.watched.end))
            costs.append(np.sum((self.scale * seen.deviation[rows.start : rows.stop]) ** 2))
        return np.array(costs)

    @property
    def scale(self) -> np.ndarray:
        """Weights of position and rotation, (6,)."""
        return np.repeat([self.weights.position, self.weights.rotation], 3)

    def _windows(self, seen: Seen) -> list[_Window]:
        """Return stretches in which the command is to change, the worst first and apart from another."""
        distance = np.linalg.norm(seen.deviation[:, :3], axis=1)
        windows: list[_Window] = []
        for k in np.flatnonzero(distance > self.goal):
            time, size = self.watched.start + self.watched.spacing * float(k), float(distance[k])
            last = windows[-1] if windows else None
            if last and time - last.end < _NEAR and time - last.begin < _LONGEST:
                windows[-1] = _Window(last.begin, time + _AFTER, max(last.worst, size))
            elif last is None or time > last.end:
                windows.append(_Window(time - _BEFORE, time + _AFTER, size))
        chosen: list[_Window] = []
        for window in sorted(windows, key=lambda w: -w.worst):
            if not any(window.meets(other) for other in chosen):
                chosen.append(window)
        return chosen

    def _improved(
        self, command: UniformSpline, seen: Seen, windows: list[_Window]
    ) -> tuple[UniformSpline, Seen]:
        """Return a better command and what it does; where nothing helps it stays as it is."""
        steps = [_Step.of(self, command, seen, window) for window in windows]
        before = self._costs(seen, windows)
        damping = np.full(len(windows), _DAMPING)
        taken = np.ones(len(windows), dtype=bool)
        for attempt in range(_TRIES + 1):
            trial = command.coefficients.copy()
            for step, strength, use in zip(steps, damping, taken, strict=True):
                if use:
                    trial[step.free.start : step.free.stop] += step.change(strength)
            candidate = replace(command, coefficients=trial)
            found = self.simulate(candidate)
            worse = taken & (self._costs(found, windows) >= before)
            if not worse.any():
                return candidate, found
            damping[worse] *= _STRONGER
            if attempt == _TRIES - 1:
                taken &= ~worse
        return command, seen


@dataclass(frozen=True)
class _Window:
    """A stretch in which the command may change.

    Attributes:
        begin, end: [s].
        worst: Largest distance from the path that it is to lower [m].
    """

    begin: float
    end: float
    worst: float

    def meets(self, other: _Window) -> bool:
        """Return whether one of two windows changes what the other watches."""
        return self.begin < other.end + _WATCHED and other.begin < self.end + _WATCHED


@dataclass(frozen=True)
class _Step:
    """Quadratic model of a window's sum of squares, in the changes of its coefficients.

    Attributes:
        free: Numbers of the coefficients that change.
        hessian: (free joints, free joints).
        gradient: (free joints,).
        limits: What the drives can do.
        command: The command as it is.
    """

    free: range
    hessian: np.ndarray
    gradient: np.ndarray
    limits: JointLimits
    command: UniformSpline

    @classmethod
    def of(cls, polish: Polish, command: UniformSpline, seen: Seen, window: _Window) -> _Step:
        """Return the model that the robot linearised about its motion gives."""
        first = int(np.ceil((window.begin - command.start) / command.spacing)) + command.degree
        last = int(np.floor((window.end - command.start) / command.spacing)) - 1
        first, last = max(first, command.degree), min(last, command.intervals - 1)
        free = range(first, max(last, first) + 1)
        rows = polish.watched.rows(
            command.start + command.spacing * (free.start - command.degree), window.end + _WATCHED
        )
        here = slice(rows.start, rows.stop)
        response = polish.motion.response(
            command, free, polish.watched.times(rows), seen.deflection[here]
        )
        joints = command.coefficients.shape[1]
        promised = (polish.scale[:, None, None] * response).reshape(-1, len(free) * joints)
        missing = (polish.scale * seen.deviation[here]).ravel()
        differences = _differences(command, free, 2)
        weight = _SMOOTH * polish.weights.acceleration / command.spacing**2
        curvature = weight * np.kron(differences.change, np.eye(joints))
        bent = weight * differences.present.ravel()
        return cls(
            free,
            promised.T @ promised + curvature.T @ curvature,
            promised.T @ missing + curvature.T @ bent,
            polish.limits,
            command,
        )

    def change(self, damping: float) -> np.ndarray:
        """Return the change of the coefficients that lowers the model most, (free, joints)."""
        size = len(self.gradient)
        damped = self.hessian + damping * self.hessian.diagonal().max() * np.eye(size)
        change = -np.linalg.solve(damped, self.gradient).reshape(len(self.free), -1)
        if self._within(change):
            return change
        return self._bounded(damped).reshape(len(self.free), -1)

    def _within(self, change: np.ndarray) -> bool:
        """Return whether the changed command keeps the limits."""
        drives = enumerate(self._drives(change))
        return all(not np.any(self.limits.of_joint(k).excess(drive) > 0.0) for k, drive in drives)

    def _drives(self, change: np.ndarray) -> Iterator[UniformSpline]:
        """Yield the motion of every drive around the window, changed."""
        command = self.command
        margin = self._margin
        around = slice(self.free.start - margin, self.free.stop + command.degree)
        coefficients = command.coefficients[around].copy()
        coefficients[margin : margin + len(self.free)] += change
        start = command.start + command.spacing * around.start
        for column in coefficients.T:
            yield UniformSpline(start, command.spacing, column[:, None], command.degree)

    @property
    def _margin(self) -> int:
        """Number of coefficients before the window that share intervals with it."""
        return min(self.command.degree, self.free.start)

    def _bounded(self, damped: np.ndarray) -> np.ndarray:
        """Return the best change within the limits of the drives: a quadratic program."""
        rows, lower, upper = [], [], []
        joints, margin = self.command.coefficients.shape[1], self._margin
        for joint, drive in enumerate(self._drives(np.zeros((len(self.free), joints)))):
            changes, low, high = self.limits.of_joint(joint).rows(drive)
            own = changes[:, margin : margin + len(self.free)].toarray()
            touched = np.any(own != 0.0, axis=1)
            rows.append(np.kron(own[touched], np.eye(joints)[joint]))
            # The command as it is keeps the limits but for rounding: no change is always allowed.
            lower.append(np.minimum(low[touched], 0.0))
            upper.append(np.maximum(high[touched], 0.0))
        scale = self.hessian.diagonal().max()
        solver = piqp.DenseSolver()
        solver.settings.eps_abs, solver.settings.eps_rel = 1e-9, 1e-9
        solver.setup(
            damped / scale,
            self.gradient / (scale * _UNIT),
            None,
            None,
            np.vstack(rows),
            np.concatenate(lower) / _UNIT,
            np.concatenate(upper) / _UNIT,
        )
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
