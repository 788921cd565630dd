"""The native FMU under a master in C: poses and threads; test_fuzz.py has random calls."""

from __future__ import annotations

import numpy as np
from native_fmu import POSTURE, run_master

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
