"""Inverse kinematics in C: the joints of random robots, their tilts left as they are."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from coupling.inverse.link_model import LinkModel
from coupling.native.desk_robot import ReachRules
from elastic_robot.kinematics import base_from_tool
from tests.helpers.random_robots import make_robot

_RULES = ReachRules(1e-10, 60, 1e-3, 1e-12, 0.3)


@pytest.mark.parametrize("seed", range(6))
def test_a_pose_is_reached_as_pinocchio_sees_it(seed: int):
    """To rounding, by 5 to 7 joints from 0.1 rad beside, the tilts bent."""
    robot = make_robot(seed, joints=5 + seed % 3)
    model, rng = LinkModel(robot), np.random.default_rng(seed)
    chain, data = model.chain, model.chain.model.createData()
    theta = chain.theta(rng.normal(size=(9, chain.joint_count)))
    theta[:, model.tilts] = 1e-2 * rng.normal(size=(9, len(model.tilts)))
    poses = np.array([pin.SE3ToXYZQUAT(base_from_tool(chain, data, row)) for row in theta])
    start = theta.copy()
    start[:, chain.drive] += rng.uniform(-0.1, 0.1, size=(9, chain.joint_count))
    found = model.desk.reach(_RULES, poses[:, :3], poses[:, 3:], start)
    came = found.error < _RULES.tolerance
    assert came.mean() > 0.8  # a random posture may be singular
    np.testing.assert_array_equal(found.theta[:, model.tilts], theta[:, model.tilts])
    for row, pose in zip(found.theta[came], poses[came], strict=True):
        apart = base_from_tool(chain, data, row).actInv(pin.XYZQUATToSE3(pose))
        assert np.linalg.norm(pin.log6(apart).vector) < 1e-12


def test_a_pose_out_of_reach_tells_how_far_the_tool_stays_away():
    model = LinkModel(make_robot(1, joints=6))
    away = 3.0 * model.reach
    start, turned = np.zeros((1, model.size)), np.array([[0.0, 0.0, 0.0, 1.0]])
    found = model.desk.reach(_RULES, np.array([[away, 0.0, 0.0]]), turned, start)
    assert found.error[0] > 1.9 * model.reach
    assert 1.9 * model.reach < found.away[0] < 4.1 * model.reach
