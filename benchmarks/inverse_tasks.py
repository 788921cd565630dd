"""What is inverted in the benchmark of the inverse: paths with their wrenches, whole and half."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.task import ROBOT, TRAJECTORY
from coupling.case.file import load_case
from coupling.inverse.inversion import DesiredMotion
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.robot.inverse_kinematics import InverseKinematics
from elastic_robot.trajectory import read_trajectory

CONE = Path(__file__).parent.parent / "examples" / "cases" / "cone.toml"
# Samples of the ISO path [s].
_SAMPLE = 0.02


@dataclass(frozen=True)
class InverseTask:
    """A path of one robot and the wrench on it.

    Attributes:
        name: Shown in the table.
        path: Of its tool, in its base.
        wrench: At the same times.
        home: Joint angles where inverse kinematics starts [rad].
    """

    name: str
    path: ToolPath
    wrench: WrenchHistory
    home: np.ndarray

    @property
    def duration(self) -> float:
        """Length [s]."""
        return float(self.path.time[-1] - self.path.time[0])

    def plan(self) -> JointPath:
        """Return the joint angles of the undeflected robot."""
        return InverseKinematics(ROBOT, self.home).plan(self.path)

    def wanted(self) -> DesiredMotion:
        """Return what the robot is to do."""
        return DesiredMotion(self.path, self.plan(), self.wrench)

    def first(self, part: float) -> InverseTask:
        """Return the first part of the task, cut in mid-motion."""
        rows = np.arange(round(part * (len(self.path.time) - 1)) + 1)
        loads = self.wrench.wrench[:, rows]
        return InverseTask(
            self.name,
            self.path.at_rows(rows),
            WrenchHistory(self.path.time[rows], loads),
            self.home,
        )

    def there_and_back(self, times: int) -> InverseTask:
        """Return the task, then it backwards, then again: as long as wanted, and at rest in between."""
        time, pose, load = self.path.time - self.path.time[0], self.path.pose, self.wrench.wrench
        end = float(time[-1])
        moments, poses, loads = [time], [pose], [load]
        for k in range(1, times):
            step = slice(None, None, -1 if k % 2 else 1)
            moments.append((k * end + (end - time if k % 2 else time)[step])[1:])
            poses.append(pose[:, step][:, 1:])
            loads.append(load[:, step][:, 1:])
        all_times = np.concatenate(moments)
        return InverseTask(
            self.name,
            ToolPath(all_times, np.concatenate(poses, axis=1)),
            WrenchHistory(all_times, np.concatenate(loads, axis=1)),
            self.home,
        )


def iso_task() -> InverseTask:
    """Return the ISO 9283 path at 0.25 m/s, in the air."""
    drives = read_trajectory(TRAJECTORY, len(ROBOT.joints))
    time = _SAMPLE * np.arange(round(22.8 / _SAMPLE) + 1)
    q = drives.at(time)[0]
    path = InverseKinematics(ROBOT, q[0]).forward(JointPath(time, (q,)), time)
    return InverseTask("ISO 9283, 0.25 m/s", path, WrenchHistory.none(time), q[0])


def cone_task() -> InverseTask:
    """Return the cone of examples/cases under its forming force."""
    case = load_case(CONE)
    (robot,) = case.robots
    return InverseTask("cone", case.desired, case.process.evaluate(case.desired).wrench, robot.home)
