"""Processes outside of this package that state how they react: read, turned to base axes, checked."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from spring_robot import upright

from coupling.errors import ProcessError
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.process import ElasticWall
from coupling.process.external import ExternalProgram
from coupling.process.frames import response_in_base
from coupling.process.validation import evaluate_validated

PART = Frame(np.array([1.0, 0.2, 0.5]), Rotation.from_rotvec([0.3, -0.4, 0.9]))
# A wall of 1e5 N/m at z = 0 of the part; what it prints is in part axes.
PROGRAM = """
import numpy as np
rows = np.loadtxt("path.csv", delimiter=",", skiprows=1)
deep = np.maximum(-rows[:, 3], 0.0)
columns = dict(time=rows[:, 0], fx=0 * deep, fy=0 * deep, fz=1e5 * deep, mx=0 * deep, my=0 * deep,
               mz=0 * deep, kxx=0 * deep, kxy=0 * deep, kxz=0 * deep, kyy=0 * deep, kyz=0 * deep,
               kzz=1e5 * (deep > 0))
columns = {name: columns[name] for name in NAMES}
np.savetxt("wrench.csv", np.column_stack(list(columns.values())), delimiter=",",
           header=",".join(columns), comments="", fmt="%.17g")
"""
WRENCH = ["time", "fx", "fy", "fz", "mx", "my", "mz"]
STIFFNESS = ["kxx", "kxy", "kxz", "kyy", "kyz", "kzz"]


def path_at_the_wall() -> ToolPath:
    time = np.linspace(0.0, 1.0, 20)
    depth = 1e-3 * np.cos(7.0 * time)
    points = np.column_stack([0.1 * time, 0.0 * time, depth])
    return ToolPath(time, upright(PART.points(points)))


def program(folder: Path, names: list[str]) -> ExternalProgram:
    script = folder / "wall.py"
    script.write_text(PROGRAM.replace("NAMES", repr(names)))
    return ExternalProgram(
        (sys.executable, str(script)), 60.0, PART, "part", folder / "evaluations"
    )


def wall() -> ElasticWall:
    return ElasticWall(PART.position, PART.rotation.apply([0.0, 0.0, 1.0]), 1e5)


def test_a_program_states_its_stiffness_in_columns_of_its_answer(tmp_path):
    path = path_at_the_wall()
    told, expected = program(tmp_path, WRENCH + STIFFNESS).evaluate(path), wall().evaluate(path)
    np.testing.assert_allclose(told.wrench.wrench, expected.wrench.wrench, atol=1e-9)
    assert 5 < np.count_nonzero(np.any(expected.stiffness, axis=(1, 2))) < 20
    np.testing.assert_allclose(told.stiffness, expected.stiffness, atol=1e-6)


def test_a_program_that_does_not_know_it_states_nothing(tmp_path):
    assert program(tmp_path, WRENCH).evaluate(path_at_the_wall()).stiffness is None


def test_a_stiffness_that_is_not_whole_is_refused(tmp_path):
    with pytest.raises(ProcessError, match="kxy"):
        program(tmp_path, [*WRENCH, "kxx", "kzz"]).evaluate(path_at_the_wall())


@pytest.mark.parametrize("frame", ["base", "part", "tool"])
def test_a_stiffness_turns_with_its_frame(frame):
    """The work of a displacement does not ask for axes."""
    rng = np.random.default_rng(4)
    time = np.linspace(0.0, 1.0, 9)
    turns = Rotation.from_rotvec(rng.normal(size=(9, 3)))
    path = ToolPath(time, np.hstack([rng.normal(size=(9, 3)), turns.as_quat()]))
    axes = {"base": Rotation.identity(9), "part": PART.rotation, "tool": path.rotations[0]}[frame]
    values, own = rng.normal(size=(9, 12)), rng.normal(size=(9, 3))
    told = response_in_base(frame, np.column_stack([path.time, values]), path, PART).stiffness
    xx, xy, xz, yy, yz, zz = values[:, 6:].T
    x, y, z = own.T
    work = xx * x * x + yy * y * y + zz * z * z + 2.0 * (xy * x * y + xz * x * z + yz * y * z)
    moved = axes.apply(own)
    np.testing.assert_allclose(np.einsum("ni,nij,nj->n", moved, told, moved), work, atol=1e-12)


@pytest.mark.parametrize("wrong", ["one-sided", "negative"])
def test_a_stiffness_that_no_spring_has_is_the_process_s_mistake(wrong):
    class Wrong:
        identity = ""

        def evaluate(self, path: ToolPath):
            answer = wall().evaluate(path)
            odd = np.zeros((3, 3))
            odd[(0, 1) if wrong == "one-sided" else (2, 2)] = -1e4
            return replace(answer, stiffness=answer.stiffness + odd)

    with pytest.raises(ProcessError, match="symmetric matrices without negative eigenvalues"):
        evaluate_validated(Wrong(), path_at_the_wall(), "wrong")
