"""Corrected commands: the path to send to the robot so that the elastic robot's tool goes right."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.signal import butter, sosfiltfilt

from coupling.errors import CouplingError, ProcessError
from coupling.path.deviation import Deviation, measure
from coupling.path.histories import JointPath, ToolPath, WrenchHistory
from coupling.process import Process
from coupling.solve.fixed_point import Coupling, Evaluation, SimulatedRobot, Tolerance, couple
from coupling.solve.relaxation import Scheme
from elastic_robot.fmi.interface import Mode


class PathPlanner(Protocol):
    """Inverse kinematics, of one robot or of a cell."""

    def plan(self, path: ToolPath) -> JointPath:
        """Return the joint angles along a path."""
        ...


@dataclass(frozen=True)
class MirrorSettings:
    """How to mirror.

    Attributes:
        tolerance: Largest deviation from the desired path that ends the iteration [m].
        gain: Share of the deviation subtracted in each pass.
        cutoff: Correct only below this frequency [Hz]; None: all of it.
        max_rate: Fastest change of the correction [m/s]; at a gear's change of flank the exact
            correction would jump.
        max_passes: Corrections at most.
    """

    tolerance: float = 1e-5
    gain: float = 1.0
    cutoff: float | None = None
    max_rate: float = 0.05
    max_passes: int = 12


@dataclass(frozen=True)
class Pass:
    """One pass of the compensation.

    Attributes:
        number: 0 for the uncompensated command.
        deviation: Of the coupled path from the desired one.
        coupling: Evaluations of the process in this pass.
        largest_correction_step: Between neighbouring samples of the correction [m].
        step_time: Where that is [s].
        limited_samples: Samples at which the correction's rate was limited.
    """

    number: int
    deviation: Deviation
    coupling: tuple[Evaluation, ...]
    largest_correction_step: float = 0.0
    step_time: float = 0.0
    limited_samples: int = 0


@dataclass(frozen=True)
class Compensation:
    """Result of a compensation.

    Attributes:
        converged: Whether the deviation met the tolerance, in the validation run.
        reason: In plain words; if not converged, what was seen and what to try.
        unloaded: The TCP's path under gravity alone, command = desired path.
        uncompensated: The TCP's path under its process, command = desired path.
        command: Corrected tool path to send to the robot.
        joints: Its joint angles.
        achieved: The TCP's path in the validation run.
        wrench: Acting in that run: the process on the path that the robot really takes.
        consistency: Largest distance between the path that the process saw and `achieved` [m].
        passes: The way there.
        evaluations: Evaluations of the process, in all.
    """

    converged: bool
    reason: str
    unloaded: ToolPath
    uncompensated: Coupling
    command: ToolPath
    joints: JointPath
    achieved: ToolPath
    wrench: WrenchHistory
    consistency: float
    passes: tuple[Pass, ...]
    evaluations: int


@dataclass(frozen=True)
class Observers:
    """Called while a compensation runs, for those who watch.

    Attributes:
        evaluation: After each evaluation of the process, with the robot's answer.
        finished_pass: After each pass.
    """

    evaluation: Callable[[Evaluation, ToolPath], None] = lambda evaluation, path: None
    finished_pass: Callable[[Pass], None] = lambda finished: None


# A deviation above this multiple of the smallest one so far ends the iteration as diverging.
_DIVERGED = 2.0
# Passes without an improvement of at least a tenth that count as stagnation.
_PATIENCE = 3


@dataclass
class Mirror:
    """Iterative mirroring: couple to convergence, subtract the deviation from the command, repeat.

    The method of Abele et al. 2008 (docs/references.md).  It is a low-frequency method: a resonant
    robot amplifies the correction near its eigenfrequencies, see docs/compensation.md.

    Attributes:
        robot: The elastic robot.
        process: Gives the wrench of a path.
        planner: Inverse kinematics.
        scheme: Of the coupling.
        settings: Of the mirroring.
        tolerance: Of the coupling.
        max_evaluations: Of the process, in each coupling.
        observers: Called on the way.
        mode: Of the robot.
    """

    robot: SimulatedRobot
    process: Process
    planner: PathPlanner
    scheme: Scheme
    settings: MirrorSettings = field(default_factory=MirrorSettings)
    tolerance: Tolerance = field(default_factory=Tolerance)
    max_evaluations: int = 40
    observers: Observers = field(default_factory=Observers)
    mode: Mode = "quasistatic"

    def run(self, desired: ToolPath) -> Compensation:
        """Return the corrected command for a desired path.

        Raises:
            PlanningError: If the desired path cannot be followed.
            SimulationError: If the robot cannot be simulated.
        """
        command, joints = desired, self.planner.plan(desired)
        none = WrenchHistory.none(joints.time, len(desired.tools))
        unloaded = self.robot.simulate(joints, none, self.mode)
        uncompensated = coupling = self._couple(joints, unloaded)
        passes = [Pass(0, measure(coupling.path, desired), coupling.evaluations)]
        self.observers.finished_pass(passes[0])
        best = (command, joints, coupling)
        reason = self._verdict(passes, coupling)
        while reason is None:
            try:
                corrected, report = self._corrected(command, desired, coupling.path)
                joints = self.planner.plan(corrected)
                # The process sees at first what it saw last, moved with the command.
                shift = corrected.deviation_from(command)
                coupling = self._couple(joints, coupling.path.displaced(shift))
            except ProcessError as error:
                reason = f"the process failed in pass {len(passes)}: {error}"
                break
            except CouplingError as error:
                reason = f"the corrected command cannot be run: {error}{_ADVICE}"
                break
            command = corrected
            deviation = measure(coupling.path, desired)
            passes.append(Pass(len(passes), deviation, coupling.evaluations, *report))
            self.observers.finished_pass(passes[-1])
            if deviation.maximum <= min(p.deviation.maximum for p in passes):
                best = (command, joints, coupling)
            reason = self._verdict(passes, coupling)
        return self._validated(desired, unloaded, uncompensated, best, passes, reason)

    def _couple(self, joints: JointPath, start: ToolPath) -> Coupling:
        return couple(
            self.robot,
            self.process,
            joints,
            self.scheme,
            self.tolerance,
            self.max_evaluations,
            start,
            self.observers.evaluation,
            mode=self.mode,
        )

    def _corrected(
        self, command: ToolPath, desired: ToolPath, actual: ToolPath
    ) -> tuple[ToolPath, tuple[float, float, int]]:
        """Return the mirrored command, and largest step, its time and the limited samples."""
        correction = command.deviation_from(desired)
        correction -= self.settings.gain * actual.deviation_from(desired)
        if self.settings.cutoff is not None:
            correction = low_pass(desired.time, correction, self.settings.cutoff)
        limited = limit_rate(desired.time, correction, self.settings.max_rate)
        count = int(np.count_nonzero(np.any(limited != correction, axis=1)))
        corrected = desired.displaced(limited)
        steps = np.max(
            [
                np.linalg.norm(np.diff(tool.position - d.position, axis=0), axis=1)
                for tool, d in zip(corrected.tools, desired.tools, strict=True)
            ],
            axis=0,
        )
        worst = int(np.argmax(steps))
        report = (float(steps[worst]), float(desired.time[worst]), count)
        return corrected, report

    def _verdict(self, passes: list[Pass], coupling: Coupling) -> str | None:
        """Return why the iteration ends, if it does."""
        if not coupling.converged:
            return f"in pass {passes[-1].number} the coupling {coupling.reason}"
        sizes = [entry.deviation.maximum for entry in passes]
        if sizes[-1] <= self.settings.tolerance:
            return f"converged in {len(sizes) - 1} corrections"
        if len(sizes) > 1 and not sizes[-1] <= _DIVERGED * min(sizes):
            return (
                f"mirroring diverges: the deviation grew from {1e6 * min(sizes):.4g} to"
                f" {1e6 * sizes[-1]:.4g} um{_ADVICE}"
            )
        if len(sizes) > _PATIENCE and min(sizes[-_PATIENCE:]) > 0.9 * min(sizes[:-_PATIENCE]):
            return (
                f"mirroring stagnates at {1e6 * min(sizes):.4g} um, most at t ="
                f" {passes[-1].deviation.time_of_maximum:.3f} s{self._held_back(passes[-1])}"
            )
        if len(sizes) > self.settings.max_passes:
            return f"not converged within {self.settings.max_passes} corrections"
        return None

    def _held_back(self, last: Pass) -> str:
        """Return what kept the correction from being complete."""
        if self.settings.cutoff is not None:
            return f"; what is left lies above cutoff_Hz = {self.settings.cutoff:g}"
        if last.limited_samples:
            return f"; {last.limited_samples} samples are held back by max_correction_rate_m_s"
        return "; the robot's answer jumps there, as at a gear that changes its flank"

    def _validated(
        self,
        desired: ToolPath,
        unloaded: ToolPath,
        uncompensated: Coupling,
        best: tuple[ToolPath, JointPath, Coupling],
        passes: list[Pass],
        reason: str,
    ) -> Compensation:
        """Run the best command once more with the process on the path that it really takes."""
        command, joints, coupling = best
        achieved, wrench = coupling.path, coupling.wrench
        consistency = coupling.evaluations[-1].path_change
        validated = True
        try:
            wrench = self.process.wrench(coupling.path)
            achieved = self.robot.simulate(joints, wrench, self.mode)
            consistency = float(achieved.distance_to(coupling.path).max())
        except ProcessError as error:
            validated = False
            reason = f"{reason}; the process failed in the validation: {error}"
        deviation = measure(achieved, desired)
        return Compensation(
            converged=validated
            and coupling.converged
            and deviation.maximum <= self.settings.tolerance,
            reason=reason,
            unloaded=unloaded,
            uncompensated=uncompensated,
            command=command,
            joints=joints,
            achieved=achieved,
            wrench=wrench,
            consistency=consistency,
            passes=tuple(passes),
            evaluations=validated + sum(len(entry.coupling) for entry in passes),
        )


_ADVICE = (
    "; a resonant robot amplifies the correction near its eigenfrequencies: compute it with"
    ' mode = "quasistatic", or set cutoff_Hz to less than 0.7 of the lowest eigenfrequency'
)

METHODS = {"mirror": Mirror}


def low_pass(time: np.ndarray, correction: np.ndarray, cutoff: float) -> np.ndarray:
    """Return the part of a correction below a frequency, without delay, zero rates at the ends kept.

    Second-order Butterworth, forwards and backwards.

    Args:
        time: Evenly spaced [s], (n,).
        correction: (n, k).
        cutoff: [Hz].

    Raises:
        CouplingError: If the samples are uneven or too far apart for that frequency.
    """
    steps = np.diff(time)
    rate = 1.0 / float(np.mean(steps))
    if np.ptp(steps) > 1e-6 * np.mean(steps):
        raise CouplingError("cutoff_Hz needs a path with evenly spaced samples")
    if cutoff >= 0.5 * rate:
        return correction
    sections = butter(2, cutoff, fs=rate, output="sos")
    padding = min(len(time) - 1, int(3.0 * rate / cutoff))
    filtered: np.ndarray = sosfiltfilt(sections, correction, axis=0, padtype="even", padlen=padding)
    return filtered


def limit_rate(time: np.ndarray, correction: np.ndarray, max_rate: float) -> np.ndarray:
    """Return a correction of which no component changes faster than `max_rate`.

    The middle between the highest admissible function below and the lowest one above, so that a
    jump becomes a ramp centred on it.

    Args:
        time: Rising [s], (n,).
        correction: Positions [m] and rotations [rad], (n, 6); both are limited to `max_rate`.
        max_rate: [m/s] and [rad/s].

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
