"""The robot's native FMU with ideal drives that move as motors did: wind-up and torque of every gear."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from coupling.errors import SimulationError
from coupling.files.scratch import ScratchFolder
from coupling.fmu.job import FmuError, SimulationJob
from coupling.fmu.worker import WorkerEndedError, WorkerProcess, unpack
from coupling.fmu_export.build import build_fmu
from coupling.identification.motion.recording import SmoothedMotion
from coupling.path.joint_path import JointPath
from coupling.robot.robot_fmu import save_trajectory
from coupling.robot.unpacked_robot import UnpackedRobot
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot

# Error allowed at the TCP [m]: at an arm of a metre and more less than the encoders' noise.
_TOLERANCE = 5e-7
# Simulations that are kept: those of one Jacobian, with which the next fit begins.
_KEPT = 48


@dataclass(frozen=True)
class GearMotion:
    """What the gears of a moved robot do, n rows of j joints.

    Attributes:
        rows: Wind-ups [rad], then torques [N m], (n, 2 j).
    """

    rows: np.ndarray

    @property
    def wind_up(self) -> np.ndarray:
        """Angles of the links less those of the drives [rad], (n, j)."""
        return self.rows[:, : self.rows.shape[1] // 2]

    @property
    def torque(self) -> np.ndarray:
        """Torques of the gears on their links [N m], (n, j)."""
        return self.rows[:, self.rows.shape[1] // 2 :]


class MovedRobot:
    """An FMU whose robot has other numbers in every simulation; a context manager that cleans up.

    Args:
        robot: The robot, none of whose joints is rigid; others must have the same joints and parts.

    Raises:
        SimulationError: If the FMU cannot run here.
    """

    def __init__(self, robot: Robot) -> None:
        self._torsions = build_chain(robot).torsions
        self._folder = ScratchFolder()
        self._kept: deque[tuple[Robot, SmoothedMotion, GearMotion]] = deque(maxlen=_KEPT)
        self._saved: SmoothedMotion | None = None
        self._worker: WorkerProcess | None = None
        file = build_fmu(robot, self._folder.path / "moved.fmu")
        try:
            unpack(file, self._folder.path / "fmu")
            self._worker = WorkerProcess(self._folder.path / "fmu")
        except FmuError as cause:
            self.close()
            raise SimulationError(f"{robot.name}: {cause}") from cause
        self._unpacked = UnpackedRobot(self._folder.path / "fmu")

    def __enter__(self) -> MovedRobot:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the process and remove its files."""
        if self._worker is not None:
            self._worker.close()
        self._folder.close()

    def moved(self, robot: Robot, time: np.ndarray, motion: SmoothedMotion) -> GearMotion:
        """Return what the gears of a robot do while its drives move.

        Args:
            robot: The robot with these numbers.
            time: Times [s], (n,).
            motion: Motion of the drives.

        Raises:
            SimulationError: If the FMU refuses the robot or a step.
        """
        assert self._worker is not None
        for known, moved, gears in self._kept:
            if moved is motion and known == robot:
                return gears
        self._unpacked.describe(robot)
        trajectory = self._folder.path / "trajectory.npz"
        if motion is not self._saved:
            command = JointPath(time, (motion.q,), (motion.qd,), (motion.qdd,))
            save_trajectory(trajectory, command)
            self._saved = motion
        joints = range(1, motion.q.shape[1] + 1)
        outputs = [f"deflection[{k + 1}]" for k in self._torsions]
        outputs += [f"gear_torque[{i}]" for i in joints]
        job = SimulationJob(
            {
                "trajectory": str(trajectory),
                "torque_curve": "backlash",
                "mode": "dynamic",
                "tcp_tolerance": _TOLERANCE,
            },
            time,
            (),
            np.empty((len(time), 0)),
            tuple(outputs),
            len(outputs),
        )
        try:
            self._worker.send(job)
            rows = self._worker.receive(lambda done, total: None)
        except (FmuError, WorkerEndedError) as cause:
            raise SimulationError(f"{robot.name}: {cause}") from cause
        self._kept.append((robot, motion, GearMotion(rows)))
        return GearMotion(rows)
