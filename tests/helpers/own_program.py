"""A program of one's own as a process, and its task."""

from pathlib import Path

import numpy as np
from places import EXAMPLES
from scipy.spatial.transform import Rotation

from coupling.path.frame import Frame
from coupling.process import ExternalTable
from coupling.toolpaths import Task
from coupling.toolpaths.part import tool_path

PART = Frame(np.array([1.0, 0.2, 0.5]), Rotation.from_euler("xyz", [0.3, -0.2, 0.5]))


def task(workspace: Path | None = None) -> Task:
    """Return 21 samples down into the part and along it."""
    s = np.linspace(0.0, 1.0, 21)
    points = np.column_stack([0.1 * s**2, 0.0 * s, -2e-3 * s])
    desired = tool_path(PART, s, points)
    return Task(PART, desired) if workspace is None else Task(PART, desired, workspace=workspace)


def external(workspace: Path, program: str, **keys: object):
    """Return a Python program as a process."""
    table = {"command": ["{python}", "-c", program], "time_limit_s": 30.0, **keys}
    return ExternalTable.model_validate({"model": "external", **table}).process(task(workspace))


def evaluate(workspace: Path, program: str, keys: dict[str, object]) -> None:
    """Evaluate the task's path, in a process that a test kills."""
    external(workspace, program, **keys).evaluate(task().desired)


SPRINGS = (EXAMPLES / "process_template.py").read_text()
# The same answer without NumPy, which takes longer to import than all else.
PLAIN_SPRINGS = """
import csv
with open("path.csv", newline="") as asked, open("wrench.csv", "w", newline="") as answer:
    answer.write("time,fx,fy,fz,mx,my,mz\\n")
    for row in csv.DictReader(asked):
        force = 2e5 * max(-float(row["z"]), 0.0)
        answer.write(f"{row['time']},0,0,{force!r},0,0,0\\n")
"""
