"""elastic-robot check: what is said of a case without running it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from places import CASES


def checked(case: Path, *options: str) -> subprocess.CompletedProcess[str]:
    program = [sys.executable, "-m", "coupling.cli", "check", str(case), *options]
    return subprocess.run(program, capture_output=True, text=True, cwd=case.parent)


def short(folder: Path, name: str, **changes: str) -> Path:
    """Return a case of one contour in a folder of its own."""
    text = (CASES / f"{name}.toml").read_text().replace("depth_m        = 0.01", "depth_m = 0.0005")
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new, 1)
    file = folder / f"{name}.toml"
    file.write_text(text)
    return file


def test_it_tells_path_joints_and_gears_and_leaves_nothing(tmp_path):
    case = short(tmp_path, "cone")
    done = checked(case, "--evaluate")
    assert done.returncode == 0, done.stderr
    assert "of path in" in done.stdout
    assert "  joint 6: " in done.stdout
    assert "changes of its flank" in done.stdout
    assert [file.name for file in tmp_path.iterdir()] == ["cone.toml"]


def test_without_the_process_only_the_robot_s_weight_counts(tmp_path):
    done = checked(short(tmp_path, "cone_robust"))
    assert done.returncode == 0, done.stderr
    assert "under the robot's own weight" in done.stdout
    forced = checked(short(tmp_path, "cone_robust"), "--evaluate")
    assert "process, at most" in forced.stdout
    assert "N a wrong backlash would show of no gear at the tool" in forced.stdout


def test_gears_that_turn_without_play_are_not_said_to_keep_a_flank(tmp_path):
    """All that is known of them is that a wrong backlash would not show."""
    curve = {'torque_curve = "backlash"': 'torque_curve = "linear"'}
    done = checked(short(tmp_path, "cone", **curve), "--evaluate")
    assert done.returncode == 0, done.stderr
    assert "a wrong backlash would show of no gear" in done.stdout
    assert "flank" not in done.stdout


def test_what_cannot_be_run_is_said_in_a_sentence(tmp_path):
    far = short(
        tmp_path, "cone", **{"position_m = [1.6, 0.0, 0.8]": "position_m = [9.6, 0.0, 0.8]"}
    )
    done = checked(far)
    assert done.returncode == 2
    assert "out of reach" in done.stderr
    assert "Traceback" not in done.stderr
    far.write_bytes(b"\xff\xfe[robot")
    assert checked(far).returncode == 2
