"""The native FMU under masters in C: poses, threads, random calls, sanitizers, memory."""

from __future__ import annotations

import copy
import shutil
from pathlib import Path

import numpy as np
import pytest
from native_fmu import POSTURE, SANITIZERS, build_master, run_master

from coupling.fmu_export.compiler import compile_library, host_platform
from coupling.fmu_export.native_standards import STANDARDS
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand


@pytest.fixture(scope="module")
def fuzz(tmp_path_factory) -> Path:
    return build_master("fuzz2", tmp_path_factory.mktemp("fuzz") / "fuzz2")


def test_a_c_host_in_an_empty_environment_gets_the_poses_of_the_python_model(native, host, example):
    """200 steps of 4 ms under a pulsed force, with backlash, to twice the tolerance."""
    poses = np.loadtxt(run_master(native, [str(host)], "run").splitlines(), delimiter=",")
    robot = ElasticRobot(example)
    q = np.array(POSTURE)
    robot.reset(0.0, HeldCommand(0.0, q, np.zeros(6), np.zeros(6)), Load())
    for k in range(200):
        force = np.array([0.0, 0.0, -500.0 * (k % 7 < 3), 0.0, 0.0, 0.0])
        robot.step(0.004 * (k + 1), HeldCommand(robot.time, q, 0 * q, 0 * q), Load(force))
        np.testing.assert_allclose(poses[k, :3], robot.tcp()[:3], rtol=0, atol=2e-6)


def test_three_instances_in_threads_are_independent(native, host):
    run_master(native, [str(host)], "threads")


def test_random_calls_neither_crash_nor_give_values_that_are_not_finite(native, fuzz):
    assert run_master(native, [str(fuzz)], "5000").startswith("5000 calls")


def test_address_and_undefined_behaviour_sanitizers_find_nothing(native, tmp_path):
    host = build_master("host", tmp_path / "host", *SANITIZERS)
    fuzz = build_master("fuzz2", tmp_path / "fuzz2", *SANITIZERS)
    checked = copy.copy(native)
    checked.library = compile_library(
        host_platform(), STANDARDS["2"].sources(), SANITIZERS, cache=tmp_path
    )
    run_master(checked, [str(host)], "run")
    run_master(checked, [str(fuzz)], "500")


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="needs valgrind")
def test_valgrind_finds_no_error_and_no_leak(native, host, fuzz):
    found = [
        str(shutil.which("valgrind")),
        "--error-exitcode=9",
        "--leak-check=full",
        "--errors-for-leak-kinds=definite,indirect,possible",
        "-q",
    ]
    run_master(native, [*found, str(host)], "run")
    run_master(native, [*found, str(fuzz)], "300")
