"""A wall that a process FMU computes, and a path into it."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.path.frame import Frame
from coupling.process import ProcessFmuTable
from coupling.toolpaths import Task
from coupling.toolpaths.part import tool_path

PART = Frame(np.array([1.0, 0.2, 0.5]), Rotation.from_euler("xyz", [0.3, -0.2, 0.5]))
STIFFNESS = 2e5
NAMES = {"inputs": {"z": "height"}, "outputs": {"fz": "force"}}


def task() -> Task:
    """Return 41 unevenly spaced samples into the part and out again."""
    time = np.linspace(0.0, 1.0, 41) ** 1.5
    height = 1e-3 - 3e-3 * np.sin(np.pi * time) ** 2
    return Task(PART, tool_path(PART, time, np.column_stack([0.1 * time, 0.0 * time, height])))


def process(file: Path, **keys: object):
    table = {"model": "fmu", "file": str(file), "parameters": {"stiffness": STIFFNESS}, **NAMES}
    return ProcessFmuTable.model_validate({**table, **keys}).process(task())
