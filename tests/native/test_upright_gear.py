"""A gear that hangs upright: its weight is in balance, and what the others bend alone loads it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from native_core import Core

from coupling.files.robot_file import find_robot, load_robot
from elastic_robot.chain import build_chain
from elastic_robot.dynamics import Dynamics
from elastic_robot.parameters import Parameters
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load, ToolLoad
from elastic_robot.torque_curves import BacklashCurve
from elastic_robot.trajectory import HeldCommand

# Plays and drive angles [rad] at which the bent FANUC carries its flange upright, as it does under a
# command that corrects for what it bends: gear 6 is loaded by some 1e-8 N m, and turned in its backlash
# it loads itself more by way of the others.
UPRIGHT = (
    ((5e-4, 2.4e-4, 1.7e-4, 2.6e-4, 4e-4, 2.8e-4), (0.3, 0.25, -0.38, -2e-4, -0.9386729384, -0.85)),
    (
        (1.8e-4, 4.9e-4, 3.7e-4, 3.1e-4, 4.4e-4, 2.9e-4),
        (0.3, 0.25, -0.38, -2e-4, -0.9381745334, -0.45),
    ),
)


@pytest.mark.parametrize(("backlash", "q"), UPRIGHT)
def test_an_upright_gear_rests_with_nothing_left_to_balance(backlash, q):
    """Going from branch to branch of the torque curves ends in a ring there; core and Python agree."""
    fanuc = load_robot(find_robot("fanuc_r2000ic"))
    joints = [replace(own, backlash=b) for own, b in zip(fanuc.joints, backlash, strict=True)]
    robot, q = replace(fanuc, joints=tuple(joints)), np.array(q)
    python, core = ElasticRobot(robot, "backlash"), Core(robot)
    python.reset(0.0, HeldCommand(0.0, q, np.zeros(6), np.zeros(6)), Load(np.zeros(6)))
    core.reset("backlash", 0.0, q, np.zeros(6))
    chain, parameters = build_chain(robot), Parameters.of(robot)
    x, theta = python.deflection(), chain.theta(q)
    theta[chain.elastic] += x
    needed = Dynamics(chain, np.array(robot.gravity)).static_torque(theta, ToolLoad(np.zeros(6)))
    carried = BacklashCurve(parameters.stiffness, parameters.backlash).torque(x)
    np.testing.assert_allclose(carried, needed, rtol=0, atol=1e-9)
    assert np.abs(x[-1]) < backlash[-1] * (1.0 + 1e-6)
    np.testing.assert_allclose(core.outputs(len(x))["x"], x, rtol=0, atol=1e-9)
