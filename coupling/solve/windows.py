"""Coupling of a process with a memory: marching in time, window by window.

What a tool meets depends on what it did before, so that an iteration over a whole path hands every error
on from turn to turn.  Within a short window a robot hardly moves by what the process answers: there the
iteration converges quickly (waveform relaxation, [Lelarasmee1982]), and the next window begins where
this one has ended.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import SimulationError
from coupling.events import Progress, unwatched
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.process.base import MarchedProcess, ProcessResponse
from coupling.results.iteration_result import Evaluation
from coupling.robot.contract import Advance, MarchingRobot, SimulatedRobot
from coupling.solve.fixed_point import Coupling, Evaluated, Loop, Tolerance, iterate
from coupling.solve.scheme import Outcome
from elastic_robot.fmi.interface import Mode

# Part of the tolerances that a window is iterated to: what is left of it goes on to those that follow.
_SHARE = 0.02
# Evaluations in a window after which a shorter one is tried.
_MOST = 12
# Evaluations from which on the next window is half as long, and up to which it is longer by this factor.
_MANY, _FEW, _LONGER = 7, 4, 1.5
# Parts of the usual window that a window has at most, and the most steps of it.
_TURNS, _STEPS = 8.0, 500
# Windows between two notes of the progress.
_NOTED = 20
_WRENCH = 6  # columns


class _WindowRobot:
    """Robots within a window, simulated from its beginning as often as they are asked.

    Args:
        advance: Their simulation.
    """

    def __init__(self, advance: Advance) -> None:
        self._advance = advance
        self._is_repeat = False

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        """Return the paths of the TCPs within the window.

        Raises:
            SimulationError: If a robot cannot be simulated.
        """
        is_repeat, self._is_repeat = self._is_repeat, True
        return self._advance(wrench, is_repeat)

    def go_on(self) -> None:
        """Let the next window begin where this one has ended."""
        self._is_repeat = False


@dataclass(frozen=True)
class _WindowProcess:
    """A process within a window, whose past is known.

    Attributes:
        process: The process.
        time: Times before the window and within it [s], (k,).
        pose: Poses of the TCPs then, of which those within it change, (tools, k, 7).
        first: Wrenches at the window's beginning, (tools, 1, 6).
        identity: Empty: its answers are not kept.
    """

    process: MarchedProcess
    time: np.ndarray
    pose: np.ndarray
    first: np.ndarray
    identity: str = ""

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return its answer to the paths within the window."""
        since = len(self.time) - len(path.time) + 1
        self.pose[:, since - 1 :] = path.pose
        means = self.process.means(self.time, self.pose, since)
        return ProcessResponse(
            WrenchHistory.of_means(path.time, np.concatenate([self.first, means], axis=1))
        )


def march(
    loop: Loop[SimulatedRobot], process: MarchedProcess, command: JointPath, start: ToolPath
) -> Coupling:
    """Couple a robot with a process that has a memory, window by window.

    Args:
        loop: Robot and process; its scheme is that within a window.
        command: Motion of the drives.
        start: First paths, whose times are the steps.

    Returns:
        The result.  Where a window does not converge, however short, it is that under the wrench on the
        first paths: what an iteration that fails has come to is no result.

    Raises:
        SimulationError: If the robot cannot be simulated at all.
    """
    marching = _March(loop, process, command, start)
    outcome, reason = marching.run()
    if outcome is not Outcome.CONVERGED:
        response = process.evaluate(start)
        path = loop.robot.simulate(command, response.wrench, loop.mode)
        evaluation = Evaluation.of(1, start, path, response.wrench, None)
        reason += "; what follows is under the wrench on the path without it"
        return Coupling(outcome, reason, path, response, (evaluation,), evaluation)
    path = ToolPath(start.time, marching.pose)
    wrench = WrenchHistory.of_means(start.time, marching.means)
    evaluations = marching.evaluations(wrench.peak_force)
    for evaluation in evaluations:
        loop.watch(Evaluated(evaluation, path))
    response = ProcessResponse(wrench, period=process.memory.period)
    return Coupling(outcome, reason, path, response, evaluations, evaluations[-1])


class _March:
    """What `march` has come to.

    Args:
        loop, process, command, start: As of `march`.

    Attributes:
        pose: Poses of the TCPs, up to where it is, (tools, n, 7).
        means: Mean wrenches over the steps up to there [N, N m], (tools, n, 6).
    """

    def __init__(
        self,
        loop: Loop[SimulatedRobot],
        process: MarchedProcess,
        command: JointPath,
        start: ToolPath,
    ) -> None:
        self._process, self._command, self._start = process, command, start
        self._watch, self._robot, self._mode = loop.watch, loop.robot, loop.mode
        limits = loop.tolerance
        tolerance = Tolerance(_SHARE * limits.path, _SHARE * limits.rms, limits.force)
        most = min(loop.max_evaluations, _MOST)
        self._loop = replace(loop, tolerance=tolerance, max_evaluations=most, watch=unwatched)
        self._time = start.time
        self._step = float(np.diff(start.time).max())
        self.pose = start.pose.copy()
        self.means = np.zeros((*start.pose.shape[:2], _WRENCH))
        self._windows: list[tuple[Evaluation, ...]] = []

    def run(self) -> tuple[Outcome, str]:
        """March to the end, and return how that ended."""
        if not isinstance(self._robot, MarchingRobot):
            raise SimulationError("expected a robot that can be simulated window by window")
        two = self._time[:2], self._start.pose[:, :2]
        self.means[:, :1] = self._process.means(*two, 0)[:, :1]
        at_start = WrenchHistory(self._time[:2], self.means[:, :2])
        robot = _WindowRobot(
            self._robot.march(self._command, at_start, float(self._time[-1]), self._mode)
        )
        row, last = 0, len(self._time) - 1
        steps = self._steps(self._process.memory.window)
        while row < last:
            end = min(row + steps, last)
            outcome, reason = self._pass(robot, row, end)
            if outcome is Outcome.CONVERGED:
                robot.go_on()
                row, steps = end, self._next(steps)
                if len(self._windows) % _NOTED == 0 or row == last:
                    self._watch(Progress("coupling robot and process in windows", row, last))
            elif steps == 1:
                return outcome, (
                    f"a step of {1e3 * self._step:.3g} ms at t = {self._time[row]:.4g} s does not"
                    f" converge: {reason}"
                )
            else:
                steps = max(min(steps, end - row) // 2, 1)
        count = len(self._windows)
        mean = sum(map(len, self._windows)) / count
        return Outcome.CONVERGED, (
            f"converged in {count} windows of {1e3 * np.ptp(self._time) / count:.3g} ms, {mean:.2g}"
            " evaluations of the process in each"
        )

    def evaluations(self, peak: float) -> tuple[Evaluation, ...]:
        """Return the evaluations of all windows, the first of each of them as one, and so on.

        Args:
            peak: Largest force on the whole path [N].
        """
        return tuple(
            _together(
                number, [window[min(number, len(window)) - 1] for window in self._windows], peak
            )
            for number in range(1, max(map(len, self._windows)) + 1)
        )

    def _pass(self, robot: _WindowRobot, row: int, end: int) -> tuple[Outcome, str]:
        """Couple within a window, from row to row, and return how that ended."""
        rows = np.arange(row, end + 1)
        ahead = self._start.at_rows(rows)
        here = ToolPath(ahead.time[:2], self.pose[:, [row, row]])
        deviation = here.deviation_from(ToolPath(here.time, ahead.pose[:, [0, 0]]))[:, :1]
        guess = ahead.displaced(deviation)
        guess.pose[:, 0] = self.pose[:, row]
        oldest = np.searchsorted(self._time, self._time[row] - self._process.memory.length) - 1
        past_rows = slice(max(int(oldest), 0), end + 1)
        process = _WindowProcess(
            self._process, self._time[past_rows], self.pose[:, past_rows], self.means[:, [row]]
        )
        loop = replace(self._loop, robot=robot, process=process)
        try:
            coupling = iterate(loop, self._command, guess)
        except SimulationError as error:
            return Outcome.ROBOT_FAILED, f"the robot cannot be simulated ({error})"
        if coupling.converged:
            self.pose[:, row + 1 : end + 1] = coupling.path.pose[:, 1:]
            self.means[:, row + 1 : end + 1] = coupling.response.wrench.before[:, 1:]
            self._windows.append(coupling.evaluations)
        return coupling.outcome, coupling.reason

    def _steps(self, span: float) -> int:
        """Return the number of steps in a time [s], one at least."""
        return max(int(span / self._step), 1)

    def _next(self, steps: int) -> int:
        """Return the number of steps of the next window."""
        evaluations = len(self._windows[-1])
        if evaluations >= _MANY:
            return max(steps // 2, 1)
        longest = min(self._steps(_TURNS * self._process.memory.window), _STEPS)
        return min(int(np.ceil(_LONGER * steps)), longest) if evaluations <= _FEW else steps


def _together(number: int, parts: list[Evaluation], peak: float) -> Evaluation:
    """Return evaluations of windows as one of the whole path.

    Args:
        peak: Largest force on it [N].
    """
    worst = max(parts, key=lambda part: part.path_change)
    changes = [part.force_change * part.peak_force for part in parts if part.peak_force > 0.0]
    return Evaluation(
        number=number,
        path_change=worst.path_change,
        path_change_rms=float(np.sqrt(np.mean([part.path_change_rms**2 for part in parts]))),
        force_change=max(changes, default=0.0) / peak if peak > 0.0 else 0.0,
        peak_force=max(part.peak_force for part in parts),
        worst_time=worst.worst_time,
    )
