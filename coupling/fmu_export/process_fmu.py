"""A process without memory as an FMU: TCP pose in; wrench on the tool out, and how it changes."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

import elastic_robot
from coupling.errors import BuildError
from coupling.fmu_export.archive import build_date
from coupling.fmu_export.python_slave import PythonSlave
from coupling.path.histories import ToolPath
from coupling.process import Process, force_laws
from coupling.process.base import MemorylessProcess
from elastic_robot.fmi.variables import AXES, POSE, SYMMETRIC, Block, Variable, along, group

MODEL_NAME = "Process"


def build_process_fmu(process: Process, desired: ToolPath, file: Path) -> Path:
    """Write a process's FMU.

    Its inputs are named as the robot FMU's outputs and the other way round.  The wrench that it
    shows after a step is that of the pose at the step's start; the spring, whose anchor is the position
    there, says how the force changes from there on.

    Args:
        process: A memoryless one.
        desired: Desired tool path; its first pose is the inputs' start value.
        file: File to write, ending in .fmu.

    Returns:
        The file.

    Raises:
        BuildError: If the process needs the whole path at once, or the file cannot be written.
    """
    law = _law(memoryless(process), desired)
    slave = PythonSlave(
        module="process_slave",
        class_name=MODEL_NAME,
        model_name=MODEL_NAME,
        description=f"{type(process).__name__}: TCP pose in, wrench and contact spring out",
        capabilities=(
            "canHandleVariableCommunicationStepSize",
            "canNotUseMemoryManagementFunctions",
            "canGetAndSetFMUstate",
            "canSerializeFMUstate",
        ),
        blocks=_blocks(desired.pose[0, 0]),
    )
    date = build_date(Path(elastic_robot.__file__).parent)
    return slave.write(file, date, law, {})


def memoryless(process: Process) -> MemorylessProcess:
    """Return a process that works step by step as it is.

    Raises:
        BuildError: If it needs the whole path at once.
    """
    if not isinstance(process, MemorylessProcess):
        raise BuildError(
            "process: expected a model that works step by step (elastic-wall, isf-force-law), got"
            f" {type(process).__name__}, which needs the whole path at once"
        )
    return process


def _law(process: MemorylessProcess, desired: ToolPath) -> dict[str, bytes]:
    """Return the files that the slave reads."""
    law = process.law()
    description = {
        "law": law.name,
        "constants": {name: np.asarray(value).tolist() for name, value in law.constants.items()},
        "pose_at_start": desired.pose[0, 0].tolist(),
    }
    files = {
        "law.json": json.dumps(description, indent=1).encode(),
        "force_laws.py": Path(force_laws.__file__).read_bytes(),
    }
    if law.desired is not None:
        table = io.BytesIO()
        np.save(table, law.desired)
        files["desired.npy"] = table.getvalue()
    return files


def _blocks(pose: np.ndarray) -> dict[str, Block]:
    """Return the FMU's variables, in the order of their value references."""
    inputs = tuple(
        Variable(
            f"tcp.{name}", "m" if name in AXES else "1", "Pose of the TCP, base frame", float(start)
        )
        for name, start in zip(POSE, pose, strict=True)
    )
    place, stiffness = "Position at which the force is the stated one", "Stiffness of the process"
    groups = {
        "wrench": (
            group("", "N", "Force on the tool at the TCP, base axes", along("force.")),
            group("", "N.m", "Moment on the tool at the TCP, base axes", along("moment.")),
        ),
        "spring": (
            group("", "m", f"{place}, base axes", along("anchor.")),
            group("", "m/s", "Velocity of that position, base axes", along("anchor.v")),
            group(
                "",
                "N/m",
                f"{stiffness} to the TCP, base axes: force by its way back",
                along("anchor.k", SYMMETRIC),
            ),
        ),
    }
    # After a step wrench and spring do not follow the pose any more; before the first step they do.
    outputs = {
        name: replace(Block.of("output", "continuous", *parts), starts_from=("pose",))
        for name, parts in groups.items()
    }
    return {"pose": Block("input", "continuous", inputs), **outputs}
