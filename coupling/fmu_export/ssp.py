"""Robot and process as one system for a co-simulation master: an SSP archive [SSP1]."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from io import BytesIO
from math import isfinite
from pathlib import Path

import elastic_robot
from coupling.case.case import Case
from coupling.errors import BuildError, one_of
from coupling.fmu_export.archive import build_date, write_archive
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.process_fmu import build_process_fmu, memoryless
from coupling.fmu_export.step_limit import (
    SHORTEST,
    StepError,
    StepLimit,
    postures_in_contact,
    step_errors,
)
from coupling.fmu_export.system_structure import SPRING_UNITS, WRENCH_UNITS, SystemStructure
from coupling.path.controller import on_cycle
from coupling.path.histories import ToolPath
from coupling.path.joint_path import JointPath
from coupling.process.base import MemorylessProcess
from coupling.robot.fmu_signals import save_trajectory
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.toolpaths.task import Task
from elastic_robot.fmi.interface import IDEAL, STEP_SIZE

# What the process gives to the robot: force and the contact spring that it would be, or the force alone.
INTERFACES = {"spring": {**WRENCH_UNITS, **SPRING_UNITS}, "force": WRENCH_UNITS}
_TRAJECTORY = "command.npz"


@dataclass(frozen=True)
class SspSystem:
    """A case's robot, commanded along the desired path, and its process, ready to be packed.

    Attributes:
        case: The case.
        interface: Quantities that the process gives to the robot, a name of INTERFACES.
        task: Its task in the frame of the robot's base, which is that of its FMU.
        process: Its process in that frame.
        planned: The drives' motion along the desired path.
        requested_step: Communication step that the user asks for [s]; None: the longest that is safe.
    """

    case: Case
    interface: str
    task: Task
    process: MemorylessProcess
    planned: JointPath
    requested_step: float | None = None

    @classmethod
    def of(cls, case: Case, interface: str = "spring", step: float | None = None) -> SspSystem:
        """Prepare a case whose process is memoryless.

        Raises:
            BuildError: If the process needs the whole path at once, the case is a cell of two robots,
                the answer is not known, the step not above zero, or no step is safe.
            CouplingError: If the path cannot be planned.
        """
        if interface not in INTERFACES:
            raise BuildError(f"interface: {one_of(INTERFACES, interface)}")
        if step is not None and not (isfinite(step) and step > 0.0):
            raise BuildError(f"step: expected a finite number > 0 [s], got {step}")
        if case.task.support is not None:
            raise BuildError(
                f"{case.name}: expected a case without [support], got a cell of two robots"
            )
        robot, task = case.robots[0], _in_base(case)
        process = memoryless(case.process_table.process(task))
        program = robot.programmed(case.task.forming).transformed(robot.world_from_base.inverse())
        planned = InverseKinematics(robot.description, robot.home).plan(program)
        system = cls(case, interface, task, process, planned, step)
        if system.step == 0.0:
            raise BuildError(
                f"{case.name}: expected robot and process to be stable at a communication step from"
                f" {SHORTEST:g} s on, found none: {system.why()}"
            )
        return system

    @cached_property
    def limit(self) -> StepLimit:
        """Up to which step an exchange of pose and force alone is stable."""
        path, robot = self.task.forming, self.case.robots[0].description
        desired = path.position[0]
        reaction = self.process.law().reaction(path.time, desired)
        quasistatic = self.case.mode == "quasistatic"
        return StepLimit.of(
            postures_in_contact(robot, self.planned, desired, reaction, quasistatic)
        )

    @property
    def has_spring(self) -> bool:
        """Whether the process gives its contact spring to the robot."""
        return INTERFACES[self.interface] is not WRENCH_UNITS

    @cached_property
    def safe_step(self) -> float:
        """Longest round step that is safe [s]; 0 where there is none."""
        return self.limit.safe_step(self.has_spring, STEP_SIZE)

    @property
    def step(self) -> float:
        """Communication step that the archive names [s]."""
        return self.safe_step if self.requested_step is None else self.requested_step

    def remarks(self) -> list[str]:
        """Return sentences on the step."""
        said = [f"communication step: {1e3 * self.step:g} ms"]
        if self.case.robots[0].drive != IDEAL:
            said.append("the safe step is estimated for drives without following error")
        if not self.limit.postures:
            return [*said, "no contact along the desired path: no limit of the step is known"]
        if self.step > self.safe_step:
            safe = f"{1e3 * self.safe_step:g} ms is" if self.safe_step else "none is"
            said.append(f"warning: this step is not safe, {safe}")
        return [*said, self.why()]

    def why(self) -> str:
        """Return in words what limits the step."""
        limit = self.limit
        softest = max(limit.postures, key=lambda posture: posture.growth(STEP_SIZE))
        process, robot = softest.stiffnesses
        met = f"stiffness of the process {process:.3g} N/m, of the robot {robot:.3g} N/m"
        touch = "touch and lift-off, noticed up to two steps late, are safe"
        if isfinite(limit.touch):
            touch += f" up to {1e3 * limit.touch:.3g} ms"
        else:
            touch += " at any step, as the robot has no inertia"
        if self.has_spring:
            first = "lasting contact is stable at any step, as the process's spring is part of the robot"
            return f"{met}: {first}; {touch}"
        times = f"{limit.growth(STEP_SIZE):.3g} times as large with every step"
        growth = f"at {1e3 * STEP_SIZE:g} ms deviations become {times}"
        if limit.lasting == 0.0:
            first = f"{growth}, and grow at any step: connect the contact spring of the process too"
        elif isfinite(limit.lasting):
            first = f"lasting contact is stable below {1e3 * limit.lasting:.3g} ms"
            if limit.growth(STEP_SIZE) >= 1.0:
                first += f", {growth}"
        else:
            first = "lasting contact is stable at any step"
        return f"{met}, coupled by the force alone: {first}; {touch}"

    def costs(self, coupled: ToolPath | None) -> list[str]:
        """Return sentences on what the step costs, and a tenth of it: simulated, against the coupling.

        Args:
            coupled: Path of the coupling, base frame; None where it did not converge.

        Raises:
            CouplingError: If the robot cannot be simulated.
        """
        if coupled is None:
            return [
                "what the step costs is not known: the coupling did not converge (couple says why)"
            ]
        errors = self.errors(coupled, (self.step, self.step / 10.0))
        return [
            "distance of the tool from the coupling of `couple`, by communication step: "
            + "; ".join(map(str, errors))
        ]

    def errors(self, coupled: ToolPath, steps: Sequence[float]) -> list[StepError]:
        """Return what communication steps cost [s], against a coupled path, base frame.

        Raises:
            CouplingError: If the robot cannot be simulated.
        """
        with tempfile.TemporaryDirectory() as folder:
            robot = self._robot_fmu(Path(folder), "native", ())
            return step_errors(robot, self.process.law(), self.has_spring, coupled, steps)

    def _robot_fmu(self, folder: Path, kind: str, platforms: Sequence[str]) -> Path:
        """Build the robot's FMU: its start values are the command and the case's settings."""
        case, robot = self.case, self.case.robots[0]
        strings = {
            "trajectory": _TRAJECTORY,
            "torque_curve": robot.torque_curve,
            "mode": case.mode,
            "drive": robot.drive,
        }
        return build_fmu(
            robot.description,
            folder / "ElasticRobot.fmu",
            BuildOptions(kind, tuple(platforms), strings=strings),
            {_TRAJECTORY: _table(on_cycle(self.planned, case.controller))},
        )

    def write(self, file: Path, platforms: Sequence[str] = ()) -> Path:
        """Write the archive.

        Args:
            file: File to write, ending in .ssp.
            platforms: Names of the platforms that the robot's FMU has libraries for; none: this machine.

        Returns:
            The file.

        Raises:
            BuildError: If the file cannot be written.
        """
        case = self.case
        with tempfile.TemporaryDirectory() as folder:
            robot_fmu = self._robot_fmu(Path(folder), case.fmu, platforms)
            process_fmu = build_process_fmu(
                self.process, self.task.desired, Path(folder, "Process.fmu")
            )
            entries = {f"resources/{f.name}": f.read_bytes() for f in (robot_fmu, process_fmu)}
        first, last = case.desired.time[0], case.desired.time[-1]
        structure = SystemStructure(
            case.name,
            robot_fmu.name,
            process_fmu.name,
            INTERFACES[self.interface],
            float(first),
            float(last),
            self.step,
        )
        entries["SystemStructure.ssd"] = structure.text()
        write_archive(file, ".ssp", entries, build_date(Path(elastic_robot.__file__).parent))
        return file


def _in_base(case: Case) -> Task:
    """Return the task in the frame of the robot's base, which is that of its FMU."""
    base_from_world, task = case.robots[0].world_from_base.inverse(), case.task
    forming = task.forming.transformed(base_from_world)
    return replace(task, part=base_from_world @ task.part, forming=forming)


def _table(command: JointPath) -> bytes:
    table = BytesIO()
    save_trajectory(table, command)
    return table.getvalue()
