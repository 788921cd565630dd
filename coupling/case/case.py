"""A validated case: its robots, its task and its process, ready to be run."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from coupling.case.place import PlaceTable
from coupling.case.plant import StudyTable
from coupling.case.robots import CouplingTable, DiscrepancyTable, OneOfDrives
from coupling.case.stability import StabilityTable
from coupling.events import Watch, unwatched
from coupling.files.provenance import Provenance
from coupling.path.controller import Controller
from coupling.path.discrepancy import Discrepancy
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.path.interpolation import SampledPath
from coupling.process import Process, ProcessSchema, ProcessTable
from coupling.process.noise import NoiseRemoval
from coupling.robot.cell import Cell
from coupling.robot.differences import Plant
from coupling.robot.mounting import Mounting
from coupling.robot.touch_off import TouchOff
from coupling.solve.correction import Compensation
from coupling.solve.fixed_point import Loop
from coupling.store import EvaluatedProcess, Store
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.task import Task
from coupling.toolpaths.untilted import UntiltedPath
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import IDEAL, Mode


@dataclass(frozen=True)
class PlacedRobot:
    """A robot of a case.

    Attributes:
        name: "forming", or "support" for the second robot of a cell.
        description: The robot as it stands, gravity in the axes of its base.
        torque_curve: "linear", "backlash" or "spline".
        home: Joint angles where inverse kinematics starts [rad], (joints,).
        drive: "ideal", or "servo": its motors follow the command as their servos do.
        touch_off: Frame that it takes for the world where it was touched off; None: the world.
        discrepancy: Measured deviation of its tool beyond the model; None: nothing.
        provenance: Sources of the numbers of its file, and how sure they are.
    """

    name: str
    description: Robot
    torque_curve: str
    home: np.ndarray
    world_from_base: Frame
    mounting: Mounting
    drive: OneOfDrives = IDEAL
    touch_off: TouchOff | None = None
    discrepancy: Discrepancy | None = None
    provenance: Provenance = field(default_factory=Provenance)

    @property
    def table(self) -> str:
        """Name of its table in the case file."""
        return "robot" if self.name == "forming" else self.name

    def programmed(self, path: ToolPath) -> ToolPath:
        """Return a path of its tool in the world as its program has it."""
        return path if self.touch_off is None else self.touch_off.programmed(path)


@dataclass(frozen=True)
class Case:
    """A validated case.

    Attributes:
        name: The file's name without ending.
        title: Name for people: that of the file, or of its folder where the file is any `case.toml`.
        robots: One robot, or forming and supporting robot of a cell.
        corners: Times at which the process is evaluated as its force has corners there [s], (n,).
        motion: Desired paths of all tools, in short steps.
        process_table: Table [process] that it is made of.
        method: Method that corrects the command, with its keys of [compensation].
        controller: Commands that the robots' controllers take.
        discrepancy: Table [discrepancy]; None: the robot was not measured along the path.
        plant: Robots and load of the simulated plant; None: the model.
        resolved: The case as plain data with every default filled in and paths absolute.
    """

    name: str
    title: str
    robots: tuple[PlacedRobot, ...]
    mode: Mode
    fmu: str
    tool_path: ToolPathTable
    corners: np.ndarray
    motion: SampledPath
    task: Task
    process: Process
    process_table: ProcessSchema
    coupling: CouplingTable
    method: Compensation
    controller: Controller
    discrepancy: DiscrepancyTable | None
    plant: Plant | None
    study: StudyTable
    place: PlaceTable
    stability: StabilityTable
    resolved: dict[str, Any]

    @property
    def desired(self) -> ToolPath:
        """Desired paths of all tools where the process is evaluated."""
        return self.task.desired

    @property
    def tolerance(self) -> float | None:
        """Deviation of the tool's path that the part allows [m]; None where it is not stated."""
        tolerance_mm = self.resolved["part"].get("tolerance_mm")
        return None if tolerance_mm is None else 1e-3 * tolerance_mm

    def evaluated_process(
        self,
        store: Path | None = None,
        watch: Watch = unwatched,
        noise_removal: NoiseRemoval | None = None,
    ) -> EvaluatedProcess:
        """Return the process as commands evaluate it: checked, tried as often as its table says."""
        table = self.process_table
        return EvaluatedProcess(
            self.process,
            None if store is None else Store(store, watch),
            watch,
            name=str(self.resolved["process"]["model"]),
            tries=1 + (table.retries if isinstance(table, ProcessTable) else 0),
            identify=lambda: table.identity(self.task),
            noise_removal=noise_removal,
        )

    def loop(self, cell: Cell, watch: Watch = unwatched) -> Loop[Cell]:
        """Return the loop of its robots and its process, as its tables say."""
        return Loop(
            cell,
            self.process,
            self.mode,
            self.coupling.new_scheme(),
            self.coupling.tolerance(),
            self.coupling.max_evaluations,
            self.controller,
            watch,
        )

    @property
    def untilted(self) -> UntiltedPath:
        """Path of the forming tool where the process is evaluated, before its tool is turned."""
        return self.tool_path.untilted(self.task.part, self.corners).sampled
