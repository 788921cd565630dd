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
_NEAR, _LONGEST = 0.1, 0.4
# Deviations beyond so many times the goal say nothing to a linear robot: nothing behind the first of
# them is watched, but for a while after a window's first miss [s].
_LINEAR, _AT_LEAST = 10.0, 0.1
# Windows, apart from each other, that are changed at once; the earliest, for errors grow on their way.
_AT_ONCE = 4
# Damping of a step, as part of the largest curvature of its sum of squares: at first, by how much it
# grows where a step has not helped, and how often.
_DAMPING, _STRONGER, _TRIES = 1e-5, 5.0, 7
# A window whose sum of squares falls by less than this part is left alone, until the path has been gone
# through; that is done again while it lowers the largest miss to this part.
_WORTH, _SWEPT = 0.03, 0.95
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
        simulations: Simulations at most.
    """

    motion: AlongMotion
    limits: JointLimits
    simulate: Simulate
    watched: Watched
    goal: float
    weights: Weights = field(default_factory=Weights)
    simulations: int = 300

    def run(self, command: UniformSpline) -> UniformSpline:
        """Return the command improved, or as it was.

        Args:
            command: Command within the limits.
        """
        run = _Run(self, command)
        best, least = run.command, run.seen.largest
        sweep, left = least, list[_Window]()
        while run.simulations < self.simulations:
            windows = self._chosen(run.seen, left)
            if not windows:
                if not left or least > _SWEPT * sweep:
                    break
                sweep, left = least, []
                continue
            before = self.costs(run.seen, windows)
            run.improve(windows, before)
            gains = 1.0 - self.costs(run.seen, windows) / before
            left += [w for w, gain in zip(windows, gains, strict=True) if gain < _WORTH]
            if run.seen.largest < least:
                best, least = run.command, run.seen.largest
        return best

    def costs(self, seen: Seen, windows: list[_Window]) -> np.ndarray:
        """Return the weighted sum of squares of what each window watches."""
        costs = []
        for window in windows:
            rows = self.watched.rows(window.begin, window.watched)
            costs.append(np.sum((self.scale * seen.deviation[rows.start : rows.stop]) ** 2))
        return np.array(costs)

    @property
    def scale(self) -> np.ndarray:
        """Weights of position and rotation, (6,)."""
        return np.repeat([self.weights.position, self.weights.rotation], 3)

    def _chosen(self, seen: Seen, left: list[_Window]) -> list[_Window]:
        """Return the earliest stretches that want a change and do not change what others watch."""
        distance = np.linalg.norm(seen.deviation[:, :3], axis=1)
        times = self.watched.times(range(self.watched.count))
        lost = times[distance > _LINEAR * self.goal]
        chosen: list[_Window] = []
        for first, last in self._misses(times[distance > self.goal]):
            behind = lost[lost > first]
            until = max(first + _AT_LEAST, float(behind[0]) if len(behind) else np.inf)
            end = min(last + _AFTER, until)
            window = _Window(first - _BEFORE, end, min(end + _WATCHED, until))
            apart = not chosen or window.begin > chosen[-1].watched
            if apart and not any(window.within(one) for one in left):
                chosen.append(window)
            if chosen and until < np.inf:
                break  # behind it nothing is as it will be
        return chosen[:_AT_ONCE]

    def _misses(self, times: np.ndarray) -> list[tuple[float, float]]:
        """Return first and last of times that are near each other."""
        misses: list[tuple[float, float]] = []
        for time in times.tolist():
            if misses and time - misses[-1][1] < _NEAR and time - misses[-1][0] < _LONGEST:
                misses[-1] = misses[-1][0], time
            else:
                misses.append((time, time))
        return misses


@dataclass(frozen=True)
class _Window:
    """A stretch in which the command may change.

    Attributes:
        begin, end: [s].
        watched: Time until which the tool is watched [s].
    """

    begin: float
    end: float
    watched: float

    def within(self, other: _Window) -> bool:
        """Return whether a window begins in another one."""
        return other.begin - _AFTER < self.begin < other.end


class _Run:
    """A command while it is improved.

    Args:
        polish: Where and how well.
        command: The command as it is.
    """

    def __init__(self, polish: Polish, command: UniformSpline) -> None:
        self._polish = polish
        self.simulations = 0
        self.command, self.seen = command, self._simulated(command)

    def _simulated(self, command: UniformSpline) -> Seen:
        self.simulations += 1
        return self._polish.simulate(command)

    def improve(self, windows: list[_Window], before: np.ndarray) -> None:
        """Change the command in windows, as far as the simulation confirms it.

        What happens in a window depends on those before it and not on those behind, so they are
        decided on in order; one that no step makes better stays as it is.

        Args:
            windows: In order, apart from each other.
            before: Their sums of squares.
        """
        steps = [_Step.of(self._polish, self.command, self.seen, window) for window in windows]
        damping = np.full(len(windows), _DAMPING)
        use, decided = np.ones(len(windows), dtype=bool), 0
        while True:
            trial = self.command.coefficients.copy()
            for step, strength, used in zip(steps, damping, use, strict=True):
                if used:
                    trial[step.free.start : step.free.stop] += step.change(strength)
            command = replace(self.command, coefficients=trial)
            seen = self._simulated(command)
            better = self._polish.costs(seen, windows) < before
            while decided < len(windows) and (better[decided] or not use[decided]):
                decided += 1
            if decided == len(windows):
                self.command, self.seen = command, seen
                return
            damping[decided] *= _STRONGER
            use[decided] = damping[decided] < _DAMPING * _STRONGER**_TRIES


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
            command.start + command.spacing * (free.start - command.degree), window.watched
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
