"""An author's mistake in a process of his own is an error that names it, not a traceback."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
import pytest
from command_line import command
from places import LINE_CASE

from coupling.errors import CaseError, ProcessError
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process import ProcessResponse
from coupling.process.validation import evaluate_validated

PATH = ToolPath(np.linspace(0.0, 1.0, 5), np.tile([0.0, 0, 0, 0, 0, 0, 1.0], (5, 1)))


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
    done = command("couple", "-v", tmp_path / "case.toml", "-o", tmp_path / "out")
    assert done.returncode == 2
    assert words in " ".join(done.stderr.split())
    assert "own.py:Table" in done.stderr.replace("\n", "")
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()
