"""The export of one robot: its command, and what a program makes of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from coupling.errors import ProgramError
from coupling.events import Watch
from coupling.export.commands import RobotCommand
from coupling.export.exported_program import ExportedProgram, ExportOptions, times_between
from coupling.export.interpolated import drive_motion, joint_lines
from coupling.export.preconditions import require_limits
from coupling.export.sampled import SampledCommand
from coupling.inverse.joint_limits import JointLimits
from coupling.path.deviation import Deviation, measure
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.programs.program import ProgramFile, RobotProgram
from coupling.results.export_result import ExportedFileResult, ExportedProgramResult
from coupling.robot.cell import Member

# Smallest singular value of a Jacobian, lengths in units of the reach, at which poses tell angles.
_SINGULAR = 1e-4


@dataclass(frozen=True)
class CheckedProgram:
    """A program, and where its files leave the command.

    Attributes:
        lost: Times at which the moving robot's tool is farther off than the tolerance [s], (k,).
    """

    exported: ExportedProgram
    lost: np.ndarray


@dataclass(frozen=True)
class ExportJob:
    """The export of one robot."""

    command: RobotCommand
    member: Member
    limits: JointLimits
    options: ExportOptions
    watch: Watch

    @property
    def cycle(self) -> float:
        """Period of the controller's set points [s]."""
        return self.options.cycle or self.command.controller.cycle

    @cached_property
    def loads(self) -> WrenchHistory:
        """The wrench on the tool, in the robot's base."""
        return self.command.wrench.transformed(self.member.world_from_base.inverse())

    @cached_property
    def reference(self) -> ToolPath:
        """Path of the moving robot's tool under the command, in its base."""
        return self.simulated(self.command.joints)

    def simulated(self, command: JointPath) -> ToolPath:
        """Return the path of the moving robot's tool in its base."""
        return self.member.robot.simulate(command, self.loads, "dynamic")

    def sampled(self, command: JointPath) -> SampledCommand:
        """Return a motion of the drives on the controller's cycle."""
        command_of_robot = self.command
        return SampledCommand.of(
            command_of_robot.placed,
            command_of_robot.axes,
            command_of_robot.part,
            command,
            self.cycle,
        )

    def loss_through(self, sampled: SampledCommand, rows: np.ndarray) -> np.ndarray:
        """Return how far the tool is off under a program, by its numbers without a text.

        Args:
            sampled: Motion of the drives.
            rows: Numbers of the rows, (k,).

        Returns:
            Distances at the instants of the wrench [m], (n,).
        """
        options, language = self.options, self.options.language
        spline = language.between == "spline"
        program = sampled.program("", rows, options.targets, spline, "never")
        path = self.simulated(self._drive_motion(language.rounded(program), sampled))
        return path.distance_to(self.reference)

    def check_rows(
        self, sampled: SampledCommand, rows: np.ndarray, points_tolerance: float
    ) -> CheckedProgram:
        """Return the program through chosen rows, by their numbers (k,), judged by what its files do.

        Args:
            rows: Numbers of the rows, (k,).
            points_tolerance: Smallest tolerance that they keep [m].
        """
        command, options, language = self.command, self.options, self.options.language
        assert options.name is not None
        program = sampled.program(
            options.name, rows, options.targets, language.between == "spline", language.posture
        )
        files = language.write(program)
        motion = self._read_back(files, sampled)
        # Corners between straight ways are rounded by the controller, which keeps its own limits.
        free = replace(self.limits, acceleration=np.full_like(self.limits.acceleration, np.inf))
        require_limits(motion, free, command.who)
        path = self.simulated(motion)
        loss = path.distance_to(self.reference)
        times = times_between(program)
        figures = ExportedProgramResult(
            robot=command.placed.name,
            program=program.name,
            files=tuple(
                ExportedFileResult(name=file.name, bytes=len(file.text.encode())) for file in files
            ),
            points=len(program.timed),
            points_on_every_cycle=len(sampled.points),
            points_tolerance_m=points_tolerance,
            shortest_time_s=float(times.min()),
            median_time_s=float(np.median(times)),
            loss_m=float(loss.max()),
            deviation_of_command_m=self._deviation(self.reference),
            deviation_of_file_m=self._deviation(path),
            base=program.base,
            tool=program.tool,
            counted_as_controller=command.axes.stated,
            nearest_singularity=sampled.nearest,
            drives=require_limits(command.joints, self.limits, command.who),
        )
        exported = ExportedProgram(program, files, figures, command.remark)
        return CheckedProgram(exported, path.time[loss > options.tolerance])

    def on_joint_lines(self, exported: ExportedProgram, sampled: SampledCommand) -> ExportedProgram:
        """Return a program with what it loses if the drives go straight from set point to set point."""
        path = self.simulated(joint_lines(self._read_back(exported.files, sampled)))
        loss = {"loss_on_joint_lines_m": float(path.distance_to(self.reference).max())}
        return replace(exported, figures=exported.figures.model_copy(update=loss))

    def _read_back(self, files: tuple[ProgramFile, ...], sampled: SampledCommand) -> JointPath:
        """Return the motion of the drives under the text of a program."""
        return self._drive_motion(self.options.language.read(files), sampled)

    def _drive_motion(self, program: RobotProgram, sampled: SampledCommand) -> JointPath:
        command = self.command
        return self._covering(
            drive_motion(
                program,
                command.placed.description,
                command.axes,
                self.cycle,
                command.joints.time[0],
                sampled.near,
            )
        )

    def require_regular_poses(self, sampled: SampledCommand) -> None:
        """Refuse a motion whose poses do not tell its joint angles.

        Raises:
            ProgramError: With the singular posture that it goes through.
        """
        nearest = sampled.nearest
        if nearest.value < _SINGULAR:
            raise ProgramError(
                f"{self.command.who}expected no singular posture, as poses do not determine its joint"
                f" angles, got one at {nearest.time:.3f} s ({nearest.kind}): write joint angles with"
                " --targets joints"
            )

    def _deviation(self, path: ToolPath) -> Deviation | None:
        """Return the deviation of the tool from where it should be, None where nobody knows."""
        desired = self.command.desired
        if desired is None:
            return None
        return measure(path, self.member.model_path(desired))

    def _covering(self, motion: JointPath) -> JointPath:
        """Return a motion that lasts as long as the wrench, for its end is rounded in the text."""
        end = float(self.command.wrench.time[-1])
        if motion.time[-1] >= end:
            return motion
        time = np.append(motion.time[:-1], end)
        return JointPath(time, motion.q)
