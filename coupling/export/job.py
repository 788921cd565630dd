"""The export of one robot: its command, and what a program makes of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from coupling.case import Case, PlacedRobot
from coupling.events import Watch
from coupling.export.checks import remark_on, require_limits
from coupling.export.exported import Exported, Options
from coupling.export.interpolated import drive_motion
from coupling.export.postures import nearest_singular
from coupling.export.sampled import Sampled
from coupling.files.controller_axes import ControllerAxes
from coupling.inverse.joint_limits import JointLimits
from coupling.path.deviation import measure
from coupling.path.histories import JointPath, ToolPath, WrenchHistory
from coupling.robot.cell import Member
from coupling.run.stored_run import StoredRobot


@dataclass(frozen=True)
class Judged:
    """A program, and where its files leave the command.

    Attributes:
        exported: The program.
        lost: Times at which the moving robot's tool is farther off than the tolerance [s].
    """

    exported: Exported
    lost: np.ndarray


@dataclass(frozen=True)
class Job:
    """The export of one robot.

    Attributes:
        case: The case of the run.
        placed: The robot in it.
        member: The robot in its cell.
        stored: What the run holds of it.
        axes: How its controller counts.
        limits: What its drives can do.
        options: What is to be written, with name and cycle.
        watch: Function that is told how far the work is.
        who: The robot, for messages.
    """

    case: Case
    placed: PlacedRobot
    member: Member
    stored: StoredRobot
    axes: ControllerAxes
    limits: JointLimits
    options: Options
    watch: Watch
    who: str

    @property
    def cycle(self) -> float:
        """Period of the controller's set points [s]."""
        return self.options.cycle or self.case.controller.cycle

    @cached_property
    def loads(self) -> WrenchHistory:
        """The run's wrench on the tool, in the robot's base."""
        return self.member.placement.wrench_in_base(self.stored.wrench)

    @cached_property
    def reference(self) -> ToolPath:
        """Path of the moving robot's tool under the command, in its base."""
        return self.simulated(self.stored.joints)

    def simulated(self, command: JointPath) -> ToolPath:
        """Return the path of the moving robot's tool in its base."""
        return self.member.robot.simulate(command, self.loads, "dynamic")

    def sampled(self, command: JointPath) -> Sampled:
        """Return a motion of the drives on the controller's cycle."""
        part = self.case.task.part
        return Sampled.of(self.placed, self.axes, part, command, self.cycle)

    def judged(self, sampled: Sampled, rows: np.ndarray, points_tolerance: float) -> Judged:
        """Return the program through chosen rows, judged by what its files do.

        Args:
            sampled: Motion of the drives.
            rows: The rows.
            points_tolerance: Smallest tolerance that they keep [m].

        Raises:
            ProgramError: If the language cannot say it, or a drive not do it.
        """
        options, language = self.options, self.options.language
        assert options.name is not None
        program = sampled.program(
            options.name, rows, options.targets, language.between == "spline", language.posture
        )
        files = language.write(program)
        motion = self._covering(
            drive_motion(
                language.read(files),
                self.placed.description,
                self.axes,
                self.cycle,
                self.stored.joints.time[0],
                sampled.q[sampled.points],
            )
        )
        # Corners between straight ways are rounded by the controller, which keeps its own limits.
        free = replace(self.limits, acceleration=np.full_like(self.limits.acceleration, np.inf))
        require_limits(motion, free, self.who)
        path = self.simulated(motion)
        desired = self.member.placement.path_in_base(self.stored.desired)
        loss = path.distance_to(self.reference)
        exported = Exported(
            robot=self.placed.name,
            program=program,
            files=files,
            points_tolerance=points_tolerance,
            candidates=len(sampled.points),
            loss=float(loss.max()),
            command=measure(self.reference, desired),
            read_back=measure(path, desired),
            drives=require_limits(self.stored.joints, self.limits, self.who),
            nearest=nearest_singular(
                sampled.postures, sampled.time, sampled.q, sampled.jacobians, _reach(self.placed)
            ),
            counted=self.axes.stated,
            remark=remark_on(self.stored),
        )
        return Judged(exported, path.time[loss > options.tolerance])

    def _covering(self, motion: JointPath) -> JointPath:
        """Return a motion that lasts as long as the wrench, for its end is rounded in the text."""
        end = float(self.stored.wrench.time[-1])
        if motion.time[-1] >= end:
            return motion
        time = np.append(motion.time[:-1], end)
        return JointPath(time, motion.q)


def _reach(placed: PlacedRobot) -> float:
    """Return the sum of a robot's lengths [m]."""
    robot = placed.description
    lengths = [float(np.linalg.norm(joint.origin)) for joint in robot.joints]
    return sum(lengths) + float(np.linalg.norm(robot.tcp_position))
