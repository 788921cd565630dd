"""The command of one robot, sampled: what is exported of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.case.case import PlacedRobot
from coupling.export.curves import JointCurve, PoseCurve, SampledCurve, continuous
from coupling.export.frames import controller_from_base, part_frame, tool_frame
from coupling.export.interpolated import NearAngles
from coupling.export.postures import Postures, nearest_singular
from coupling.files.controller_axes import ControllerAxes
from coupling.path.controller import Controller
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.path.joint_path import JointPath
from coupling.programs.languages import Posture, Targets
from coupling.programs.program import ProgramMove, RobotProgram
from coupling.results.export_result import NearestSingularity
from coupling.robot.inverse_kinematics import InverseKinematics

# Speed with which the tool goes to where the path begins [m/s].
_APPROACH = 0.01


@dataclass(frozen=True)
class SampledCommand:
    """The command of one robot.

    Attributes:
        time: Twice on every cycle [s], (n,).
        q: Drive angles [rad], (n, joints).
        pose: Positions [m] and quaternions of the undeflected TCP in the part's frame, (n, 7).
        points: Numbers of the rows that may become points, (m,).
        jacobians: Jacobians of TCP [m/rad] and rotation by the angles, (n, 6, joints).
        lever: Vector from the TCP to the wrist [m].
    """

    time: np.ndarray
    q: np.ndarray
    pose: np.ndarray
    points: np.ndarray
    jacobians: np.ndarray
    lever: float
    base: Frame
    tool: Frame
    axes: ControllerAxes
    postures: Postures

    @classmethod
    def of(
        cls, robot: PlacedRobot, axes: ControllerAxes, part: Frame, command: JointPath, cycle: float
    ) -> SampledCommand:
        """Sample a command."""
        rows = Controller(cycle).rows(command.time[0], command.time[-1])
        steps = len(rows) - 1
        time = np.interp(np.arange(2 * steps + 1) / 2, np.arange(steps + 1), rows)
        # A last row behind the command's end holds its end.
        q = command.trajectory.at(time.clip(max=command.time[-1]))[0]
        description = robot.description
        planner = InverseKinematics(description, robot.home)
        tool_path = ToolPath(time, planner.poses(q))
        base = part_frame(part, robot, axes)
        pose = tool_path.transformed(base.inverse() @ controller_from_base(axes)).pose[0]
        pose[:, 3:] = continuous(pose[:, 3:])
        postures = Postures(description, axes)
        return cls(
            time=time,
            q=q,
            pose=pose,
            points=2 * np.arange(steps + 1),
            jacobians=postures.jacobians(q),
            lever=float(
                np.linalg.norm(description.joints[-1].origin)
                + np.linalg.norm(description.tcp_position)
            ),
            base=base,
            tool=tool_frame(description, axes),
            axes=axes,
            postures=postures,
        )

    @cached_property
    def nearest(self) -> NearestSingularity:
        """Posture of the motion that is nearest to a singular one."""
        return nearest_singular(self.postures, self.time, self.q, self.jacobians)

    @cached_property
    def near(self) -> NearAngles | None:
        """Angles at the points; None where they are singular."""
        return NearAngles.of(self.q[self.points], self.jacobians[self.points])

    def curve(self, targets: Targets) -> SampledCurve:
        """Return the motion that points are chosen of."""
        if targets == "joints":
            return JointCurve(self.q, self.jacobians, self.lever)
        return PoseCurve(self.pose, self.lever)

    def program(
        self, name: str, rows: np.ndarray, targets: Targets, spline: bool, posture: Posture
    ) -> RobotProgram:
        """Return the program through chosen rows, by their numbers (k,).

        It begins with a motion of the joints to where the command begins.

        Args:
            rows: Numbers of the rows, the first and the last among them, (k,).
        """
        angles = [tuple(row) for row in self.axes.controller_angles(self.q[rows]).tolist()]
        durations = np.diff(self.time[rows]).tolist()
        moves = [ProgramMove("joint", joints=angles[0])]
        if targets == "joints":
            moves += [
                ProgramMove("spline" if spline else "joint", joints=row, duration=duration)
                for row, duration in zip(angles[1:], durations, strict=True)
            ]
            return RobotProgram(name, tuple(moves), self.base.pose, self.tool.pose)
        poses = [tuple(row) for row in self.pose[rows].tolist()]
        stated = posture == "always" or (
            posture == "known" and self.axes.stated and self.postures.are_named(self.q[0])
        )
        postures = [self.postures.configuration(q) if stated else None for q in self.q[rows]]
        moves.append(ProgramMove("linear", poses[0], speed=_APPROACH, configuration=postures[0]))
        moves += [
            ProgramMove(
                "spline" if spline else "linear",
                pose,
                duration=duration,
                configuration=posture_there,
            )
            for pose, duration, posture_there in zip(
                poses[1:], durations, postures[1:], strict=True
            )
        ]
        return RobotProgram(name, tuple(moves), self.base.pose, self.tool.pose)
