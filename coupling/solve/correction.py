"""Result of a correction, and the one that corrects nothing: the weak coupling alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from coupling.events import Event
from coupling.path.controller import on_cycle
from coupling.path.deviation import measure
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from coupling.process.base import ProcessResponse
from coupling.results.gear_result import BacklashReversal
from coupling.results.iteration_result import CorrectionIteration
from coupling.robot.contract import InvertibleRobot
from coupling.solve.coupling import couple, sampled_for
from coupling.solve.fixed_point import Loop, unloaded_path
from coupling.solve.scheme import Outcome


@dataclass(frozen=True)
class RefinedTimes(Event):
    """The paths that follow are on other times than those of the case.

    Attributes:
        desired: Desired paths at these times.
    """

    desired: ToolPath


# How the path before a correction is found.
How = Literal["coupled", "one-way"]
HOW: dict[How, str] = {
    "coupled": "coupled with its process",
    "one-way": "under the wrench on the desired path",
}


@dataclass(frozen=True)
class UncorrectedRun:
    """Motion of the robots where the desired paths are commanded.

    Attributes:
        path: Paths of the TCPs.
        joints: Motion of the drives.
        wrench: Wrenches on the tools, at the times of `path`.
        response: The process's answer to `path`; None where it was not evaluated there.
        how: "coupled": path and wrench belong together; "one-way": the path under the wrench that the
            process has on the desired paths, which costs no evaluation.
    """

    path: ToolPath
    joints: JointPath
    wrench: WrenchHistory
    response: ProcessResponse | None
    how: How = "coupled"


@dataclass(frozen=True)
class Correction:
    """Result of a correction.

    All paths but `command` and the wrench are on the times of `desired`.

    Attributes:
        outcome: Outcome of the iteration.
        reason: Reason in plain words; if not converged, what was seen and what to try.
        desired: Desired paths of the TCPs.
        unloaded: Paths of the TCPs under gravity alone, command = desired paths.
        before: Coupling of the robots with command = desired paths.
        joints: Motion of the drives, in the rows to send to the robots.
        command: Paths of the undeflected TCPs at the rows of `joints`.
        correction: Paths of the undeflected TCPs under `joints` minus `desired` [m, rad], (tools, n, 6).
        achieved: Paths of the TCPs under `joints` and `response`.
        response: The process's answer to the paths that the tools really take.
        consistency: Largest distance between the path that the process saw and `achieved` [m].
        iterations: Iterations of the correction, in order.
        evaluations: Number of evaluations of the process, in all.
        backlash_reversals: Passages of gears through their backlash; None where the method does not know
            them.
    """

    outcome: Outcome
    reason: str
    desired: ToolPath
    unloaded: ToolPath
    before: UncorrectedRun
    joints: JointPath
    command: ToolPath
    correction: np.ndarray
    achieved: ToolPath
    response: ProcessResponse
    consistency: float
    iterations: tuple[CorrectionIteration, ...]
    evaluations: int
    backlash_reversals: tuple[BacklashReversal, ...] | None = None

    @property
    def converged(self) -> bool:
        """Whether the tolerance was met."""
        return self.outcome is Outcome.CONVERGED


class Method(Protocol):
    """A method that makes a command of a desired path."""

    def correct(self, loop: Loop[InvertibleRobot], desired: SampledPath) -> Correction:
        """Return the command for the desired paths of all tools, with what it leads to.

        Raises:
            PlanningError: If the desired path cannot be followed.
            SimulationError: If the robot cannot be simulated.
            ProcessError: If the process has no answer to the first path.
        """


class Compensation(Method, Protocol):
    """A method that is chosen in a case."""

    @property
    def tolerance_m(self) -> float:
        """Largest deviation from the desired path that ends the iteration [m]."""


class Uncorrected:
    """Commands the desired path as it is."""

    def correct(self, loop: Loop[InvertibleRobot], desired: SampledPath) -> Correction:
        """Return the coupling of robot and process along the desired path."""
        times = sampled_for(loop, desired)
        path = times.path
        joints = on_cycle(loop.robot.plan(path), loop.controller)
        loop.watch(RefinedTimes(path))
        unloaded = unloaded_path(loop, joints, path.time)
        coupling = couple(loop, joints, unloaded, times.sample_rows)
        return Correction(
            outcome=coupling.outcome,
            reason=coupling.reason,
            desired=path,
            unloaded=unloaded,
            before=UncorrectedRun(
                coupling.path, joints, coupling.response.wrench, coupling.response
            ),
            joints=joints,
            command=loop.robot.forward(joints, joints.time),
            correction=loop.robot.forward(joints, path.time).deviation_from(path),
            achieved=coupling.path,
            response=coupling.response,
            consistency=coupling.evaluation.path_change,
            iterations=(
                CorrectionIteration(
                    number=0,
                    deviation=measure(coupling.path, path),
                    evaluations=coupling.evaluations,
                ),
            ),
            evaluations=len(coupling.evaluations),
        )
