"""One run from a case to figures: build the FMUs, couple or correct, validate."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from coupling.case.case import Case
from coupling.errors import SimulationError
from coupling.events import Event, WarningEvent, Watch, unwatched
from coupling.inverse.diagnosis import GearDiagnosis
from coupling.inverse.joint_limits import JointLimits
from coupling.path.deviation import ToolGap
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.path.path_ends import ends_in_motion
from coupling.process.repeatability import Repeatability
from coupling.process.smoothing import ForceNoise
from coupling.results.forecast import RunForecast
from coupling.results.outlook import DrawnReplays, Replay
from coupling.results.run_result import DriveMotion, Kind
from coupling.robot.cell import Cell
from coupling.robot.robot import LimitWarning
from coupling.robot.simulated_model import SimulatedModel
from coupling.run.drawn_plants import DRAWS, drawn_replays
from coupling.run.drive_motion import drive_motions
from coupling.run.gear_loads import at_samples, diagnose_robots
from coupling.run.load_limits import load_warnings
from coupling.run.models import Models, cell_of
from coupling.run.motor_demands import explained_by_motors, require_motors_that_hold
from coupling.run.motor_loads import MotorLoads, motor_loads, motor_warnings
from coupling.run.plant import PlantReplay, plant_cell, run_on_plant
from coupling.run.plausibility import remarks
from coupling.run.repeated_evaluation import (
    RememberedProcess,
    explained,
    repeated_evaluation,
    smoothed_process,
)
from coupling.run.robustness import noise_replays, replayed
from coupling.run.sampling import SamplingCheck, sampling_of
from coupling.solve.correction import Correction, Method, Uncorrected
from coupling.solve.fixed_point import Loop
from coupling.solve.outcome import Outcome
from elastic_robot.fmi.interface import IDEAL, Mode


@dataclass(frozen=True)
class RunBegins(Event):
    """A run begins.

    Attributes:
        desired: Desired paths of all tools.
    """

    desired: ToolPath


@dataclass(frozen=True)
class Run:
    """All that a run leaves.

    Attributes:
        kind: "couple" or "compensate".
        robots: Names of the robots, in the order of the tools.
        correction: Correction that the method found.
        mode: Mode in which the robots were simulated.
        other_before, other_after: Paths of the robots simulated in the other mode, without inertia for
            moving ones, under the commands and wrenches of the paths before and after; None where that
            was not possible, and after a coupling no path after.
        unloaded_after: Paths under the corrected command and gravity alone; None likewise.
        robustness: Deviations under the corrected command on robots and under forces that differ from
            the model's.
        plant: Deviation under the command on the case's plant; None where it has none.
        drives: Demands of the command on the drives of every robot.
        motors: Demands on their motors; None for a robot without any, or that was not simulated.
        warnings: Limits of the robot files that are passed: rates of joints, rated loads, gear torques.
        remarks: Sentences on unusual values of the case or the process's response, and on what the
            reader of a program left out or assumed.
        fmu_fingerprint: Hash of the FMUs' sources and robots.
        gap: Gap between the tools of a cell; None for one robot.
        gears: Torques and reversals of the gears of every robot along its path.
        durations: Wall time by part [s].
        keys: Keys of the process's answers in the store of evaluations, in their order, where known.
        repeatability: Difference of two responses to one path, the last one where the method has not
            converged, the first one where its forces are uneven; None where there are no two.
        noise: Noise in the process's forces; None where it can have none, or is periodic.
        forecast: Expected deviation of the robot that was measured, under the command; None where none
            was.
        drawn: Deviations under the corrected command on robots and under forces drawn from the ranges
            that their sources state.
    """

    kind: Kind
    robots: tuple[str, ...]
    correction: Correction
    mode: Mode
    other_before: ToolPath | None
    other_after: ToolPath | None
    unloaded_after: ToolPath | None
    robustness: tuple[Replay, ...]
    plant: PlantReplay | None
    drives: tuple[tuple[DriveMotion, ...], ...]
    motors: tuple[MotorLoads | None, ...]
    warnings: tuple[LimitWarning, ...]
    remarks: tuple[str, ...]
    fmu_fingerprint: str
    gap: ToolGap | None = None
    gears: tuple[tuple[GearDiagnosis, ...], ...] = ()
    durations: dict[str, float] = field(default_factory=dict)
    keys: tuple[str, ...] = ()
    repeatability: Repeatability | None = None
    noise: ForceNoise | None = None
    forecast: RunForecast | None = None
    drawn: DrawnReplays = field(default_factory=DrawnReplays)

    @property
    def desired(self) -> ToolPath:
        """Desired paths of all tools, on the times of all paths but the command."""
        return self.correction.desired

    @property
    def before(self) -> ToolPath:
        """Actual paths under the uncorrected command."""
        return self.correction.before.path

    @property
    def dynamic(self) -> ToolPath | None:
        """Paths of the moving robots under the corrected command and the validation's wrench."""
        if self.kind == "couple":
            return None
        return self.correction.achieved if self.mode == "dynamic" else self.other_after


def run_coupling(case: Case, watch: Watch = unwatched) -> Run:
    """Couple the robots, commanded along the desired paths, with their process.

    Raises:
        CouplingError: If the path cannot be planned or the robot cannot be simulated.
    """
    return _run(case, "couple", Uncorrected(), watch)


def run_compensation(case: Case, watch: Watch = unwatched) -> Run:
    """Compute the corrected command of a case and validate it.

    Raises:
        CouplingError: As `run_coupling`.
    """
    return _run(case, "compensate", case.method, watch)


def loop_of(case: Case, cell: Cell, watch: Watch = unwatched) -> Loop[Cell]:
    """Return the loop of a case's robots and its process, as its tables say.

    Args:
        watch: Function called with what happens.
    """
    return Loop(
        cell,
        case.process,
        case.mode,
        case.coupling.new_scheme(),
        case.coupling.tolerance(),
        case.coupling.max_evaluations,
        case.controller,
        watch,
    )


def _run(case: Case, kind: Kind, method: Method, watch: Watch) -> Run:
    durations: dict[str, float] = {}
    watch(RunBegins(case.desired))
    moving = ends_in_motion(case.desired, tuple(robot.name for robot in case.robots))
    for text in moving:
        watch(WarningEvent(text))
    require_motors_that_hold(case)
    remembered = RememberedProcess(case.process)
    with explained_by_motors(case, remembered), Models(case.fmu, watch) as fmus:
        with _timed("build", durations):
            cell, models = cell_of(case.robots, fmus)
        quiet = smoothed_process(case, remembered, watch)
        significant = replace(case, process=remembered if quiet is None else quiet)
        loop = loop_of(significant, cell, watch)
        with _timed(kind, durations):
            correction = _of_program(cell, method.correct(loop, case.motion))
        with _timed("asked_again", durations):
            first, last = None if quiet is None else quiet.repeatability, None
            if first is None or not first.disturbs:
                last = repeated_evaluation(case, remembered.last, correction, watch)
            repeated = last or first
            correction = explained(correction, kind, repeated)
            more = sum(comparison is not None for comparison in (first, last))
            correction = replace(correction, evaluations=correction.evaluations + more)
        noise = None if quiet is None else quiet.noise
        unloaded_after: ToolPath | None = None
        if kind == "compensate":
            with _timed("unloaded", durations):
                none = WrenchHistory.none(correction.desired.time, len(correction.joints.q))
                unloaded_after = _simulated(cell, correction.joints, none, case.mode)
        other_after: ToolPath | None = None
        with _timed("other_mode", durations):
            other = other_mode(case.mode)
            before = correction.before
            other_before = _simulated(cell, before.joints, before.wrench, other)
            if kind == "compensate":
                other_after = _simulated(cell, correction.joints, correction.response.wrench, other)
        replays: tuple[Replay, ...] = ()
        drawn = DrawnReplays()
        sampling: SamplingCheck | None = None
        if kind == "compensate":
            ranges = [placed.provenance.stiffness_ranges for placed in case.robots]
            with _timed("robustness", durations), Models(case.fmu, watch) as others:
                replays = replayed(cell, models, correction)
                factors = case.process_table.FORCE_FACTORS
                drawn = drawn_replays(
                    cell, models, ranges, factors, correction, others.of, DRAWS[case.fmu]
                )
                replays += noise_replays(cell, case.desired.time, noise, correction)
            with _timed("sampling", durations):
                sampling = sampling_of(case, cell, correction)
        plant: PlantReplay | None = None
        if case.plant is not None:
            with _timed("plant", durations):
                differing = plant_cell(cell, case.plant, fmus)
                plant = run_on_plant(significant, differing, correction, watch)
        with _timed("motors", durations):
            motors = _motors(cell, models, correction)
            correction = _within_motors(case, kind, correction, motors)
        with _timed("gears", durations):
            loads = at_samples(correction.response.wrench, correction.achieved, case.desired)
            gears = diagnose_robots(
                case.robots, case.desired, loads, cell.undeflected(case.desired)
            )
        return Run(
            kind=kind,
            robots=tuple(robot.name for robot in case.robots),
            correction=correction,
            mode=case.mode,
            other_before=other_before,
            other_after=other_after,
            unloaded_after=unloaded_after,
            robustness=replays if sampling is None else (*replays, sampling.replay),
            drawn=drawn,
            plant=plant,
            drives=_drives(case, correction, motors),
            motors=motors,
            warnings=(
                *cell.rate_warnings(correction.joints),
                *motor_warnings(case.robots, motors),
                *load_warnings(case.robots, loads, gears),
                *(() if sampling is None else sampling.warnings(case.method.tolerance_m)),
            ),
            remarks=(
                *moving,
                *remarks(case, loads),
                *case.task.remarks,
                *(() if noise is None else noise.remarks),
            ),
            fmu_fingerprint="+".join(model.fmu.fingerprint for model in models),
            gap=_gap(case, correction),
            gears=gears,
            durations=durations,
            repeatability=repeated,
            noise=noise,
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


@contextmanager
def _timed(name: str, durations: dict[str, float]) -> Iterator[None]:
    start = time.perf_counter()
    yield
    durations[name] = time.perf_counter() - start


def other_mode(mode: Mode) -> Mode:
    """Return the mode that robots of a mode are compared with."""
    return "quasistatic" if mode == "dynamic" else "dynamic"


def _simulated(cell: Cell, joints: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath | None:
    """Return the paths in a mode; None where they cannot be simulated, which spoils no result."""
    try:
        return cell.simulate(joints, wrench, mode)
    except SimulationError:
        return None


def _motors(
    cell: Cell, models: Sequence[SimulatedModel], correction: Correction
) -> tuple[MotorLoads | None, ...]:
    """Return what a command asks of the motors of every robot; None where that is not simulated."""
    demands: list[MotorLoads | None] = []
    loads = correction.response.wrench.tools
    for member, model, joints, load in zip(
        cell.members, models, correction.joints.robots, loads, strict=True
    ):
        in_base = load.transformed(member.world_from_base.inverse())
        try:
            demands.append(motor_loads(model, joints, in_base))
        except SimulationError:
            demands.append(None)
    return tuple(demands)


def _within_motors(
    case: Case, kind: Kind, correction: Correction, motors: Sequence[MotorLoads | None]
) -> Correction:
    """Return a correction that has not converged where motors that were not simulated have too little.

    What a limit costs that is in the simulation its deviation tells.
    """
    unlimited = [
        motor if case.mode == "quasistatic" or placed.drive == IDEAL else None
        for placed, motor in zip(case.robots, motors, strict=True)
    ]
    warnings = motor_warnings(case.robots, unlimited)
    if kind == "couple" or not warnings or not correction.converged:
        return correction
    reason = f"the command exceeds a motor's torque: {warnings[0]}: slow down the path"
    return replace(correction, outcome=Outcome.ROBOT_FAILED, reason=reason)


def _drives(
    case: Case, correction: Correction, motors: Sequence[MotorLoads | None]
) -> tuple[tuple[DriveMotion, ...], ...]:
    """Return what a command asks of the drives of every robot, and of their motors."""
    demands = []
    for joints, placed, motor in zip(correction.joints.robots, case.robots, motors, strict=True):
        limits = JointLimits.of(placed.description, case.controller.max_acceleration)
        drives = drive_motions(joints, limits)
        demands.append(drives if motor is None else motor.beside(drives))
    return tuple(demands)


def _gap(case: Case, correction: Correction) -> ToolGap | None:
    """Return the gap between the tools of a cell."""
    support = case.task.support
    if support is None:
        return None
    before, after = support.opening(correction.before.path), support.opening(correction.achieved)
    return ToolGap(correction.desired.time, support.gap, before, after)
