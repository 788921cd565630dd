"""Machines of several axes as matrices, and G-code for them."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError
from coupling.files.toml_file import validate
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.toolpaths.gcode import GcodePath
from coupling.toolpaths.gcode_course import GcodeCourse
from coupling.toolpaths.gcode_program import read_program
from coupling.toolpaths.roll import upright
from coupling.toolpaths.rotary import RotaryTable

PART = Frame(np.zeros(3), Rotation.identity())
MACHINES = [
    ["table C", "table A"],
    ["table C", "table B"],
    ["table -C", "table -A"],
    ["head C", "head A"],
    ["head C", "head -B"],
    ["head A", "head B"],
    ["table C", "head B"],
    ["table A", "head B"],
    ["table B", "head A"],
    ["table C", "table B", "head A"],
    ["table A"],
]


POINTS = {"A": [0.02, -0.3, -0.11], "B": [-0.04, 0.05, 0.26], "C": [0.013, -0.007, 0.4]}
START = ("G21 G90 G17",)


def table(axes: list[str], **keys: object) -> RotaryTable:
    points = {axis[-1]: POINTS[axis[-1]] for axis in axes}
    return RotaryTable.model_validate({"axes": axes, "points_m": points} | keys)


def about(letter: str, angle: float, point: list[float]) -> np.ndarray:
    """Homogeneous matrix of a right-handed rotation about an axis through a point."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = {"A": (1, 2), "B": (2, 0), "C": (0, 1)}[letter]
    turn, there, back = np.eye(4), np.eye(4), np.eye(4)
    turn[i, i] = turn[j, j] = c
    turn[j, i], turn[i, j] = s, -s
    there[:3, 3], back[:3, 3] = point, -np.array(point)
    return there @ turn @ back


def part_from_tip(axes: list[str], place: np.ndarray, degrees: np.ndarray) -> np.ndarray:
    """Machine as it is built: the bed carries table upon table, and the slide head upon head.

    By ISO 841 a table that turns by +q turns the part by -q, a head the tool by +q.
    """
    bed_from_part, slide_from_tip, bed_from_slide = np.eye(4), np.eye(4), np.eye(4)
    bed_from_slide[:3, 3] = place
    for axis, value in zip(axes, np.deg2rad(degrees), strict=True):
        q, letter = (-value if "-" in axis else value), axis[-1]
        if axis.startswith("table"):
            bed_from_part = about(letter, -q, POINTS[letter]) @ bed_from_part
        else:
            slide_from_tip = slide_from_tip @ about(letter, q, POINTS[letter])
    return np.linalg.inv(bed_from_part) @ bed_from_slide @ slide_from_tip


def words(letters: str, values: list[float]) -> str:
    return " ".join(f"{k}{v:.12f}" for k, v in zip(letters, values, strict=True))


def course(folder: Path, lines: list[str], rotary: RotaryTable | None) -> GcodeCourse:
    file = folder / "program.ngc"
    file.write_text("\n".join([*START, *lines]))
    kinematics = rotary.kinematics if rotary else None
    return GcodeCourse(read_program(file, rotary), kinematics, 0.1, upright)


def path(folder: Path, lines: list[str], **keys: object) -> GcodePath:
    file = folder / "program.ngc"
    file.write_text("\n".join([*START, *lines]))
    raw = {"kind": "gcode", "file": str(file)} | keys
    return validate(raw, GcodePath, CaseError, "tool_path")


def tool(built: ToolPath) -> tuple[np.ndarray, np.ndarray]:
    """Tips and vectors from tip to holder."""
    return built.position[0], -built.rotations[0].apply([1.0, 0.0, 0.0])
