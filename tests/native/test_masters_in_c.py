"""The native FMU under a master in C: poses, threads, memory; test_fuzz.py has random calls."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from native_fmu import POSTURE, build_master, run_master

from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand


def test_a_c_host_in_an_empty_environment_gets_the_poses_of_the_python_model(native, host, example):
    """100 steps of 4 ms under a pulsed force, with backlash, to twice the tolerance."""
    poses = np.loadtxt(run_master(native, [str(host)], "run").splitlines(), delimiter=",")
    robot = ElasticRobot(example)
    q = np.array(POSTURE)
    robot.reset(0.0, HeldCommand(0.0, q, np.zeros(6), np.zeros(6)), Load())
    for k in range(100):
        force = np.array([0.0, 0.0, -500.0 * (k % 7 < 3), 0.0, 0.0, 0.0])
        robot.step(0.004 * (k + 1), HeldCommand(robot.time, q, 0 * q, 0 * q), Load(force))
        np.testing.assert_allclose(poses[k, :3], robot.tcp()[:3], rtol=0, atol=2e-6)


def test_three_instances_in_threads_are_independent(native, host):
    run_master(native, [str(host)], "threads")


@pytest.mark.skipif(sys.platform != "linux", reason="its master counts calls of glibc")
def test_memory_is_asked_for_before_the_first_step_only(native, tmp_path):
    """Steps, refused ones among them, inputs, all outputs, derivatives, states kept and restored."""
    master = build_master("cycles", tmp_path / "cycles")
    lines = run_master(native, [str(master)], "allocations").splitlines()
    assert len(lines) == 6  # three curves, moving and at rest
    for line in lines:
        counts = dict(part.split() for part in line.split(": ")[1].split(", "))
        assert int(counts.pop("start")) > 0
        assert set(counts) == {"set", "step", "get", "derivative", "state"}
        assert set(counts.values()) == {"0"}, line
