"""One run from a case to figures: build the FMU, couple or compensate, validate."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from coupling.case import Case
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.path.deviation import Deviation, measure
from coupling.path.histories import JointPath, ToolPath, WrenchHistory
from coupling.path.tool_gap import PinchGap
from coupling.path.workpiece import Workpiece
from coupling.process import Process, Watchable
from coupling.robot.cell import Cell, Member
from coupling.robot.inverse_kinematics import Planner, RateWarning
from coupling.robot.robot_fmu import RobotFmu
from coupling.solve.fixed_point import Evaluation, couple
from coupling.solve.mirror import METHODS, Compensation, Observers, Pass


@dataclass(frozen=True)
class Watch:
    """Called while a run goes on, for those who watch.

    Attributes:
        progress: What is going on, steps done, steps in all.
        evaluation: Each evaluation of the process, and the deviation from the desired path [m].
        finished_pass: Each pass of a compensation.
    """

    progress: Callable[[str, int, int], None] = lambda what, done, total: None
    evaluation: Callable[[Evaluation, float], None] = lambda evaluation, deviation: None
    finished_pass: Callable[[Pass], None] = lambda finished: None


@dataclass(frozen=True)
class Shares:
    """The deviation of the uncompensated command, and that of the corrected one in dynamic mode.

    Attributes:
        gravity: Of the unloaded tool from the desired path.
        process: Of the loaded tool from the unloaded one, under the same command.
        dynamic: Of the corrected command from the desired path, simulated in dynamic mode under the
            wrench of the validation run; None where that was not run.
    """

    gravity: Deviation
    process: Deviation
    dynamic: Deviation | None = None


@dataclass(frozen=True)
class Run:
    """All that a run leaves.

    Attributes:
        kind: "couple" or "compensate".
        converged, reason: The verdict in plain words.
        desired, uncompensated, achieved, command: Tool paths.
        joints: Joint angles of `command`.
        wrench: Acting on the tool along `achieved`, with the workpiece that it leaves.
        workpiece_before: What the uncompensated command leaves, if the process tells.
        unloaded: The tool's path under gravity alone, desired path commanded.
        dynamic: Its path under `command` and `wrench` in dynamic mode; None where that was not run.
        passes: The way there, pass by pass.
        process_evaluations: In all.
        consistency: Largest distance between the path that the process saw last and `achieved` [m].
        rate_warnings: Joints that would have to move too fast.
        fmu_fingerprint: Hash of the FMU's sources and robot.
        gap: Between the tools of a cell.
        durations: Wall time by part [s].
    """

    kind: str
    converged: bool
    reason: str
    desired: ToolPath
    uncompensated: ToolPath
    achieved: ToolPath
    command: ToolPath
    joints: JointPath
    wrench: WrenchHistory
    workpiece_before: Workpiece | None
    unloaded: ToolPath
    dynamic: ToolPath | None
    passes: tuple[Pass, ...]
    process_evaluations: int
    consistency: float
    rate_warnings: list[RateWarning]
    fmu_fingerprint: str
    gap: PinchGap | None = None
    durations: dict[str, float] = field(default_factory=dict)

    @property
    def shares(self) -> Shares:
        """Of the deviation."""
        return Shares(
            gravity=measure(self.unloaded, self.desired),
            process=measure(self.uncompensated, self.unloaded),
            dynamic=None if self.dynamic is None else measure(self.dynamic, self.desired),
        )

    @property
    def before(self) -> Deviation:
        """Deviation of the uncompensated command from the desired path."""
        return measure(self.uncompensated, self.desired)

    @property
    def after(self) -> Deviation:
        """Deviation of the achieved path from the desired one."""
        return measure(self.achieved, self.desired)


@dataclass
class _Desk:
    """What both kinds of run work with; a cell of two robots does for one."""

    case: Case
    fmus: list[RobotFmu]
    robot: RobotFmu | Cell
    planner: Planner | Cell
    process: Process
    watch: Watch
    durations: dict[str, float]

    @contextmanager
    def timed(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.durations[name] = self.durations.get(name, 0.0) + time.perf_counter() - start

    def unloaded(self, joints: JointPath) -> ToolPath:
        none = WrenchHistory.none(joints.time, len(self.fmus))
        return self.robot.simulate(joints, none, self.case.settings.mode)

    def evaluated(self, evaluation: Evaluation, path: ToolPath) -> None:
        self.watch.evaluation(evaluation, measure(path, self.case.desired).maximum)


@contextmanager
def _desk(case: Case, watch: Watch) -> Iterator[_Desk]:
    durations: dict[str, float] = {}
    start = time.perf_counter()
    fmus: list[RobotFmu] = []

    def progress(done: int, total: int) -> None:
        watch.progress(f"simulating the {case.settings.mode} robot", done, total)

    def evaluating(done: int, total: int) -> None:
        watch.progress("evaluating the process", done, total)

    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        members = []
        for placed in case.robots:
            planner = Planner(placed.description, placed.home)
            options = BuildOptions(case.settings.fmu)
            file = build_fmu(placed.description, folder / f"{placed.name}.fmu", options)
            fmu = stack.enter_context(RobotFmu(file, placed.torque_curve, progress))
            fmus.append(fmu)
            members.append(Member(placed.name, placed.placement, fmu, planner))
        durations["build"] = time.perf_counter() - start
        process = case.process
        if isinstance(process, Watchable):
            process = process.watched(evaluating)
        if case.support is None:
            yield _Desk(case, fmus, fmus[0], members[0].planner, process, watch, durations)
        else:
            cell = Cell(tuple(members))
            yield _Desk(case, fmus, cell, cell, process, watch, durations)


def run_coupling(case: Case, watch: Watch | None = None) -> Run:
    """Couple the robot, commanded along the desired path, with its process.

    Raises:
        CouplingError: If the path cannot be planned or the robot cannot be simulated.
    """
    with _desk(case, watch or Watch()) as desk:
        with desk.timed("couple"):
            joints = desk.planner.plan(case.desired)
            unloaded = desk.unloaded(joints)
            result = couple(
                desk.robot,
                desk.process,
                joints,
                case.scheme(),
                case.coupling.tolerance(),
                case.coupling.max_evaluations,
                unloaded,
                desk.evaluated,
                case.settings.mode,
            )
        first = Pass(0, measure(result.path, case.desired), result.evaluations)
        return Run(
            kind="couple",
            converged=result.converged,
            reason=result.reason,
            desired=case.desired,
            uncompensated=result.path,
            achieved=result.path,
            command=case.desired,
            joints=joints,
            wrench=result.wrench,
            workpiece_before=result.wrench.workpiece,
            unloaded=unloaded,
            dynamic=None,
            passes=(first,),
            process_evaluations=len(result.evaluations),
            consistency=result.evaluations[-1].path_change,
            rate_warnings=desk.planner.rate_warnings(joints),
            fmu_fingerprint="+".join(fmu.fingerprint for fmu in desk.fmus),
            gap=_gap(case, result.path, result.path),
            durations=desk.durations,
        )


def run_compensation(case: Case, watch: Watch | None = None) -> Run:
    """Compute the corrected command of a case and validate it.

    Raises:
        CouplingError: If the desired path cannot be planned or the robot cannot be simulated.
    """
    watch = watch or Watch()
    with _desk(case, watch) as desk:
        method = METHODS[case.compensation.method](
            robot=desk.robot,
            process=desk.process,
            planner=desk.planner,
            scheme=case.scheme(),
            settings=case.compensation.settings(),
            tolerance=case.coupling.tolerance(),
            max_evaluations=case.coupling.max_evaluations,
            observers=Observers(desk.evaluated, watch.finished_pass),
            mode=case.settings.mode,
        )
        with desk.timed("compensate"):
            result = method.run(case.desired)
        with desk.timed("dynamic"):
            dynamic = _dynamic_path(desk, result)
        return Run(
            kind="compensate",
            converged=result.converged,
            reason=result.reason,
            desired=case.desired,
            uncompensated=result.uncompensated.path,
            achieved=result.achieved,
            command=result.command,
            joints=result.joints,
            wrench=result.wrench,
            workpiece_before=result.uncompensated.wrench.workpiece,
            unloaded=result.unloaded,
            dynamic=dynamic,
            passes=result.passes,
            process_evaluations=result.evaluations,
            consistency=result.consistency,
            rate_warnings=desk.planner.rate_warnings(result.joints),
            fmu_fingerprint="+".join(fmu.fingerprint for fmu in desk.fmus),
            gap=_gap(case, result.uncompensated.path, result.achieved),
            durations=desk.durations,
        )


def _dynamic_path(desk: _Desk, result: Compensation) -> ToolPath:
    """Simulate the corrected command in dynamic mode; free where the achieved path is dynamic."""
    if desk.case.settings.mode == "dynamic":
        return result.achieved
    return desk.robot.simulate(result.joints, result.wrench, "dynamic")


def _gap(case: Case, before: ToolPath, after: ToolPath) -> PinchGap | None:
    """Return the gap between the tools of a cell."""
    if case.support is None:
        return None
    forming = case.desired.tools[0]
    return PinchGap(
        before.time,
        case.support.gap,
        case.support.opening(before, forming),
        case.support.opening(after, forming),
    )


def as_figures(run: Run) -> dict[str, Any]:
    """Return a run's figures as plain data for result.json."""
    shares = run.shares
    return {
        "kind": run.kind,
        "converged": run.converged,
        "reason": run.reason,
        "process_evaluations": run.process_evaluations,
        "deviation_before_m": run.before.as_dict(),
        "deviation_after_m": run.after.as_dict(),
        "consistency_m": run.consistency,
        "peak_force_N": run.wrench.peak_force,
        "shares_m": {
            "gravity": shares.gravity.as_dict(),
            "process": shares.process.as_dict(),
            "dynamic_after": shares.dynamic.as_dict() if shares.dynamic else None,
        },
        **({} if run.gap is None else {"pinch_gap_m": run.gap.as_dict()}),
        "passes": [_pass_figures(entry) for entry in run.passes],
        "rate_warnings": [str(warning) for warning in run.rate_warnings],
        "durations_s": run.durations,
        "fmu_fingerprint": run.fmu_fingerprint,
    }


def _pass_figures(entry: Pass) -> dict[str, Any]:
    return {
        "number": entry.number,
        "deviation_m": entry.deviation.as_dict(),
        "largest_correction_step_m": entry.largest_correction_step,
        "largest_correction_step_time_s": entry.step_time,
        "rate_limited_samples": entry.limited_samples,
        "evaluations": [
            {
                "number": e.number,
                "path_change_max_m": e.path_change,
                "path_change_rms_m": e.path_change_rms,
                "force_change_relative": e.force_change if e.number > 1 else None,
                "peak_force_N": e.peak_force,
                "worst_time_s": e.worst_time,
            }
            for e in entry.coupling
        ],
    }
