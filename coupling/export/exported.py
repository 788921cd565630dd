"""A run's commands as programs, each judged by what its file does to the moving robot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from coupling.case import Case, PlacedRobot, load_case
from coupling.errors import ProgramError, one_of
from coupling.events import Progress, Watch, unwatched
from coupling.export.checks import require_limits
from coupling.export.interpolated import drive_motion
from coupling.export.postures import Nearest, nearest_singular
from coupling.export.sampled import Sampled
from coupling.export.spline_points import spline_points
from coupling.export.straight_points import straight_points
from coupling.files.controller_axes import ControllerAxes, controller_axes
from coupling.files.robot_file import find_robot
from coupling.inverse.joint_limits import JointLimits
from coupling.path.deviation import Deviation, measure
from coupling.path.histories import JointPath, ToolPath
from coupling.programs.languages import Language, Targets
from coupling.programs.program import Program, ProgramFile
from coupling.robot.cell import Member
from coupling.run.drive_motion import DriveMotion
from coupling.run.models import Models, cell_of
from coupling.run.stored_run import StoredRobot, read_run

# Largest loss by the export at the tool of the moving robot [m].
TOLERANCE = 5e-6
# Programs that are tried, with closer points where the last one loses too much.
_TRIES = 14
# Rounding of poses in command.csv [m].
_SAME = 1e-9
# How long before a loss its cause is looked for at first [s], a few periods of a robot's slowest
# oscillation, and how that grows: a gear may hang in its play for seconds before it shows.
_BEFORE, _GROWTH = 0.3, 1.5


@dataclass(frozen=True)
class Options:
    """What is to be written.

    Attributes:
        language: Language of the programs.
        targets: What their targets are.
        name: Name of the program; None for that of the run folder.
        tolerance: Largest loss at the tool [m].
        cycle: Period of the controller's set points [s]; None for the case's.
    """

    language: Language
    targets: Targets
    name: str | None = None
    tolerance: float = TOLERANCE
    cycle: float | None = None

    def __post_init__(self) -> None:
        if self.targets not in self.language.targets:
            text = one_of(self.language.targets, self.targets)
            raise ProgramError(f"--targets: {self.language.name}: {text}")
        if not (np.isfinite(self.tolerance) and self.tolerance > 0.0):
            raise ProgramError(
                f"--tolerance: expected a number > 0 [um], got {self.tolerance * 1e6:g}"
            )


@dataclass(frozen=True)
class Exported:
    """The program of one robot, and what its files do.

    Attributes:
        robot: Name of the robot in its case.
        program: The program, as it was written.
        files: Its files.
        points_tolerance: Smallest tolerance of its points along the command [m].
        candidates: Number of points that a program with one on every cycle has.
        loss: Largest distance between the tool of the moving robot under the files and under the
            command [m].
        command, read_back: Deviation from the desired path under the command, and under the files.
        drives: What is asked of the drives.
        nearest: Where the robot comes nearest to a singular posture.
        counted: Whether the robot file says how the controller counts.
        remark: What is to be known of the run, or empty.
    """

    robot: str
    program: Program
    files: tuple[ProgramFile, ...]
    points_tolerance: float
    candidates: int
    loss: float
    command: Deviation
    read_back: Deviation
    drives: tuple[DriveMotion, ...]
    nearest: Nearest
    counted: bool
    remark: str = ""

    @property
    def points(self) -> int:
        """Number of targets of the path."""
        return len(self.program.timed)

    @property
    def bytes(self) -> int:
        """Size of the files."""
        return sum(len(file.text.encode()) for file in self.files)

    @property
    def shortest(self) -> float:
        """Shortest time between two targets [s]."""
        return min(move.duration or np.inf for move in self.program.timed[1:])


def export_run(folder: Path, options: Options, watch: Watch = unwatched) -> tuple[Exported, ...]:
    """Return the programs of a run's robots.

    The points keep to the command within the tolerance.  Where the files, read back and simulated, then
    lose more at the moving robot's tool, which a gear in its play or an oscillation does, it is halved
    there, until they do not.

    Args:
        folder: The run folder.
        options: What is to be written.
        watch: Function that is told how far the work is.

    Raises:
        CouplingError: If the run cannot be read, a robot cannot do what is asked, or the language not
            say it.
    """
    run, case = read_run(folder), load_case(folder / "case.toml")
    cycle = options.cycle or case.controller.cycle
    _require_step(options.language, cycle)
    limits = [JointLimits.of(r.description, case.controller.max_acceleration) for r in case.robots]
    for placed, limit in zip(case.robots, limits, strict=True):
        _require_joints(options.language, len(placed.description.joints))
        require_limits(run.robots[placed.name].joints, limit, _who(case, placed))
    found = []
    with Models(case.fmu, watch) as models:
        cell, _ = cell_of(case.robots, models)
        for member, placed, limit in zip(cell.members, case.robots, limits, strict=True):
            _require_same_robot(folder, member, run.robots[placed.name])
            job = _Job(
                case,
                placed,
                member,
                run.robots[placed.name],
                _axes(case, placed),
                limit,
                replace(options, name=_name(folder, case, placed, options), cycle=cycle),
                watch,
            )
            found.append(job.best())
    return tuple(found)


@dataclass(frozen=True)
class _Job:
    """The export of one robot."""

    case: Case
    placed: PlacedRobot
    member: Member
    stored: StoredRobot
    axes: ControllerAxes
    limits: JointLimits
    options: Options
    watch: Watch

    def best(self) -> Exported:
        """Return the first program that loses no more than is allowed, or the one that loses least."""
        found: list[Exported] = []
        for one in self.tries():
            found.append(one)
            if one.loss <= self.options.tolerance:
                return one
        return min(found, key=lambda one: one.loss)

    def tries(self) -> Iterator[Exported]:
        """Yield programs with ever closer points."""
        options, language = self.options, self.options.language
        assert options.name is not None
        assert options.cycle is not None
        command = self.stored.joints
        sampled = Sampled.of(self.placed, self.axes, self.case.task.part, command, options.cycle)
        curve = sampled.curve(options.targets)
        choose = spline_points if language.between == "spline" else straight_points
        nearest = nearest_singular(
            sampled.postures, sampled.time, sampled.q, sampled.jacobians, _reach(self.placed)
        )
        reference = self._simulated(command)
        tolerance = np.full(len(sampled.time), options.tolerance)
        for number in range(_TRIES):
            self.watch(Progress("choosing points, reading them back", number, _TRIES))
            rows = (
                sampled.points
                if language.dense
                else choose(curve, sampled.time, sampled.points, tolerance)
            )
            program = sampled.program(
                options.name,
                rows,
                options.targets,
                language.between == "spline",
                language.configured,
            )
            files = language.write(program)
            read = language.read(files)
            motion = self._covering(
                drive_motion(
                    read,
                    self.placed.description,
                    self.axes,
                    options.cycle,
                    command.time[0],
                    sampled.q[sampled.points],
                )
            )
            who = _who(self.case, self.placed)
            # Corners between straight ways are rounded by the controller, which keeps its own limits.
            free = replace(self.limits, acceleration=np.full_like(self.limits.acceleration, np.inf))
            require_limits(motion, free, who)
            path = self._simulated(motion)
            desired = self.member.placement.path_in_base(self.stored.desired)
            loss = path.distance_to(reference)
            yield Exported(
                robot=self.placed.name,
                program=program,
                files=files,
                points_tolerance=float(tolerance.min()),
                candidates=len(sampled.points),
                loss=float(loss.max()),
                command=measure(reference, desired),
                read_back=measure(path, desired),
                drives=require_limits(command, self.limits, who),
                nearest=nearest,
                counted=self.axes.stated,
                remark=_remark(self.stored),
            )
            if len(rows) == len(sampled.points):
                return
            tolerance = _halved(
                tolerance,
                sampled.time,
                path.time[loss > options.tolerance],
                _BEFORE * _GROWTH**number,
            )

    def _simulated(self, command: JointPath) -> ToolPath:
        """Return the path of the moving robot's tool in its base."""
        loads = self.member.placement.wrench_in_base(self.stored.wrench)
        return self.member.robot.simulate(command, loads, "dynamic")

    def _covering(self, motion: JointPath) -> JointPath:
        """Return a motion that lasts as long as the wrench, for its end is rounded in the text."""
        end = float(self.stored.wrench.time[-1])
        if motion.time[-1] >= end:
            return motion
        time = np.append(motion.time[:-1], end)
        return JointPath(time, motion.q)


def _halved(tolerance: np.ndarray, time: np.ndarray, lost: np.ndarray, before: float) -> np.ndarray:
    """Return tolerances at times, half of what they are up to so long before something was lost.

    Example:
        >>> _halved(np.ones(4), np.array([0.0, 0.8, 1.0, 2.0]), np.array([1.0]), before=0.3)
        array([1. , 0.5, 0.5, 1. ])
    """
    first, last = np.searchsorted(lost, time), np.searchsorted(lost, time + before, side="right")
    return np.where(last > first, 0.5, 1.0) * tolerance


def _axes(case: Case, placed: PlacedRobot) -> ControllerAxes:
    table = "robot" if placed.name == "forming" else "support"
    file = find_robot(case.resolved[table]["description"])
    return controller_axes(file, len(placed.description.joints))


def _name(folder: Path, case: Case, placed: PlacedRobot, options: Options) -> str:
    """Return the name of a robot's program."""
    behind = f"_{placed.name}" if len(case.robots) > 1 else ""
    if options.name is not None:
        return options.name + behind
    own = "".join(c if c.isascii() and c.isalnum() else "_" for c in folder.resolve().name)
    own = own if own[:1].isalpha() else f"P{own}"
    return own[: options.language.longest_name - len(behind)] + behind


def _who(case: Case, placed: PlacedRobot) -> str:
    return f"{placed.name} robot: " if len(case.robots) > 1 else ""


def _reach(placed: PlacedRobot) -> float:
    """Return the sum of a robot's lengths [m]."""
    robot = placed.description
    lengths = [float(np.linalg.norm(joint.origin)) for joint in robot.joints]
    return sum(lengths) + float(np.linalg.norm(robot.tcp_position))


def _remark(stored: StoredRobot) -> str:
    if stored.figures["kind"] == "couple":
        return "the run is coupled, not compensated: its command is not corrected"
    if not stored.figures.get("converged", True):
        return f"the run has not converged: {stored.figures.get('reason', '')}"
    return ""


def _require_same_robot(folder: Path, member: Member, stored: StoredRobot) -> None:
    """Refuse a run whose robot file has been changed since."""
    own = member.planner.forward(stored.joints, stored.joints.time)
    path = member.placement.path_in_world(own)
    apart = float(path.distance_to(stored.command).max())
    if apart > _SAME:
        raise ProgramError(
            f"{folder / 'command.csv'}: expected the poses of the robot file, got some that are"
            f" {1e6 * apart:.3g} um off: the file has changed since the run, repeat it"
        )


def _require_joints(language: Language, joints: int) -> None:
    if language.joints is not None and joints != language.joints:
        raise ProgramError(
            f"--to: {language.name}: expected a robot of {language.joints} joints, got one of {joints}:"
            " csv takes any number"
        )


def _require_step(language: Language, cycle: float) -> None:
    if language.step and abs(cycle / language.step - round(cycle / language.step)) > 1e-6:
        raise ProgramError(
            f"--cycle-ms: {language.name}: expected whole multiples of {1e3 * language.step:g} ms, got"
            f" {1e3 * cycle:g} ms"
        )
