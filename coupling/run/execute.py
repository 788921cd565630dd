"""One run from a case to figures: build the FMUs, couple or correct, validate.

A method knows its own iterations. That the process answers one path differently, or that a motor which
is not simulated lacks torque, is found behind it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import cast

from coupling.case.case import Case
from coupling.events import Event, WarningEvent, Watch, unwatched
from coupling.path.deviation import Deviation, measure
from coupling.path.histories import ToolPath
from coupling.path.length_text import format_um
from coupling.path.path_ends import ends_in_motion
from coupling.results.base import Shown
from coupling.results.forecast import RunForecast
from coupling.results.limit_warning import LimitWarning
from coupling.results.repeatability import ForceNoise, Repeatability
from coupling.results.replay import Replay
from coupling.results.run_result import Kind
from coupling.robot.cell import Cell
from coupling.run.check import Check, CheckedCommand, Finding, timed
from coupling.run.checks import CHECKS
from coupling.run.cut_check import CUT_STABILITY
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.run.path_checks import OTHER_MODE
from coupling.run.plausibility import remarks
from coupling.run.predicted_motor_torques import explained_by_motors, require_motors_that_hold
from coupling.run.repeated_evaluation import (
    WITHOUT_END,
    RepeatedAnswers,
    noise_removal,
    repeat_answers,
)
from coupling.run.robustness import ROBUSTNESS
from coupling.run.sampling import SAMPLING
from coupling.run.simulated_motor_torques import MOTOR_TORQUES, motor_warnings
from coupling.solve.correction import Correction, Method, Uncorrected
from coupling.solve.scheme import Outcome
from elastic_robot.fmi.interface import IDEAL, Mode


@dataclass(frozen=True)
class RunBegins(Event):
    """A run begins."""

    desired: ToolPath


@dataclass(frozen=True)
class Run(Shown):
    """All that a run leaves.

    Attributes:
        kind: "couple" or "compensate".
        findings: Findings of `CHECKS` by name, of those that apply.
        warnings: Limits of the robot files that are passed: rates of joints, rated loads, gear torques.
        remarks: Sentences on unusual values of the case or the process's response, and on what the
            reader of a program left out or assumed.
        fmu_fingerprint: Hash of the FMUs' sources and robots.
        not_stored: Number of the process's answers that could not be kept in the store.
        keys: Keys of the process's answers in the store of evaluations, in their order, where known.
        repeatability: Difference of two responses to one path, the last one where the method has not
            converged, the first one where its forces are uneven; None where there are no two.
        noise: Noise in the process's forces; None where it can have none, or is periodic.
        forecast: Expected deviation of the robot that was measured, under the command; None where none
            was.
    """

    kind: Kind
    robots: tuple[str, ...]
    correction: Correction
    mode: Mode
    findings: Mapping[str, object]
    warnings: tuple[LimitWarning, ...]
    remarks: tuple[str, ...]
    fmu_fingerprint: str
    durations: dict[str, float] = field(default_factory=dict)
    not_stored: int = 0
    keys: tuple[str, ...] = ()
    repeatability: Repeatability | None = None
    noise: ForceNoise | None = None
    forecast: RunForecast | None = None

    def finding_of(self, check: Check[Finding]) -> Finding:
        """Return what a check has found."""
        return cast("Finding", self.findings.get(check.name, check.absent))

    @property
    def robustness(self) -> tuple[Replay, ...]:
        """Deviations under the command on robots and under forces that differ from the model's."""
        sampling = self.finding_of(SAMPLING)
        return (*self.finding_of(ROBUSTNESS), *(() if sampling is None else (sampling.replay,)))

    @property
    def desired(self) -> ToolPath:
        """Desired paths of all tools, on the times of all paths but the command."""
        return self.correction.desired

    @property
    def before(self) -> ToolPath:
        """Actual paths under the uncorrected command."""
        return self.correction.before.path

    def deviation(
        self, path: ToolPath, tool: int | None = None, other: ToolPath | None = None
    ) -> Deviation:
        """Return the deviation of a path from the desired one, or another.

        Args:
            tool: Number of the tool, from 0; None: the worst figures of all.
        """
        reference = self.desired if other is None else other
        if tool is None:
            return measure(path, reference)
        return measure(path.tools[tool], reference.tools[tool])

    @property
    def dynamic(self) -> ToolPath | None:
        """Paths of the moving robots under the corrected command and the validation's wrench."""
        if self.kind == "couple":
            return None
        return (
            self.correction.achieved
            if self.mode == "dynamic"
            else self.finding_of(OTHER_MODE).after
        )


def run_coupling(case: Case, watch: Watch = unwatched, store: Path | None = None) -> Run:
    """Couple the robots, commanded along the desired paths, with their process.

    Raises:
        CouplingError: If the path cannot be planned or the robot cannot be simulated.
    """
    return _run(case, "couple", Uncorrected(), watch, store)


def run_compensation(
    case: Case, watch: Watch = unwatched, store: Path | None = None, is_measured: bool = False
) -> Run:
    """Compute the corrected command of a case and validate it, as `run_coupling`.

    Args:
        is_measured: Whether the robot was measured: a forecast takes the place of drawn robots.
    """
    return _run(case, "compensate", case.method, watch, store, is_measured)


def coupled_path(case: Case) -> ToolPath | None:
    """Return the path on which a single robot and its process agree, base frame; None: not found."""
    (robot,) = case.robots
    with FmuPool("native") as fmus:
        cell, _ = cell_of(case.robots, fmus)
        coupled = Uncorrected().correct(case.loop(cell), case.motion)
    if coupled.outcome is not Outcome.CONVERGED:
        return None
    return coupled.achieved.transformed(robot.world_from_base.inverse())


def _run(
    case: Case,
    kind: Kind,
    method: Method,
    watch: Watch,
    store: Path | None,
    is_measured: bool = False,
) -> Run:
    durations: dict[str, float] = {}
    watch(RunBegins(case.desired))
    moving = ends_in_motion(case.desired, tuple(robot.name for robot in case.robots))
    for text in moving:
        watch(WarningEvent(text))
    require_motors_that_hold(case)
    process = case.evaluated_process(store, watch, noise_removal(case, watch))
    with explained_by_motors(case, process), FmuPool(case.fmu, watch) as fmus:
        with timed("build", durations):
            cell, models = cell_of(case.robots, fmus)
        evaluated = replace(case, process=process)
        with timed(kind, durations):
            correction = _of_program(cell, method.correct(evaluated.loop(cell, watch), case.motion))
        with timed("asked_again", durations):
            answers = repeat_answers(case, process, correction, watch)
        command = CheckedCommand(
            evaluated,
            kind,
            cell,
            models,
            fmus,
            correction,
            answers.noise,
            watch,
            is_measured,
            durations=durations,
        )
        for check in CHECKS:
            command.finding_of(check)
        warnings = [warning for check in CHECKS for warning in check.warnings(command)]
        process.settle()
        return Run(
            kind=kind,
            robots=tuple(robot.name for robot in case.robots),
            correction=final_correction(command, answers),
            mode=case.mode,
            findings=command.findings,
            warnings=(*cell.rate_warnings(correction.joints), *warnings),
            remarks=(
                *moving,
                *remarks(case, command.loads),
                *case.task.remarks,
                *command.finding_of(CUT_STABILITY).remarks,
                *(() if answers.noise is None else answers.noise.remarks),
            ),
            fmu_fingerprint="+".join(model.fmu.fingerprint for model in models),
            durations=durations,
            not_stored=process.not_stored,
            repeatability=answers.repeatability,
            noise=answers.noise,
        )


def _of_program(cell: Cell, correction: Correction) -> Correction:
    """Return a correction with its size computed from what the robots' programs have without it.

    Where a robot was touched off that is another path than the desired one.
    """
    if all(member.touch_off is None for member in cell.members):
        return correction
    program = cell.programmed(correction.desired)
    commanded = cell.forward(correction.joints, correction.desired.time)
    return replace(correction, correction=commanded.deviation_from(program))


def final_correction(command: CheckedCommand, answers: RepeatedAnswers) -> Correction:
    """Return the correction of a command with the outcome, reason and evaluations of the whole run."""
    correction = command.correction
    if chattering := _chattering(command):
        return replace(correction, outcome=Outcome.CHATTERS, reason=chattering)
    return replace(
        correction,
        evaluations=correction.evaluations + answers.evaluations,
        outcome=Outcome.ROBOT_FAILED
        if (lacking := _lacking_torque(command))
        else correction.outcome,
        reason=lacking or _reason(command, answers),
    )


def _chattering(command: CheckedCommand) -> str:
    """Return that the cut chatters, and what would not, empty where it does not.

    Then it is the cut that is at fault, whatever the iteration has come to.
    """
    stability = command.finding_of(CUT_STABILITY).stability
    if stability is None or stability.stable:
        return ""
    return (
        f"{stability.sentence[:1].lower()}{stability.sentence[1:]}; stable would be"
        f" {stability.alternative}; the iteration: {command.correction.reason}"
    )


def _lacking_torque(command: CheckedCommand) -> str:
    """Return which motor of a converged command lacks torque, empty where none does.

    What a limit costs that is in the simulation its deviation tells.
    """
    case = command.case
    if command.kind == "couple" or not command.correction.converged:
        return ""
    unlimited = [
        motors if case.mode == "quasistatic" or placed.drive == IDEAL else None
        for placed, motors in zip(case.robots, command.finding_of(MOTOR_TORQUES), strict=True)
    ]
    warnings = motor_warnings(case.robots, unlimited)
    return (
        f"the command exceeds a motor's torque: {warnings[0]}: slow down the path"
        if warnings
        else ""
    )


def _reason(command: CheckedCommand, answers: RepeatedAnswers) -> str:
    """Return why the method ended, with what the process answers differently where that counts."""
    correction, repeated = command.correction, answers.repeatability
    if repeated is None or repeated.identical or correction.outcome not in WITHOUT_END:
        return correction.reason
    if not repeated.disturbs:
        return f"{correction.reason}; and {repeated.sentence()}"
    if command.kind == "couple":
        remainder, what = correction.consistency, "the path still changes by up to"
    else:
        remainder = measure(correction.achieved, correction.desired).maximum
        what = "the deviation is up to"
    return f"{repeated.sentence()}; {what} {format_um(remainder)} um"
