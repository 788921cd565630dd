"""A process that comes as an FMU: poses of the tool in, forces out, mapped by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from coupling.errors import CaseError, ProcessError
from coupling.events import Progress, Watch, unwatched
from coupling.files.csv_table import POSE_COLUMNS, STIFFNESS_COLUMNS, WRENCH_COLUMNS
from coupling.files.scratch import ScratchFolder
from coupling.files.toml_file import FilePath, Positive
from coupling.fmu.job import FmuError, SimulationJob
from coupling.fmu.worker import WorkerProcess, unpack
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.process.base import ProcessResponse, ProcessTable, WithIdentity
from coupling.process.fmu_variables import ProcessVariables, read_variables
from coupling.process.frames import PoseFrame, poses_in, response_in_base
from coupling.toolpaths.task import Task

PoseColumn = Literal["x", "y", "z", "qx", "qy", "qz", "qw"]
ResponseColumn = Literal[
    "fx", "fy", "fz", "mx", "my", "mz", "kxx", "kxy", "kxz", "kyy", "kyz", "kzz"
]

_NEEDS_TOOL = (
    " (it declares needsExecutionTool: is the tool that it was exported for installed here?)"
)


@dataclass(frozen=True)
class ProcessFmu(WithIdentity):
    """A process FMU, run over the whole path in a process of its own.

    Attributes:
        file: FMI 2 or 3, co-simulation.
        variables: Its inputs by pose column, the pose at time[k] being held over the step that ends
            there; its outputs by column of wrench and stiffness, where those not named are zero, and a
            process none of whose outputs is a stiffness states none.
        parameters: Start values by name.
        part: base_from_part.
        frame: Frame of poses and wrenches: "part" or "base".
        time_limit: Time that one evaluation may take [s].
        watch: Function called with the progress of the simulation.
    """

    file: Path
    variables: ProcessVariables
    parameters: Mapping[str, float | int | bool | str]
    part: Frame
    frame: PoseFrame
    time_limit: float
    watch: Watch = unwatched

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Simulate the FMU along a path and return its wrenches, base axes.

        Raises:
            ProcessError: If it cannot be run, takes too long or fails.
        """
        poses = poses_in(self.frame, path, self.part)
        inputs, outputs = self.variables.inputs, self.variables.outputs
        rows = [v.from_si(poses[:, POSE_COLUMNS.index(name)]) for name, v in inputs.items()]
        job = SimulationJob(
            self.parameters,
            path.time,
            tuple(variable.name for variable in inputs.values()),
            np.column_stack(rows),
            tuple(variable.name for variable in outputs.values()),
            len(outputs),
        )
        stiff = set(STIFFNESS_COLUMNS) & set(outputs)
        columns: tuple[str, ...] = WRENCH_COLUMNS + (STIFFNESS_COLUMNS if stiff else ())
        answers = np.zeros((len(path.time), len(columns)))
        values = self._run(job)
        for k, (name, variable) in enumerate(outputs.items()):
            answers[:, columns.index(name)] = variable.to_si(values[:, k])
        if not np.all(np.isfinite(answers)):
            row = int(np.argmin(np.all(np.isfinite(answers), axis=1)))
            raise ProcessError(
                f"{self.file}: expected finite outputs, got {answers[row]} at t = {path.time[row]:.6g} s"
            )
        return response_in_base(self.frame, np.column_stack([path.time, answers]), path, self.part)

    def _run(self, job: SimulationJob) -> np.ndarray:
        with ScratchFolder() as folder:
            try:
                unpack(self.file, folder)
                worker = WorkerProcess(folder, self.time_limit)
                try:
                    worker.send(job)
                    return worker.receive(self._report)
                finally:
                    worker.close()
            except FmuError as cause:
                tool = _NEEDS_TOOL if self.variables.needs_tool else ""
                raise ProcessError(f"{self.file}: {cause}{tool}") from cause

    def _report(self, completed: int, total: int) -> None:
        self.watch(Progress("evaluating the process", completed, total))


class ProcessFmuTable(ProcessTable):
    """Keys: file; tables inputs and outputs; parameters; frame; time_limit_s; retries.

    inputs has keys x, y, z, qx, qy, qz, qw; outputs has keys fx, fy, fz, mx, my, mz, on the tool at the
    TCP, and kxx to kzz: names of the FMU's variables, in the units that it declares, else SI.
    parameters are start values; frame is "part" unless given.
    """

    WITHOUT_EFFECT: ClassVar[frozenset[str]] = frozenset({"time_limit_s"})

    model: Literal["fmu"]
    file: FilePath
    inputs: Annotated[dict[PoseColumn, str], Field(min_length=1)]
    outputs: Annotated[dict[ResponseColumn, str], Field(min_length=1)]
    parameters: dict[str, float | int | bool | str] = {}
    frame: PoseFrame = "part"
    time_limit_s: Positive = 3600.0

    def process(self, task: Task) -> ProcessFmu:
        """Return the FMU as a process.

        Raises:
            CaseError: If the file is not there, or its variables are not what the case takes them for.
        """
        if not self.file.is_file():
            raise CaseError(f"process: file: expected an FMU, got {self.file}, which is not there")
        variables = read_variables(
            self.file,
            {str(column): name for column, name in self.inputs.items()},
            {str(column): name for column, name in self.outputs.items()},
            self.parameters,
        )
        variables.require_steps(task.sampled.forming.time, f"process: {self.file}")
        return ProcessFmu(
            self.file,
            variables,
            self.parameters,
            task.part,
            self.frame,
            self.time_limit_s,
            task.watch,
            identity=self.identity(task),
        )

    def own_files(self) -> tuple[Path, ...]:
        """Return the FMU."""
        return (self.file,)
