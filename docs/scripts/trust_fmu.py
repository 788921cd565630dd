"""Simulations by an FMU that is built for them, in a process of its own."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from coupling.fmu.job import SimulationJob
from coupling.fmu.worker import WorkerProcess, unpack
from coupling.fmu_export.build import BuildOptions, build_fmu
from elastic_robot.description import Robot


def answers(robot: Robot, jobs: Iterable[SimulationJob], kind: str = "native") -> list[np.ndarray]:
    """Return the outputs of every job, (n, width), by an FMU of this kind."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        unpack(build_fmu(robot, folder / "Robot.fmu", BuildOptions(kind)), folder / "fmu")
        worker = WorkerProcess(folder / "fmu")
        try:
            found = []
            for job in jobs:
                worker.send(job)
                found.append(worker.receive(lambda done, total: None))
        finally:
            worker.close()
    return found
