"""The weak coupling: robot and process in turn, over the whole path, until nothing changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from coupling.errors import ProcessError, SimulationError
from coupling.path.histories import JointPath, ToolPath, WrenchHistory
from coupling.process import Process
from coupling.solve.relaxation import Scheme
from elastic_robot.fmi.interface import Mode


class SimulatedRobot(Protocol):
    """What the iteration needs of a robot."""

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        """Return the path that the TCP takes."""
        ...


@dataclass(frozen=True)
class Tolerance:
    """When an iteration has converged: all three at once.

    Attributes:
        path: Largest change of a TCP position between process input and robot output [m].
        rms: Root mean square of that change [m].
        force: Largest change of force between two evaluations, relative to the peak force.
    """

    path: float = 1e-6
    rms: float = 5e-7
    force: float = 1e-3


@dataclass(frozen=True)
class Evaluation:
    """One evaluation of the process and the robot's answer to it.

    Attributes:
        number: From 1.
        path_change: Largest distance between the path the process saw and the robot's answer [m].
        path_change_rms: Root mean square of it [m].
        force_change: Largest change of force, relative to the peak; infinite in the first.
        peak_force: [N].
        worst_time: Where the path changes most [s].
    """

    number: int
    path_change: float
    path_change_rms: float
    force_change: float
    peak_force: float
    worst_time: float


@dataclass(frozen=True)
class Coupling:
    """Result of a weak coupling.

    Attributes:
        converged: Whether the tolerance was met.
        reason: In plain words; if not converged, what was seen and what to try.
        path: The TCP's path under `wrench`: robot and wrench belong together exactly.
        wrench: The process's answer to the last path it saw, `path` within the tolerance.
        evaluations: The way there.
    """

    converged: bool
    reason: str
    path: ToolPath
    wrench: WrenchHistory
    evaluations: tuple[Evaluation, ...]


# Growth of the path change over its first value that counts as divergence.
_DIVERGED = 10.0
# Evaluations without a smaller path change that count as stagnation.
_PATIENCE = 12

Observer = Callable[[Evaluation, ToolPath], None]


def couple(
    robot: SimulatedRobot,
    process: Process,
    command: JointPath,
    scheme: Scheme,
    tolerance: Tolerance | None = None,
    max_evaluations: int = 40,
    start: ToolPath | None = None,
    observe: Observer = lambda evaluation, path: None,
    mode: Mode = "quasistatic",
) -> Coupling:
    """Find the path x = G(process(x)) of an elastic robot under its process's wrench.

    Args:
        robot: Simulates a command under a wrench.
        process: Gives the wrench of a path.
        command: What the drives do.
        scheme: Relaxation; it is reset first.
        tolerance: When to stop.
        max_evaluations: Of the process.
        start: First path shown to the process; the robot's path without load unless given (in a
            cell it must be given).
        observe: Called after each evaluation.
        mode: Of the robot.

    Returns:
        The result, converged or not.

    Raises:
        SimulationError: If the robot cannot be simulated at all.
        ProcessError: If the process has no answer to the first path; a later failure is a result.
    """
    tolerance = tolerance or Tolerance()
    scheme.reset()
    x = start or robot.simulate(command, WrenchHistory.none(command.time), mode)
    origin, last, answer = x, None, None
    evaluations: list[Evaluation] = []
    reason = f"not converged within {max_evaluations} evaluations of the process"
    for number in range(1, max_evaluations + 1):
        try:
            wrench = process.wrench(x)
        except ProcessError as error:
            if answer is None:
                raise
            reason = f"the process failed in evaluation {number}: {error}"
            return _result(False, reason, answer, evaluations)
        try:
            g = robot.simulate(command, wrench, mode)
        except SimulationError as error:
            if answer is None:
                raise
            reason = f"diverged: the robot cannot follow the iteration any more ({error})"
            return _result(False, reason + _ADVICE, answer, evaluations)
        answer = (g, wrench)
        evaluations.append(_evaluate(number, x, g, wrench, last))
        observe(evaluations[-1], g)
        if _met(evaluations[-1], tolerance):
            reason = f"converged in {number} evaluations of the process"
            return _result(True, reason, answer, evaluations)
        trouble = _trouble(evaluations, x, g)
        if trouble is not None:
            return _result(False, trouble, answer, evaluations)
        update = scheme.update(x.deviation_from(origin), g.deviation_from(origin))
        x, last = origin.displaced(update), wrench
    assert answer is not None
    return _result(False, reason, answer, evaluations)


_ADVICE = "; use the scheme aitken or anderson, or a smaller relaxation"


def _result(
    converged: bool,
    reason: str,
    answer: tuple[ToolPath, WrenchHistory],
    evaluations: list[Evaluation],
) -> Coupling:
    return Coupling(converged, reason, answer[0], answer[1], tuple(evaluations))


def _evaluate(
    number: int, x: ToolPath, g: ToolPath, wrench: WrenchHistory, last: WrenchHistory | None
) -> Evaluation:
    distance = g.distance_to(x)
    return Evaluation(
        number=number,
        path_change=float(distance.max()),
        path_change_rms=float(np.sqrt(np.mean(distance**2))),
        force_change=np.inf if last is None else wrench.change_from(last),
        peak_force=wrench.peak_force,
        worst_time=float(g.time[distance.argmax()]),
    )


def _met(evaluation: Evaluation, tolerance: Tolerance) -> bool:
    return (
        evaluation.path_change <= tolerance.path
        and evaluation.path_change_rms <= tolerance.rms
        and evaluation.force_change <= tolerance.force
    )


def _trouble(evaluations: list[Evaluation], x: ToolPath, g: ToolPath) -> str | None:
    """Return why it is no use to go on, if so."""
    changes = [evaluation.path_change for evaluation in evaluations]
    if len(changes) >= 3 and changes[-1] > _DIVERGED * changes[0]:
        factor = (changes[-1] / changes[0]) ** (1.0 / (len(changes) - 1))
        return (
            f"diverged: the path change grows by a factor {factor:.3g} per evaluation, to"
            f" {1e6 * changes[-1]:.3g} um{_ADVICE}"
        )
    best = int(np.argmin(changes))
    if len(changes) - 1 - best >= _PATIENCE:
        distance = g.distance_to(x)
        worst = np.argsort(distance)[::-1][:3]
        places = "; ".join(
            f"t = {g.time[k]:.3f} s at {np.round(_farthest(g, x, k), 4).tolist()} m" for k in worst
        )
        recent = changes[best + 1 :]
        kind = "a limit cycle" if max(recent) < 4.0 * min(recent) else "stagnation"
        return (
            f"{kind}: the path change stays between {1e6 * min(recent):.3g} and"
            f" {1e6 * max(recent):.3g} um for {_PATIENCE} evaluations, most at {places}{_ADVICE}"
        )
    return None


def _farthest(g: ToolPath, x: ToolPath, sample: int) -> np.ndarray:
    """Return where the tool is that has moved farthest between two paths [m], (3,)."""
    pairs = zip(g.tools, x.tools, strict=True)
    return max(pairs, key=lambda pair: pair[0].distance_to(pair[1])[sample])[0].position[sample]
