"""A run's commands as programs, each judged by what its file does to the moving robot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from coupling.case import Case, PlacedRobot, load_case
from coupling.events import Progress, Watch, unwatched
from coupling.export.checks import (
    remark_on,
    require_joints,
    require_limits,
    require_robots,
    require_same_robot,
    require_step,
)
from coupling.export.exported import Exported, Options
from coupling.export.interpolated import drive_motion
from coupling.export.postures import nearest_singular
from coupling.export.sampled import Sampled
from coupling.export.spline_points import spline_points
from coupling.export.straight_points import straight_points
from coupling.files.controller_axes import ControllerAxes, controller_axes
from coupling.files.robot_file import find_robot
from coupling.inverse.joint_limits import JointLimits
from coupling.path.deviation import measure
from coupling.path.histories import JointPath, ToolPath
from coupling.robot.cell import Member
from coupling.run.models import Models, cell_of
from coupling.run.stored_run import StoredRobot, read_run

# Programs that are tried, with closer points where the last one loses too much.
_TRIES = 14
# How long before a loss its cause is looked for at first [s], a few periods of a robot's slowest
# oscillation, and how that grows: a gear may hang in its play for seconds before it shows.
_BEFORE, _GROWTH = 0.3, 1.5


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
    require_robots(folder, case, run)
    cycle = options.cycle or case.controller.cycle
    require_step(options.language, cycle)
    limits = [JointLimits.of(r.description, case.controller.max_acceleration) for r in case.robots]
    for placed, limit in zip(case.robots, limits, strict=True):
        require_joints(options.language, len(placed.description.joints))
        require_limits(run.robots[placed.name].joints, limit, _who(case, placed))
    found = []
    with Models(case.fmu, watch) as models:
        cell, _ = cell_of(case.robots, models)
        for member, placed, limit in zip(cell.members, case.robots, limits, strict=True):
            require_same_robot(folder, member, run.robots[placed.name])
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
                language.posture,
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
                remark=remark_on(self.stored),
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
