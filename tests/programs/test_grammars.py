"""Programs under a grammar that another house wrote: rapidchecker's, of ABB's reference manual."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from coupling.programs.languages import LANGUAGES
from coupling.programs.program import Configuration, ProgramMove, RobotProgram

POSE = (0.001, -2.0, 3.0, 0.0, 0.0, 0.6, 0.8)
POSTURE = Configuration(True, True, -1, (-0.1, 7.0, 0.0, -3.0, 0.0, 7.0))
PATHS = {
    "poses": [
        ProgramMove("linear", POSE, duration=1e-3 * k, configuration=POSTURE) for k in range(1, 4)
    ],
    "joints": [ProgramMove("joint", joints=(-0.1, 7.0, 1e-9, 0.0, -1e-9, 3.0), duration=0.5)] * 3,
}
WIDE = {**os.environ, "COLUMNS": "400"}  # names of files in one line
# What no module goes without.
NEEDED = (":=", ";\n", "],", "MoveAbsJ", "fine", "PROC", "ENDMODULE")


def module(timed: list[ProgramMove]) -> str:
    """Return a module that leads slowly to the first of these motions, in frames of its own."""
    start = timed[0]
    motion = "linear" if start.pose else "joint"
    way = ProgramMove(
        motion, start.pose, start.joints, speed=0.01, configuration=start.configuration
    )
    moves = (ProgramMove("joint", joints=(0.0,) * 6), way, *timed[1:])
    (file,) = LANGUAGES["rapid"].write(RobotProgram("WAY_1", moves, POSE, POSE))
    return file.text


@pytest.mark.skipif(
    importlib.util.find_spec("rapidchecker") is None,
    reason="needs rapidchecker, as the lock has it",
)
def test_rapid_modules_keep_the_grammar_and_damaged_ones_do_not(tmp_path):
    expected = set()
    for name, timed in PATHS.items():
        text = module(timed)
        (tmp_path / f"{name}.mod").write_text(text)
        for k, part in enumerate(NEEDED):
            assert part in text
            (tmp_path / f"{name}_{k}.mod").write_text(text.replace(part, "", 1))
            expected.add(f"{name}_{k}.mod")
    files = sorted(str(file) for file in tmp_path.glob("*.mod"))
    command = [sys.executable, "-m", "rapidchecker", *files]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=WIDE)
    refused = {Path(line).name for line in re.findall(r"^\S+\.mod$", done.stdout, re.MULTILINE)}
    assert refused == expected
