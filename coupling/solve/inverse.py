"""Method "inverse": one evaluation of the process, the moving robot inverted, and validated."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from coupling.errors import ProcessError, SimulationError
from coupling.files.toml_file import Positive, Schema
from coupling.path.controller import on_cycle
from coupling.path.deviation import DeviationParts, measure
from coupling.path.histories import ToolPath
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from coupling.path.length_text import format_um
from coupling.path.path_ends import MOVING_END, is_near_moving_end
from coupling.process.base import ProcessResponse, marched
from coupling.results.iteration_result import (
    QUASISTATIC_VALIDATION,
    CorrectionIteration,
    Evaluation,
)
from coupling.robot.contract import InverseCommand as RobotInverse
from coupling.robot.contract import InvertibleRobot
from coupling.solve.correction import (
    Correction,
    How,
    RefinedTimes,
    UncorrectedRun,
)
from coupling.solve.coupling import couple, refined_for
from coupling.solve.fixed_point import Coupling, Evaluated, Loop, unloaded_path
from coupling.solve.scheme import Outcome
from elastic_robot.fmi.interface import Mode

# Part of the tolerance that the robot alone is to keep under the wrench on the desired path: a sheet
# answers micrometres with newtons, so the rest is the process's.
_SHARE_OF_ROBOT = 0.1
# A round that lowers the deviation by less is the last one.
_IMPROVED = 0.9


@dataclass(frozen=True)
class _Iteration:
    """A command, and what it leads to.

    Attributes:
        inverse: The command.
        achieved: Paths of the TCPs under it and `response`.
        response: The process's answer to the path under the wrench before.
        consistency: Distance of that path from `achieved` [m].
        report: Its figures.
        evaluations: Number of evaluations of the process in the validation.
        failure: Reason why there was no validation; `achieved` and `response` are then those before it.
        coupling: Coupling with a process that has a memory, which is the validation then.
    """

    inverse: RobotInverse
    achieved: ToolPath
    response: ProcessResponse
    consistency: float
    report: CorrectionIteration
    evaluations: int = 0
    failure: ProcessError | SimulationError | None = None
    coupling: Coupling | None = None

    @property
    def is_valid(self) -> bool:
        """Whether there is a validation."""
        return self.failure is None and (self.coupling is None or self.coupling.converged)


class InverseCorrection(Schema):
    """The moving robot inverted along the whole path, as docs/inverse.md explains.

    If the tool reaches its path, the wrench is that on the desired path: the process is evaluated once
    there, the robots are inverted under that wrench, and what they then do is validated with the
    process on the path that they really take.  These are the keys of its table.

    Attributes:
        tolerance_m: Largest deviation from the desired path, in the validation; under periodic teeth, of
            its mean over their period.
        max_rounds: Rounds of inverse and validation at most; from the second on the wrench is that of
            the path really taken.
        before: Way to find the path under the uncorrected command: "one-way", under the wrench on the
            desired path, which costs no evaluation, or "coupled".
    """

    method: Literal["inverse"] = "inverse"
    tolerance_m: Positive = 1e-5
    max_rounds: Annotated[int, Field(ge=1)] = 3
    before: How = "one-way"

    def correct(self, loop: Loop[InvertibleRobot], desired: SampledPath) -> Correction:
        """Return the command for the desired paths of all tools, validated.

        Raises:
            PlanningError: If the desired path cannot be followed.
            SimulationError: If the robot cannot be simulated.
            ProcessError: If the process has no answer to the desired path.
        """
        times = refined_for(loop, desired, loop.controller.cycle)
        if marched(loop.process) is not None:
            desired = times  # whose steps its wrenches have
        loop.watch(RefinedTimes(times.path))
        plain = on_cycle(loop.robot.plan(desired.path), loop.controller)
        unloaded = unloaded_path(loop, plain, times.path.time)
        response = loop.process.evaluate(desired.samples)
        before, spent = self._before(loop, plain, unloaded, times, response)
        rounds: list[_Iteration] = []
        verdict: tuple[Outcome, str] | None = None
        while verdict is None:
            rounds.append(self._round(loop, desired, times, response, rounds))
            response = rounds[-1].response
            verdict = self._verdict(rounds, loop.mode, desired.path)
        validated = [entry for entry in rounds if entry.is_valid] or rounds
        best = min(validated, key=lambda entry: entry.report.deviation.maximum)
        outcome, reason = verdict
        joints = best.inverse.joints
        return Correction(
            outcome=outcome,
            reason=reason,
            desired=times.path,
            unloaded=unloaded,
            before=before,
            joints=joints,
            command=loop.robot.forward(joints, joints.time),
            correction=loop.robot.forward(joints, times.path.time).deviation_from(times.path),
            achieved=best.achieved,
            response=replace(best.response, wrench=best.response.wrench.refined(times.path.time)),
            consistency=best.consistency,
            iterations=tuple(entry.report for entry in rounds),
            evaluations=1 + spent + sum(entry.evaluations for entry in rounds),
            backlash_reversals=best.inverse.backlash_reversals,
        )

    def _before(
        self,
        loop: Loop[InvertibleRobot],
        plain: JointPath,
        unloaded: ToolPath,
        times: SampledPath,
        response: ProcessResponse,
    ) -> tuple[UncorrectedRun, int]:
        """Return the result of the uncorrected command, and the evaluations that it took."""
        if self.before == "one-way":
            loads = response.wrench.refined(times.path.time)
            path = loop.robot.simulate(plain, loads, loop.mode)
            return UncorrectedRun(path, plain, loads, None, "one-way"), 0
        coupling = couple(loop, plain, unloaded, times.sample_rows)
        before = UncorrectedRun(
            coupling.path, plain, coupling.response.wrench, coupling.response, "coupled"
        )
        return before, len(coupling.evaluations)

    def _round(
        self,
        loop: Loop[InvertibleRobot],
        desired: SampledPath,
        times: SampledPath,
        response: ProcessResponse,
        rounds: list[_Iteration],
    ) -> _Iteration:
        """Invert the robots under a wrench and validate the command."""
        goal = _SHARE_OF_ROBOT * self.tolerance_m
        inverse = loop.robot.inverse(desired, response.wrench, loop.controller, goal, loop.watch)
        time = times.path.time
        simulated = loop.robot.simulate(inverse.joints, response.wrench.refined(time), loop.mode)
        if marched(loop.process) is not None:
            return self._marched_round(loop, inverse, simulated, times.path, len(rounds) + 1)
        first = () if rounds else (Evaluation.of(1, times.path, simulated, response.wrench, None),)
        for entry in first:
            loop.watch(Evaluated(entry, simulated))
        try:
            checked = loop.process.evaluate(simulated.at_rows(times.sample_rows))
            achieved = loop.robot.simulate(inverse.joints, checked.wrench.refined(time), loop.mode)
        except (ProcessError, SimulationError) as error:
            report = CorrectionIteration(
                number=len(rounds) + 1, deviation=measure(simulated, times.path), evaluations=first
            )
            loop.watch(report)
            return _Iteration(inverse, simulated, response, 0.0, report, failure=error)
        number = len(rounds) + 2
        last = Evaluation.of(number, simulated, achieved, checked.wrench, response.wrench)
        loop.watch(Evaluated(last, achieved))
        report = CorrectionIteration(
            number=len(rounds) + 1,
            deviation=measure(achieved, times.path),
            evaluations=(*first, last),
        )
        loop.watch(report)
        return _Iteration(inverse, achieved, checked, last.path_change, report, 1)

    def _marched_round(
        self,
        loop: Loop[InvertibleRobot],
        inverse: RobotInverse,
        simulated: ToolPath,
        desired: ToolPath,
        number: int,
    ) -> _Iteration:
        """Validate a command with a process that has a memory: coupled, as a real cut is."""
        coupling = couple(loop, inverse.joints, simulated)
        report = CorrectionIteration(
            number=number,
            deviation=measure(coupling.path, desired),
            evaluations=coupling.evaluations,
        )
        loop.watch(report)
        return _Iteration(
            inverse,
            coupling.path,
            coupling.response,
            coupling.evaluation.path_change,
            report,
            len(coupling.evaluations),
            coupling=coupling,
        )

    def _ripple(self, validated: _Iteration, desired: ToolPath) -> str:
        """Return how far teeth move a tool whose mean over their period keeps its path, in words.

        Empty where the mean does not keep it, or the process has no teeth that come and go.
        """
        period, path = validated.response.period, validated.achieved
        if validated.coupling is None or period is None or period > np.ptp(path.time):
            return ""
        parts = [
            DeviationParts.of(path.time, deviation, period)
            for deviation in path.position - desired.position
        ]
        slow = max(part.largest_slow for part in parts)
        if slow > self.tolerance_m:
            return ""
        ripple = max(part.largest_ripple for part in parts)
        return (
            f"its mean over {1e3 * period:.3g} ms is off by {format_um(slow)} um, and the teeth move the"
            f" tool by {format_um(ripple)} um about that, faster than a command can be"
        )

    def _verdict(
        self, rounds: list[_Iteration], mode: Mode, desired: ToolPath
    ) -> tuple[Outcome, str] | None:
        """Return outcome and reason of the rounds, if they end."""
        failure = rounds[-1].failure
        if failure is not None:
            process = isinstance(failure, ProcessError)
            outcome = Outcome.PROCESS_FAILED if process else Outcome.ROBOT_FAILED
            who = "process" if process else "robot"
            return outcome, (
                f"the {who} failed in the validation of inverse {len(rounds)}, on the tool's actual"
                f" path: {failure}"
            )
        coupling = rounds[-1].coupling
        if coupling is not None and not coupling.converged:
            return (
                coupling.outcome,
                f"in the validation of inverse {len(rounds)}: {coupling.reason}",
            )
        sizes = [entry.report.deviation.maximum for entry in rounds]
        count = "one inverse" if len(sizes) == 1 else f"{len(sizes)} inverses"
        if sizes[-1] <= self.tolerance_m:
            return Outcome.CONVERGED, f"converged with {count} of the moving robot"
        if ripple := self._ripple(rounds[-1], desired):
            return Outcome.CONVERGED, f"converged with {count} of the moving robot; {ripple}"
        worst = rounds[int(np.argmin(sizes))].report.deviation.time_of_maximum
        remainder = f"{format_um(min(sizes))} um remain, most at t = {worst:.3f} s"
        if mode == "quasistatic":
            advice = QUASISTATIC_VALIDATION
        elif is_near_moving_end(desired, worst):
            advice = MOVING_END
        else:
            advice = "see which limit or cycle is the cause (docs/inverse.md)"
        if len(sizes) > 1 and sizes[-1] > _IMPROVED * min(sizes[:-1]):
            return Outcome.STAGNATED, f"another inverse does not help: {remainder}; {advice}"
        if len(sizes) >= self.max_rounds:
            return Outcome.EXHAUSTED, (
                f"{remainder} after {len(sizes)} inverses of the moving robot; {advice}"
            )
        return None
