"""The commands and the snippet of the README, run as they stand, with the files that they name."""

import re
import shlex
import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from places import DOCS, EXAMPLES, ROOT
from wall_case import WALL_CASE

from coupling.cli import main
from coupling.native import compiler

pytestmark = pytest.mark.usefixtures("few_drawn_robots")

LINES = re.findall(r"^elastic-robot .*$", (ROOT / "README.md").read_text(), re.MULTILINE)
# Run in tests of their own, on longer passes and more robots than would be quick here: test_study.py,
# test_learning.py and test_next.py in tests/identification, and tests/place/test_command.py.
ELSEWHERE = {"study", "learn", "next", "mirror", "place"}
CASE = WALL_CASE.format(
    robot="icme2008", home=[0.0, 10.0, 20.0, 0.0, 60.0, 0.0], part=[1.6, 0.1, 0.8]
)


def test_every_command_of_the_readme_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(compiler, "zig", lambda: None)
    Path("my_case.toml").write_text(CASE)
    shutil.copy(EXAMPLES / "identify" / "fanuc_start.toml", "my_robot.toml")
    shutil.copy(EXAMPLES / "identify" / "fanuc_r2000ic.csv", "measurements.csv")
    seen = set()
    for line in LINES:
        words = shlex.split(line, comments=True)[1:]
        seen.add(words[0])
        if words[0] in ELSEWHERE:
            continue
        if words[0] == "compare":
            shutil.copytree("results/corrected", "results/other")
        if words[0] in ("build", "ssp"):
            # By this machine's compiler; Zig's for all platforms: tests/native/test_emulators.py.
            words += ["--platforms", compiler.host_platform().name]
        with pytest.raises(SystemExit) as done:
            main(words)
        assert done.value.code in (0, None), f"{line}\n{capsys.readouterr().err}"
        for option, value in pairwise(words):
            assert option != "-o" or Path(value).exists(), line
    assert seen >= ELSEWHERE
    assert Path("results/corrected/krl/corrected.src").exists()
    assert Path("cell/case.toml").exists()


def test_the_snippet_of_the_derivatives_runs():
    """And what it says of shapes holds; the compliance is symmetric."""
    page = (DOCS / "derivatives.md").read_text()
    (snippet,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict = {}
    exec(snippet, names)
    robot, linear = names["robot"], names["linear"]
    compliance = robot.compliance()
    np.testing.assert_allclose(
        compliance, compliance.T, rtol=0, atol=1e-6 * np.abs(compliance).max()
    )
    assert linear.dynamic_compliance(np.array([10.0, 100.0])).shape == (2, 6, 6)
