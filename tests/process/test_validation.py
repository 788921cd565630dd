"""An author's mistake in a process of his own is an error that names it; a stiffness that he states."""

import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import command
from places import LINE_CASE
from scipy.spatial.transform import Rotation
from spring_robot import upright

from coupling.errors import CaseError, ProcessError
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process import ElasticWall, ProcessResponse
from coupling.process.external import ExternalProgram
from coupling.process.frames import response_in_base
from coupling.process.validation import evaluate_validated

PATH = ToolPath(np.linspace(0.0, 1.0, 5), np.tile([0.0, 0, 0, 0, 0, 0, 1.0], (5, 1)))
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


def answer(
    n: int = 5, tools: int = 1, stiffness: object = None, late: float = 0.0
) -> ProcessResponse:
    wrench = WrenchHistory(np.linspace(0.0, 1.0 + late, n), np.zeros((tools, n, 6)))
    return ProcessResponse(wrench, stiffness=stiffness)


MISTAKES = {
    "None": (None, "expected a ProcessResponse, got NoneType"),
    "a wrench": (answer().wrench, "expected a ProcessResponse, got WrenchHistory"),
    "too short": (answer(4), r"wrench: expected shape \(1, 5, 6\), .* got \(1, 4, 6\)"),
    "two tools": (answer(tools=2), r"wrench: expected shape \(1, 5, 6\), .* got \(2, 5, 6\)"),
    "own times": (
        answer(late=1e-9),
        "wrench: expected the times of the path, one that is a jump twice, got times of its own",
    ),
    "a spring": (
        ProcessResponse(replace(answer().wrench, spring=object())),  # type: ignore[arg-type]
        "wrench: expected no spring",
    ),
    "stiffness": (
        answer(stiffness=np.zeros((1, 5, 3, 3))),
        r"stiffness: expected shape \(5, 3, 3\), \(samples, .* got \(1, 5, 3, 3\)",
    ),
    "a number": (answer(stiffness=1e5), r"stiffness: expected shape .* got \(\)"),
    "NaN": (answer(stiffness=np.full((5, 3, 3), np.nan)), "stiffness: expected finite values"),
}


class Own:
    identity = ""

    def __init__(self, says: object) -> None:
        self.says = says

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        if isinstance(self.says, Exception):
            raise self.says
        return self.says  # type: ignore[return-value]


@pytest.mark.parametrize("name", MISTAKES)
def test_a_bad_answer_is_named(name):
    says, words = MISTAKES[name]
    with pytest.raises(ProcessError, match=f"the process mine gave an invalid result: {words}"):
        evaluate_validated(Own(says), PATH, "mine")


def test_a_good_answer_passes():
    good = answer(stiffness=np.zeros((5, 3, 3)))
    assert evaluate_validated(Own(good), PATH, "mine") is good


def test_what_fails_in_it_is_named_with_its_line():
    with pytest.raises(
        ProcessError, match=r"mine failed: KeyError: 'x' \(test_validation.py, line"
    ):
        evaluate_validated(Own(KeyError("x")), PATH, "mine")
    with pytest.raises(CaseError, match="as it is"):
        evaluate_validated(Own(CaseError("as it is")), PATH, "mine")


def test_what_would_end_the_whole_command_ends_the_process_alone():
    class Ends:
        identity = ""

        def evaluate(self, path: ToolPath) -> ProcessResponse:
            os._exit(0)

    end = os._exit
    with pytest.raises(
        ProcessError, match=r"mine failed: SystemExit: 0 \(test_validation.py, line"
    ):
        evaluate_validated(Ends(), PATH, "mine")
    assert os._exit is end


@pytest.mark.parametrize("ends", [SystemExit, GeneratorExit, BaseException])
def test_what_is_no_ordinary_exception_is_named_as_well(ends):
    class Ends:
        identity = ""

        def evaluate(self, path: ToolPath) -> ProcessResponse:
            raise ends

    with pytest.raises(ProcessError, match=rf"mine failed: {ends.__name__}:? "):
        evaluate_validated(Ends(), PATH, "mine")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs processes that fork")
def test_what_a_process_has_forked_ends_as_ever():
    class Forks:
        identity = ""

        def evaluate(self, path: ToolPath) -> ProcessResponse:
            child = os.fork()
            if child == 0:
                os._exit(7)
            assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
            return answer()

    evaluate_validated(Forks(), PATH, "mine")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("return None", "gave an invalid result: expected a ProcessResponse"),
        ("raise SystemExit(0)", "failed: SystemExit: 0"),
        ("return path.forces", "failed: AttributeError: 'ToolPath' object has no attribute"),
    ],
)
def test_the_command_says_so_in_one_message(tmp_path, line, words):
    (tmp_path / "own.py").write_text(
        "from coupling.process import WithIdentity, ProcessTable\n"
        "class Own(WithIdentity):\n"
        f"    def evaluate(self, path): {line}\n"
        "class Table(ProcessTable):\n"
        "    def process(self, task): return Own(identity=self.identity(task))\n"
    )
    text = LINE_CASE.read_text()
    text = text.replace('"elastic-wall"', '"own.py:Table"').replace("stiffness_N_m = 2.0e5", "")
    (tmp_path / "case.toml").write_text(text)
    done = command("couple", "-v", tmp_path / "case.toml", "-o", tmp_path / "out", exits=2)
    assert words in " ".join(done.stderr.split())
    assert "own.py:Table" in done.stderr.replace("\n", "")
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


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
