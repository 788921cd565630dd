"""The weak coupling: robot and process in turn, over the whole path, until nothing changes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Generic, TypeVar

import numpy as np

from coupling.errors import ProcessError, SimulationError
from coupling.events import Event, Watch, unwatched
from coupling.path.controller import Controller
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.path.length_text import format_um
from coupling.process.base import Process, ProcessResponse
from coupling.results.iteration_result import Evaluation
from coupling.robot.contract import SimulatedRobot
from coupling.solve.scheme import Iterate, Outcome, Scheme
from coupling.solve.schemes import SCHEMES
from elastic_robot.fmi.interface import Mode

RobotT_co = TypeVar("RobotT_co", bound=SimulatedRobot, covariant=True)


@dataclass(frozen=True)
class Tolerance:
    """Tolerances of a converged iteration, all three at once.

    Attributes:
        path: Largest change of a TCP position between process input and robot output [m].
        rms: Root mean square of that change [m].
        force: Largest change of force between two evaluations, relative to the peak force.
    """

    path: float = 1e-6
    rms: float = 5e-7
    force: float = 1e-3


@dataclass(frozen=True)
class Loop(Generic[RobotT_co]):
    """A robot and its process, and how the loop that they form is solved.

    Attributes:
        robot: Simulates a command under a wrench.
        process: Gives the wrench of a path.
        mode: "dynamic" or "quasistatic": how the robot is simulated.
        scheme: Relaxation; every coupling resets it first.
        tolerance: Limits at which a coupling ends.
        max_evaluations: Evaluations of the process at most, in each coupling.
        controller: The robot's controller: a command is rows on its cycle.
        watch: Function called with every evaluation.
    """

    robot: RobotT_co
    process: Process
    mode: Mode
    scheme: Scheme = field(default_factory=SCHEMES["robin"])
    tolerance: Tolerance = field(default_factory=Tolerance)
    max_evaluations: int = 40
    controller: Controller = field(default_factory=Controller)
    watch: Watch = unwatched


@dataclass(frozen=True)
class Evaluated(Event):
    """The process was evaluated and the robot has answered.

    Attributes:
        evaluation: Its figures.
        path: The robot's answer.
    """

    evaluation: Evaluation
    path: ToolPath


@dataclass(frozen=True)
class Coupling:
    """Result of a weak coupling.

    Attributes:
        outcome: Outcome of the iteration.
        reason: Reason in plain words; if not converged, what was seen and what to try.
        path: Paths of the TCPs under `response`: robot and wrench belong together exactly where it
            converged.
        response: The process's answer to the path of `evaluation`, `path` within the tolerance.  Where
            it did not converge, springs have moved the robots as well, whose forces are not in it.
        evaluations: Evaluations on the way there.
        evaluation: Evaluation of path and response: the last one, or where the iteration came to nothing
            an earlier one, as what it has come to is no result.
    """

    outcome: Outcome
    reason: str
    path: ToolPath
    response: ProcessResponse
    evaluations: tuple[Evaluation, ...]
    evaluation: Evaluation

    @property
    def converged(self) -> bool:
        """Whether the tolerance was met."""
        return self.outcome is Outcome.CONVERGED


@dataclass(frozen=True)
class _State:
    """What an evaluation has led to: paths of the TCPs, under the response and the springs on the way.

    Attributes:
        loads: All loads on the robots, their springs at rest on `path`.
        response: The process's answer.
    """

    path: ToolPath
    loads: WrenchHistory
    response: ProcessResponse
    evaluation: Evaluation

    def response_of(self, outcome: Outcome) -> ProcessResponse:
        """Return the response that an outcome has for a result."""
        if outcome is Outcome.CONVERGED:
            return replace(self.response, wrench=self.loads)
        wrench = self.response.wrench.refined(self.path.time)
        return replace(self.response, wrench=replace(wrench, spring=self.loads.spring))


@dataclass(frozen=True)
class _States:
    """States of an iteration: the first, of others that with the smallest path change, and the last.

    A scheme may begin with a small step: the first path change does not tell how near the end is.
    """

    first: _State
    best: _State
    last: _State

    @classmethod
    def after(cls, before: _States | None, state: _State) -> _States:
        """Return them with one more state."""
        if before is None:
            return cls(state, state, state)
        is_better = (
            before.best is before.first
            or state.evaluation.path_change < before.best.evaluation.path_change
        )
        return cls(before.first, state if is_better else before.best, state)

    def of(self, outcome: Outcome) -> _State:
        """Return the state that is the result of an outcome: what has diverged is none."""
        if outcome in (Outcome.DIVERGED, Outcome.ROBOT_FAILED):
            return self.first
        if outcome in (Outcome.STAGNATED, Outcome.LIMIT_CYCLE):
            return self.best
        return self.last


# Growth of the path change over its first values that counts as divergence; the first of all may be
# small because a scheme begins with care.
_DIVERGED = 10.0
# Evaluations without a smaller path change that count as stagnation.
_PATIENCE = 12
# A stagnating path change that stays within this ratio is a limit cycle.
_CYCLE = 4.0
_ADVICE = "; use another scheme (docs/robin.md), or a smaller relaxation"
# Largest contraction of a path change that is believed: what is left is then 9 changes.
_SLOWEST = 0.9
# What springs may carry, over the force tolerance: a gear that is unloaded in its backlash is held where
# the process hardly says where it should be.
_CARRIED = 20.0


def iterate(
    loop: Loop[SimulatedRobot],
    command: JointPath,
    start: ToolPath,
    rows: np.ndarray | None = None,
) -> Coupling:
    """Find the path x = G(process(x)) by an iteration along the whole path.

    Args:
        loop: Robot and process.
        command: Motion of the drives.
        start: First path, whose times are those of all paths and wrenches.
        rows: Row numbers of the process's samples in them, (n,); all of them unless given.

    Returns:
        The result, converged or not.

    Raises:
        SimulationError: If the robot cannot be simulated at all.
        ProcessError: If the process has no answer to the first path; a later failure is a result.
    """
    loop.scheme.reset()
    x = origin = start
    rows = np.arange(len(x.time)) if rows is None else rows
    states: _States | None = None
    last: WrenchHistory | None = None
    evaluations: list[Evaluation] = []

    def ended(outcome: Outcome, reason: str) -> Coupling:
        assert states is not None
        state = states.of(outcome)
        if state is not states.last:
            reason += f"; path and forces are those of evaluation {state.evaluation.number}"
        response = state.response_of(outcome)
        return Coupling(outcome, reason, state.path, response, tuple(evaluations), state.evaluation)

    for number in range(1, loop.max_evaluations + 1):
        try:
            response = loop.process.evaluate(x.at_rows(rows))
            evaluated = Iterate(x, rows, response)
            motion = loop.scheme.move_robot(loop.robot, command, evaluated, loop.mode)
        except (ProcessError, SimulationError) as error:
            if states is None:
                raise
            return ended(*_failure(error, number))
        g, loads, acting = motion.path, motion.loads.on(motion.path), evaluated.loads
        spring_change = _change_at(rows, loads, acting)
        evaluations.append(Evaluation.of(number, x, g, acting, last, spring_change))
        state = _State(g, loads, response, evaluations[-1])
        states = _States.after(states, state)
        last = acting
        loop.watch(Evaluated(evaluations[-1], g))
        from_origin = x.deviation_from(origin)
        update = loop.scheme.update(from_origin, g.deviation_from(origin))
        ahead = float(np.sqrt(np.mean(np.sum((update - from_origin)[..., :3] ** 2, axis=-1))))
        if _meets_tolerance(evaluations, loop.tolerance, ahead, springs=loads.spring is not None):
            return ended(Outcome.CONVERGED, f"converged in {number} evaluations of the process")
        trouble = _trouble(evaluations, states.best.evaluation.number, x, g)
        if trouble is not None:
            return ended(*trouble)
        x = origin.displaced(update)
    reason = f"not converged within {loop.max_evaluations} evaluations of the process"
    return ended(Outcome.EXHAUSTED, reason)


def unloaded_path(loop: Loop[SimulatedRobot], command: JointPath, time: np.ndarray) -> ToolPath:
    """Return the path of the robot under gravity alone, at given times [s], (n,).

    Raises:
        SimulationError: If the robot cannot be simulated.
    """
    none = WrenchHistory.none(time, len(command.q))
    return loop.robot.simulate(command, none, loop.mode)


def _change_at(rows: np.ndarray, loads: WrenchHistory, acting: WrenchHistory) -> float:
    """Return the largest difference of forces at the process's samples, over the larger peak force."""
    change = loads.before[:, rows, :3] - acting.before[:, rows, :3]
    largest = float(np.linalg.norm(change, axis=-1).max())
    return largest / max(loads.peak_force, acting.peak_force) if largest > 0.0 else 0.0


def _failure(error: ProcessError | SimulationError, number: int) -> tuple[Outcome, str]:
    if isinstance(error, ProcessError):
        return Outcome.PROCESS_FAILED, f"the process failed in evaluation {number}: {error}"
    reason = f"diverged: the robot cannot follow the iteration any more ({error}){_ADVICE}"
    return Outcome.ROBOT_FAILED, reason


def _meets_tolerance(
    evaluations: list[Evaluation], tolerance: Tolerance, ahead: float, springs: bool
) -> bool:
    """Return whether the tolerance is met; `ahead` is the step that the scheme would take, rms [m]."""
    last = evaluations[-1]
    remaining = _left_over_change(evaluations) if springs else 1.0
    # Forces agree where the process gives the same again, or where it need not be evaluated again
    # because its own springs are at rest.
    change = (
        min(last.force_change, last.spring_change)
        if springs and len(evaluations) > 1
        else last.force_change
    )
    return (
        last.path_change <= tolerance.path
        and max(remaining * last.path_change_rms, ahead) <= tolerance.rms
        and change <= tolerance.force
        and last.spring_change <= _CARRIED * tolerance.force
    )


def _left_over_change(evaluations: list[Evaluation]) -> float:
    """Return a path's distance from the fixed point over its last change, where springs slow it down.

    Both are root mean squares: single samples creep, where unloaded gears are held.

    A change that falls by a factor c from evaluation to evaluation has c / (1 - c) of itself ahead.
    """
    if len(evaluations) < 2:
        return np.inf
    before, now = (evaluation.path_change_rms for evaluation in evaluations[-2:])
    contraction = min(now / before, _SLOWEST) if before > 0.0 else 0.0
    return max(1.0, contraction / (1.0 - contraction))


def _trouble(
    evaluations: list[Evaluation], best: int, x: ToolPath, g: ToolPath
) -> tuple[Outcome, str] | None:
    """Return outcome and reason where it is no use to go on since the best evaluation, by its number."""
    changes = [evaluation.path_change for evaluation in evaluations]
    if len(changes) >= 3 and changes[-1] > _DIVERGED * max(changes[:2]):
        factor = (changes[-1] / changes[0]) ** (1.0 / (len(changes) - 1))
        return Outcome.DIVERGED, (
            f"diverged: the path change grows by a factor {factor:.3g} per evaluation, to"
            f" {format_um(changes[-1])} um{_ADVICE}"
        )
    recent = changes[best:]
    if len(recent) < _PATIENCE:
        return None
    cycles = max(recent) < _CYCLE * min(recent)
    return Outcome.LIMIT_CYCLE if cycles else Outcome.STAGNATED, (
        f"{'a limit cycle' if cycles else 'stagnation'}: the path change stays between"
        f" {format_um(min(recent))} and {format_um(max(recent))} um for {_PATIENCE} evaluations, most at"
        f" {_worst_places(x, g)}{_ADVICE}"
    )


def _worst_places(x: ToolPath, g: ToolPath) -> str:
    """Return the three times and positions at which a path changes most."""
    distances = np.linalg.norm(g.position - x.position, axis=2)
    samples = np.argsort(distances.max(axis=0))[::-1][:3]
    tools = distances.argmax(axis=0)
    return "; ".join(
        f"t = {g.time[k]:.3f} s at {np.round(g.position[tools[k], k], 4).tolist()} m"
        for k in samples
    )
