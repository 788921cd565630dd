"""The desk library: under sanitizers, and made for every platform."""

from __future__ import annotations

import os
import subprocess

import numpy as np
import pytest
from native_fmu import SANITIZERS, build_linked
from random_robots import make_robot, with_gear_parts

from coupling.inverse.link_model import LinkModel
from coupling.native.compiler import SOURCES, compile_library, host_platform
from coupling.native.desk_library import DESK_SOURCES, desk_sources
from coupling.native.desk_robot import DeskRobot
from coupling.native.robot_text import robot_text
from elastic_robot.errors import RobotFileError

ROUNDS = str(max(300, int(os.environ.get("ELASTIC_ROBOT_FUZZ", "0")) // 50))
SEED = os.environ.get("ELASTIC_ROBOT_FUZZ_SEED", "1")


def test_sanitizers_find_nothing_in_random_numbers(tmp_path):
    """Of robots of 1 to 9 joints, whole and cut off: finite, nan, inf; paths of any length."""
    flags = (*SANITIZERS, "-fvisibility=default")
    library = compile_library(host_platform(), desk_sources(), flags)
    folders = f"-I{SOURCES}", f"-I{DESK_SOURCES}"
    fuzz = build_linked("fuzz_desk", tmp_path / "fuzz_desk", library, *SANITIZERS, *folders)
    files = []
    for seed in range(12):
        robot = with_gear_parts(make_robot(seed, joints=1 + seed % 9), seed)
        files.append(tmp_path / f"{seed}.txt")
        files[-1].write_text(robot_text(robot, "{desk}"))
    done = subprocess.run(
        [str(word) for word in (fuzz, ROUNDS, SEED, *files)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-5000:]
    assert int(done.stdout.split()[0]) > int(ROUNDS) // 10


def test_a_robot_that_is_too_long_is_refused_by_its_name():
    said = "random 1: expected at most 12 joints for the inverse, got 13"
    with pytest.raises(RobotFileError, match=said):
        DeskRobot(make_robot(1, joints=13))


def test_arrays_of_another_shape_or_not_finite_never_reach_c():
    model = LinkModel(make_robot(3, joints=6))
    theta = np.zeros((4, model.size))
    said = r"rates: expected an array of shape \(4, \d+\), got \(4, 2\)"
    with pytest.raises(ValueError, match=said):
        model.desk.loads(theta, np.zeros((4, 2)), theta, np.zeros((4, 6)))
    with pytest.raises(ValueError, match=r"wrenches: expected an array of shape \(4, 6\)"):
        model.desk.linearised(theta, theta, theta, np.zeros((3, 6)))
