"""Last improvement of a command: Gauss and Newton's method on the simulated robot, where it misses.

A gear by itself does not feel what the others and the tilts do; the simulated robot does.  Where its
tool leaves the path by more than is wanted, the command's own coefficients around are corrected by what
the robot linearised along its motion promises, within the limits of the drives, as far as the simulation
confirms it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from coupling.inverse.polish_step import Observation, RobotResponse, Step, Window
from coupling.inverse.spline import UniformSpline

# A window begins so long before the first sample that is too far off and ends so long after the last
# one [s]: what a gear's crossing costs is best prepared before it.
_BEFORE, _AFTER = 0.12, 0.06
# How long the tool is watched after the last change [s].  A link whose gear is unloaded in its backlash
# drifts on for longer than the robot rings.
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

Simulate = Callable[[UniformSpline], RobotResponse]


@dataclass(frozen=True)
class Polish:
    """Improvement of a command: its observation and its goal.

    Attributes:
        view: Observation of the robot.
        simulate: Response of the moving robot to a command, at the view's times.
        goal: Distance from the path that is left alone [m].
        simulations: Simulations at most.
    """

    view: Observation
    simulate: Simulate
    goal: float
    simulations: int = 300

    def run(self, command: UniformSpline) -> UniformSpline:
        """Return the command improved, or as it was.

        Args:
            command: Command within the limits.
        """
        run = _Run(self, command)
        best, least = run.command, run.response.largest
        sweep, left = least, list[Window]()
        while run.simulations < self.simulations:
            windows = self._chosen(run.response, left)
            if not windows:
                if not left or least > _SWEPT * sweep:
                    break
                sweep, left = least, []
                continue
            before = self.costs(run.response, windows)
            run.improve(windows, before)
            gains = 1.0 - self.costs(run.response, windows) / before
            left += [w for w, gain in zip(windows, gains, strict=True) if gain < _WORTH]
            if run.response.largest < least:
                best, least = run.command, run.response.largest
        return best

    def costs(self, response: RobotResponse, windows: list[Window]) -> np.ndarray:
        """Return the weighted sum of squares of what each window watches [1], (windows,)."""
        costs = []
        for window in windows:
            rows = self.view.watched.rows(window.begin, window.watched)
            costs.append(
                np.sum((self.view.scale * response.deviation[rows.start : rows.stop]) ** 2)
            )
        return np.array(costs)

    def _chosen(self, response: RobotResponse, left: list[Window]) -> list[Window]:
        """Return the earliest stretches that want a change and do not change what others watch."""
        distance = np.linalg.norm(response.deviation[:, :3], axis=1)
        times = self.view.watched.times(range(self.view.watched.count))
        lost = times[distance > _LINEAR * self.goal]
        chosen: list[Window] = []
        for first, last in self._misses(times[distance > self.goal]):
            behind = lost[lost > first]
            until = max(first + _AT_LEAST, float(behind[0]) if len(behind) else np.inf)
            end = min(last + _AFTER, until)
            window = Window(first - _BEFORE, end, min(end + _WATCHED, until))
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


class _Run:
    """A command while it is improved.

    Args:
        polish: Observation and goal.
        command: The command as it is.
    """

    def __init__(self, polish: Polish, command: UniformSpline) -> None:
        self._polish = polish
        self.simulations = 0
        self.command, self.response = command, self._simulated(command)

    def _simulated(self, command: UniformSpline) -> RobotResponse:
        self.simulations += 1
        return self._polish.simulate(command)

    def improve(self, windows: list[Window], before: np.ndarray) -> None:
        """Change the command in windows, as far as the simulation confirms it.

        What happens in a window depends on those before it and not on those behind, so they are
        decided on in order; one that no step makes better stays as it is.

        Args:
            windows: Windows in order, apart from each other.
            before: Their sums of squares [1], (windows,).
        """
        steps = [
            Step.of(self._polish.view, self.command, self.response, window) for window in windows
        ]
        damping = np.full(len(windows), _DAMPING)
        use, decided = np.ones(len(windows), dtype=bool), 0
        while True:
            trial = self.command.coefficients.copy()
            for step, strength, used in zip(steps, damping, use, strict=True):
                if used:
                    trial[step.free.start : step.free.stop] += step.change(strength)
            command = replace(self.command, coefficients=trial)
            response = self._simulated(command)
            better = self._polish.costs(response, windows) < before
            while decided < len(windows) and (better[decided] or not use[decided]):
                decided += 1
            if decided == len(windows):
                self.command, self.response = command, response
                return
            damping[decided] *= _STRONGER
            use[decided] = damping[decided] < _DAMPING * _STRONGER**_TRIES
