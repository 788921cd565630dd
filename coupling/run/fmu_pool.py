"""What simulates the robots of a case: their FMUs, each built and loaded once."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from coupling.case.case import PlacedRobot
from coupling.events import Watch, unwatched
from coupling.files.scratch import ScratchFolder
from coupling.fmu.worker import WorkerProcesses
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.inverse.inversion import MovingRobot
from coupling.robot.cell import Cell, Member
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.robot.inverter import Inverter
from coupling.robot.robot_fmu import RobotFmu
from coupling.robot.simulated_model import SimulatedModel
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import IDEAL

# Simulations at most for the polish of a command, by kind of FMU: the one in Python takes as long for
# one as the native one for a hundred.
_POLISH = {"native": 300, "python": 20}
# Processes that simulate one robot, at most.
_MOST_PROCESSES = 4


class FmuPool:
    """FMUs of robots, built and loaded when first asked for; a context manager that ends them.

    Args:
        kind: Kind of the FMUs.
        watch: Function called with the progress of the work.
        processes: Those of the native ones, of which one simulates at a time; None: each has its own.
    """

    def __init__(
        self, kind: str, watch: Watch = unwatched, processes: WorkerProcesses | None = None
    ) -> None:
        self.kind = kind
        self.watch = watch
        self._processes = processes if kind == "native" else None
        self._stack = ExitStack()
        self._folder = self._stack.enter_context(ScratchFolder())
        self._loaded: dict[tuple[str, str, str], SimulatedModel] = {}
        self._beside: dict[RobotFmu, tuple[RobotFmu, ...]] = {}

    def __enter__(self) -> FmuPool:
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    def of(self, robot: Robot, torque_curve: str, drive: str = IDEAL) -> SimulatedModel:
        """Return the robot with its FMU, whose drives are "ideal" or have a "servo"."""
        loaded = self._loaded.get((robot.to_json(), torque_curve, drive))
        if loaded is not None:
            return loaded
        file = build_fmu(robot, self._file(), BuildOptions(self.kind))
        return self._load(robot, torque_curve, file, drive)

    def inverter(self, robot: Robot, torque_curve: str, drive: str = IDEAL) -> Inverter:
        """Return what inverts a robot, as `of`."""
        moving, model = MovingRobot(robot, torque_curve), self.of(robot, torque_curve, drive)
        return Inverter(moving, model.fmu, _POLISH[self.kind], drive)

    def side_by_side(self, fmu: RobotFmu) -> tuple[RobotFmu, ...]:
        """Return a robot's FMU and others of it that run beside it, as far as there are processors."""
        if fmu not in self._beside:
            more = range(min(os.cpu_count() or 1, _MOST_PROCESSES) - 1)
            others = [RobotFmu(fmu.file, fmu.torque_curve, drive=fmu.drive) for _ in more]
            self._beside[fmu] = (fmu, *map(self._stack.enter_context, others))
        return self._beside[fmu]

    def take(
        self, robot: Robot, torque_curve: str, fmu: bytes, drive: str = IDEAL
    ) -> SimulatedModel:
        """Return a robot with its FMU, which is there already."""
        file = self._file()
        file.write_bytes(fmu)
        return self._load(robot, torque_curve, file, drive)

    def _file(self) -> Path:
        return self._folder / f"{len(self._loaded)}.fmu"

    def _load(self, robot: Robot, torque_curve: str, file: Path, drive: str) -> SimulatedModel:
        fmu = self._stack.enter_context(
            RobotFmu(file, torque_curve, self.watch, drive, self._processes)
        )
        loaded = SimulatedModel(robot, torque_curve, fmu, drive)
        self._loaded[robot.to_json(), torque_curve, drive] = loaded
        return loaded


def cell_of(
    robots: Sequence[PlacedRobot], models: FmuPool
) -> tuple[Cell, tuple[SimulatedModel, ...]]:
    """Return the robots of a case, with what simulates each of them and inverts it, for its drives."""
    members, simulated = [], []
    for placed in robots:
        planner = InverseKinematics(placed.description, placed.home, models.watch)
        model = models.of(placed.description, placed.torque_curve, placed.drive)
        inverter = models.inverter(placed.description, placed.torque_curve, placed.drive)
        members.append(
            Member(
                placed.name,
                placed.world_from_base,
                model.fmu,
                planner,
                inverter,
                placed.touch_off,
                placed.discrepancy,
            )
        )
        simulated.append(model)
    return Cell(tuple(members)), tuple(simulated)
