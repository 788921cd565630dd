"""Iterative mirroring: couple to convergence, subtract the deviation from the command, repeat."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from coupling.errors import CouplingError, HostError, ProcessError, StoreError
from coupling.files.toml_file import Positive, Schema
from coupling.path.controller import on_cycle
from coupling.path.deviation import measure
from coupling.path.histories import ToolPath
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from coupling.path.length_text import format_um
from coupling.path.low_pass import low_pass
from coupling.results.iteration_result import CORRECTIONS, CorrectionIteration
from coupling.robot.contract import InvertibleRobot
from coupling.solve.correction import Correction, Uncorrected
from coupling.solve.coupling import couple, sampled_for
from coupling.solve.fixed_point import Coupling, Loop
from coupling.solve.scheme import Iterate, Outcome

# A deviation above this multiple of the smallest one so far ends the iteration as diverging.
_DIVERGED = 2.0
# Iterations without an improvement of at least a tenth that count as stagnation.
_PATIENCE, _IMPROVED = 3, 0.9
_ADVICE = (
    "; a resonant robot amplifies the correction near its eigenfrequencies: compute it with"
    ' mode = "quasistatic", or set cutoff_Hz to less than 0.7 of the lowest eigenfrequency'
)


@dataclass(frozen=True)
class _Attempt:
    """A commanded path, its motion of the drives and the coupling that it leads to."""

    command: ToolPath
    joints: JointPath
    coupling: Coupling


class _LargestStep(NamedTuple):
    """Largest step of a correction between neighbouring samples.

    Attributes:
        length: Its length [m].
        time: Its instant [s].
        limited_samples: Number of samples at which the correction's rate is limited.
    """

    length: float
    time: float
    limited_samples: int


class Mirror(Schema):
    """Iterative mirroring, the method of Abele et al. 2008 (docs/references.md).

    It is a low-frequency method: a resonant robot amplifies the correction near its
    eigenfrequencies, see docs/compensation.md.  These are the keys of its table.

    Attributes:
        tolerance_m: Largest deviation from the desired path that ends the iteration.
        gain: Share of the deviation subtracted in each iteration.
        cutoff_Hz: Frequency below which is corrected; None: all of it.
        max_correction_rate_m_s: Fastest change of the correction; at a gear's reversal the
            exact correction would jump.
        max_passes: Corrections at most.
    """

    method: Literal["mirror"] = "mirror"
    tolerance_m: Positive = 1e-5
    gain: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    cutoff_Hz: Positive | None = None
    max_correction_rate_m_s: Positive = 0.05
    max_passes: Annotated[int, Field(ge=1)] = 12

    def correct(self, loop: Loop[InvertibleRobot], desired: SampledPath) -> Correction:
        """Return the corrected command for the desired paths of all tools, validated.

        Raises:
            PlanningError: If the desired path cannot be followed.
            SimulationError: If the robot cannot be simulated.
            ProcessError: If the process has no answer to the first path.
        """
        times = sampled_for(loop, desired)
        rows, path = times.sample_rows, times.path
        first = Uncorrected().correct(loop, desired)
        iterations = list(first.iterations)
        coupling = Coupling(
            first.outcome,
            first.reason,
            first.achieved,
            first.response,
            iterations[0].evaluations,
            iterations[0].evaluations[-1],
        )
        last = best = _Attempt(path, first.joints, coupling)
        loop.watch(iterations[0])
        verdict = self._verdict(iterations, coupling)
        while verdict is None:
            try:
                last, step = self._mirror_command(loop, last, path, rows)
            except ProcessError as error:
                reason = f"the process failed in iteration {len(iterations)}: {error}"
                verdict = Outcome.PROCESS_FAILED, reason
                break
            except (HostError, StoreError):  # no verdict on the command
                raise
            except CouplingError as error:
                reason = f"the corrected command cannot be run: {error}{_ADVICE}"
                verdict = Outcome.ROBOT_FAILED, reason
                break
            deviation = measure(last.coupling.path, path)
            iterations.append(
                CorrectionIteration(
                    number=len(iterations),
                    deviation=deviation,
                    largest_step=step.length,
                    step_time=step.time,
                    limited_samples=step.limited_samples,
                    evaluations=last.coupling.evaluations,
                )
            )
            loop.watch(iterations[-1])
            if deviation.maximum <= min(p.deviation.maximum for p in iterations):
                best = last
            verdict = self._verdict(iterations, last.coupling)
        correction_so_far = replace(first, iterations=tuple(iterations))
        return self._validate(loop, rows, correction_so_far, best, verdict)

    def _mirror_command(
        self, loop: Loop[InvertibleRobot], last: _Attempt, desired: ToolPath, rows: np.ndarray
    ) -> tuple[_Attempt, _LargestStep]:
        """Return the next command, coupled, and the largest step of its correction."""
        corrected, step = self._correct(last, desired)
        joints = on_cycle(loop.robot.plan(corrected), loop.controller)
        # The process sees at first what it saw last, moved with the command.
        start = last.coupling.path.displaced(corrected.deviation_from(last.command))
        return _Attempt(corrected, joints, couple(loop, joints, start, rows)), step

    def _correct(self, last: _Attempt, desired: ToolPath) -> tuple[ToolPath, _LargestStep]:
        """Return the mirrored command and the largest step of its correction."""
        correction = last.command.deviation_from(desired)
        correction -= self.gain * last.coupling.path.deviation_from(desired)
        if self.cutoff_Hz is not None:
            correction = np.stack(
                [low_pass(desired.time, tool, self.cutoff_Hz) for tool in correction]
            )
        limited = np.stack(
            [limit_rate(desired.time, tool, self.max_correction_rate_m_s) for tool in correction]
        )
        count = int(np.count_nonzero(np.any(limited != correction, axis=(0, 2))))
        corrected = desired.displaced(limited)
        changes = np.diff(corrected.position - desired.position, axis=1)
        steps = np.linalg.norm(changes, axis=2).max(axis=0)
        worst = int(np.argmax(steps))
        step = _LargestStep(float(steps[worst]), float(desired.time[worst]), count)
        return corrected, step

    def _verdict(
        self, iterations: list[CorrectionIteration], coupling: Coupling
    ) -> tuple[Outcome, str] | None:
        """Return outcome and reason of the iteration, if it ends."""
        if not coupling.converged:
            reason = f"in iteration {iterations[-1].number} the coupling {coupling.reason}"
            return coupling.outcome, reason
        sizes = [entry.deviation.maximum for entry in iterations]
        if sizes[-1] <= self.tolerance_m:
            return Outcome.CONVERGED, f"converged in {len(sizes) - 1} corrections"
        if len(sizes) > 1 and not sizes[-1] <= _DIVERGED * min(sizes):
            return Outcome.DIVERGED, (
                f"mirroring diverges: the deviation grew from {format_um(min(sizes))} to"
                f" {format_um(sizes[-1])} um{_ADVICE}"
            )
        if len(sizes) > _PATIENCE and min(sizes[-_PATIENCE:]) > _IMPROVED * min(sizes[:-_PATIENCE]):
            return Outcome.STAGNATED, (
                f"mirroring stagnates at {format_um(min(sizes))} um, most at t ="
                f" {iterations[-1].deviation.time_of_maximum:.3f} s{self._held_back(iterations[-1])}"
            )
        if len(sizes) > self.max_passes:
            return Outcome.EXHAUSTED, f"not converged within {self.max_passes} {CORRECTIONS}"
        return None

    def _held_back(self, last: CorrectionIteration) -> str:
        """Return the reasons for which the correction is not complete."""
        if self.cutoff_Hz is not None:
            return f"; the rest is above cutoff_Hz = {self.cutoff_Hz:g}"
        if last.limited_samples:
            return f"; {last.limited_samples} samples are limited by max_correction_rate_m_s"
        return "; the robot's response is discontinuous there, as at a gear that reverses"

    def _validate(
        self,
        loop: Loop[InvertibleRobot],
        rows: np.ndarray,
        result: Correction,
        best: _Attempt,
        verdict: tuple[Outcome, str],
    ) -> Correction:
        """Run the best command once more with the process on the path that it really takes."""
        coupling, (outcome, reason) = best.coupling, verdict
        desired = result.desired
        achieved, response = coupling.path, coupling.response
        consistency = coupling.evaluation.path_change
        evaluations = sum(len(entry.evaluations) for entry in result.iterations)
        try:
            response = loop.process.evaluate(coupling.path.at_rows(rows))
            iterate = Iterate(coupling.path, rows, response)
            motion = loop.scheme.move_robot(loop.robot, best.joints, iterate, loop.mode)
            achieved = motion.path
            response = replace(response, wrench=motion.loads.on(achieved))
            consistency = float(achieved.distance_to(coupling.path).max())
            evaluations += 1
        except ProcessError as error:
            outcome = Outcome.PROCESS_FAILED
            reason = f"{reason}; the process failed in the validation: {error}"
        else:
            outcome = self._validity(outcome, coupling, achieved, desired)
        return replace(
            result,
            outcome=outcome,
            reason=reason,
            joints=best.joints,
            command=loop.robot.forward(best.joints, best.joints.time),
            correction=loop.robot.forward(best.joints, desired.time).deviation_from(desired),
            achieved=achieved,
            response=response,
            consistency=consistency,
            evaluations=evaluations,
        )

    def _validity(
        self, outcome: Outcome, coupling: Coupling, achieved: ToolPath, desired: ToolPath
    ) -> Outcome:
        """Return the verdict on the best command: what counts is the validation run."""
        within = measure(achieved, desired).maximum <= self.tolerance_m
        if coupling.converged and within:
            return Outcome.CONVERGED
        return Outcome.STAGNATED if outcome is Outcome.CONVERGED else outcome


def limit_rate(time: np.ndarray, correction: np.ndarray, max_rate: float) -> np.ndarray:
    """Return a correction of which no component changes faster than `max_rate`.

    The middle between the highest admissible function below and the lowest one above, so that a
    jump becomes a ramp centred on it.

    Args:
        time: Rising times [s], (n,).
        correction: Positions [m] and rotations [rad], (n, 6); both are limited to `max_rate`.
        max_rate: Largest rate [m/s] and [rad/s].

    Example:
        >>> time = np.linspace(0.0, 4.0, 5)
        >>> limit_rate(time, np.array([[0.0], [0.0], [0.0], [2.0], [2.0]]), 1.0).ravel()
        array([0. , 0. , 0.5, 1.5, 2. ])
    """
    allowed = max_rate * np.diff(time)[:, None]
    if np.all(np.abs(np.diff(correction, axis=0)) <= allowed):
        return correction
    below, above = correction.copy(), correction.copy()
    for k in range(1, len(time)):
        below[k] = np.minimum(below[k], below[k - 1] + allowed[k - 1])
        above[k] = np.maximum(above[k], above[k - 1] - allowed[k - 1])
    for k in range(len(time) - 2, -1, -1):
        below[k] = np.minimum(below[k], below[k + 1] + allowed[k])
        above[k] = np.maximum(above[k], above[k + 1] - allowed[k])
    return 0.5 * (below + above)
