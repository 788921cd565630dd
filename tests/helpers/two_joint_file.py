"""A robot file of two joints, the second with a table of its own."""

import tempfile
from pathlib import Path

from coupling.files.robot_file import load_robot
from elastic_robot.description import Joint, Robot

HEAD = 'name = "one"\n[tcp]\nposition = [1.0, 0.0, 0.0]\n'
JOINT = """
[[joint]]
origin = [0.0, 0.0, 0.0]
axis = [0, 1, 0]
mass = 10.0
com = [0.5, 0.0, 0.0]
inertia = [0.1, 1.0, 1.0]
"""


def two_joints(folder: Path, joint: str, table: str, after: str = "") -> Path:
    """Write it with keys and table of the second joint; return the file."""
    file = folder / "robot.toml"
    file.write_text(f"{HEAD}{JOINT}stiffness = 1e6\n{JOINT}{joint}\n{table}\n{after}")
    return file


def second_joint(joint: str, table: str) -> Joint:
    """Return the second joint as it is read, through JSON as an FMU has it."""
    with tempfile.TemporaryDirectory() as folder:
        robot = load_robot(two_joints(Path(folder), joint, table))
    assert Robot.from_json(robot.to_json()) == robot
    return robot.joints[1]
