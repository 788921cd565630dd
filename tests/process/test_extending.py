"""docs/extending.md: its code runs as it is printed, and what it promises is kept."""

import os
import re
import subprocess
import sys

import numpy as np
import pytest
import tomlkit
from places import DOCS

from coupling.case.file import load_case
from coupling.errors import CaseError, ProcessError
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process import ProcessResponse
from coupling.process.testing import check_process
from coupling.run.execute import run_coupling

PAGE = DOCS / "extending.md"


@pytest.fixture
def printed(tmp_path):
    """Return a folder with the files printed in the page."""
    blocks = re.findall(r"```\w+\n# (\S+)\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert [name for name, _ in blocks] == [
        "rubber_pad.py",
        "rubber_pad.toml",
        "test_rubber_pad.py",
    ]
    for name, text in blocks:
        (tmp_path / name).write_text(text)
    return tmp_path


def test_the_printed_process_passes_its_printed_test(printed):
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_rubber_pad.py"],
        cwd=printed,
        env={**os.environ, "PYTHONPATH": str(printed)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 passed" in done.stdout


def test_the_printed_process_has_about_twenty_lines(printed):
    lines = (printed / "rubber_pad.py").read_text().splitlines()
    code = [line for line in lines if line.strip() and not line.startswith(("import", "from"))]
    assert len(code) <= 20


def test_the_printed_case_couples_and_its_resolved_case_finds_the_process(printed, tmp_path):
    case = load_case(printed / "rubber_pad.toml")
    run = run_coupling(case)
    assert run.correction.converged, run.correction.reason
    (tmp_path / "elsewhere").mkdir()
    resolved = tmp_path / "elsewhere" / "case.toml"
    resolved.write_text(tomlkit.dumps(case.resolved))
    again = load_case(resolved).process
    assert (again.stiffness, again.thickness) == (1e5, 0.01)


# What is wrong with the file, the model that the case names, and what the message must contain.
BAD_FILES = {
    "no file": (None, "none.py:Table", "none.py, which is not there"),
    "no class": ("x = 1", "own.py:Table", "own.py: expected a class Table .*, got none"),
    "no table": (
        "class Table: pass",
        "own.py:Table",
        "derived from elastic_robot.coupling.process.ProcessTable, .*, got <class",
    ),
    "no method": (
        "from coupling.process import ProcessTable\nclass Table(ProcessTable): pass",
        "own.py:Table",
        r"with a method process\(task\)",
    ),
    "exit": (
        "import sys\nsys.exit(0)",
        "own.py:Table",
        "own.py: cannot be imported: SystemExit: 0",
    ),
    "broken": ("x = ", "own.py:Table", "own.py: cannot be imported: SyntaxError"),
    "neither": (
        None,
        "rubber",
        "expected one of .* or a class in a file of your own .*, got 'rubber'",
    ),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_a_bad_file_of_ones_own_is_named(printed, name):
    code, model, words = BAD_FILES[name]
    if code is not None:
        (printed / "own.py").write_text(code)
    case = printed / "rubber_pad.toml"
    case.write_text(case.read_text().replace("rubber_pad.py:RubberPadTable", model))
    with pytest.raises(CaseError, match=words):
        load_case(case)


def test_a_key_that_the_table_does_not_know_is_refused(printed):
    case = printed / "rubber_pad.toml"
    case.write_text(case.read_text().replace("thickness_m", "thicknes_m"))
    with pytest.raises(CaseError, match="did you mean 'thickness_m'"):
        load_case(case)


class _Forgetful:
    """A process that breaks one rule."""

    identity = ""

    def __init__(self, rule: str) -> None:
        self.rule, self.calls = rule, 0

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        self.calls += 1
        time = path.time
        if self.rule == "time":
            time = path.time * 2.0
        if self.rule == "path":
            path.pose[0, 0, 0] += 1.0
        force = np.zeros((len(time), 6))
        if self.rule == "memory":
            force += self.calls
        return ProcessResponse(WrenchHistory(time, force))


@pytest.mark.parametrize(
    ("rule", "words"),
    [("time", "times of its own"), ("path", "changed the path"), ("memory", "the second time")],
)
def test_a_broken_rule_is_found(rule, words):
    pose = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (3, 1))
    with pytest.raises(ProcessError, match=words):
        check_process(_Forgetful(rule), ToolPath(np.array([0.0, 1.0, 2.0]), pose))
