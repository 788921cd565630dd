"""The robot's native FMU with ideal drives that move as motors did: wind-up and torque of every gear."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from coupling.errors import HostError, SimulationError
from coupling.files.scratch import ScratchFolder
from coupling.fmu_export.build import build_fmu
from coupling.identification.motion.recording import SmoothedMotion
from coupling.path.joint_path import JointPath
from coupling.robot.robot_fmu import RobotFmu
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


class DrivenFmu:
    """An FMU whose robot has other numbers in every simulation; a context manager that cleans up.

    Args:
        robot: The robot, none of whose joints is rigid; others must have the same joints and parts.

    Raises:
        SimulationError: If the FMU cannot run here.
    """

    def __init__(self, robot: Robot) -> None:
        self._torsions = build_chain(robot).torsions.tolist()
        self._kept: deque[tuple[Robot, SmoothedMotion, GearMotion]] = deque(maxlen=_KEPT)
        self._command: tuple[SmoothedMotion | None, JointPath | None] = None, None
        with ScratchFolder() as folder:
            self._fmu = RobotFmu(build_fmu(robot, folder / "moved.fmu"))
        self._fmu.parameters["tcp_tolerance"] = _TOLERANCE

    def __enter__(self) -> DrivenFmu:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the process and remove its files."""
        self._fmu.close()

    def simulate(self, robot: Robot, time: np.ndarray, motion: SmoothedMotion) -> GearMotion:
        """Return what the gears of a robot do while its drives move.

        Args:
            robot: The robot with these numbers.
            time: Times [s], (n,).
            motion: Motion of the drives.

        Raises:
            SimulationError: If the FMU refuses the robot or a step.
        """
        for earlier_robot, earlier_motion, gears in self._kept:
            if earlier_motion is motion and earlier_robot == robot:
                return gears
        known_motion, command = self._command
        if command is None or known_motion is not motion:
            command = JointPath(time, (motion.q,), (motion.qd,), (motion.qdd,))
            self._command = motion, command
        try:
            gears = GearMotion(self._fmu.gears(command, time, self._torsions, robot))
        except (HostError, SimulationError) as cause:
            raise SimulationError(f"{robot.name}: {cause}") from cause
        self._kept.append((robot, motion, gears))
        return gears
