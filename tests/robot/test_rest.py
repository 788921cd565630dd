"""Rest in C, as the desk asks for it: that of the Python model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from coupling.inverse.inversion import MovingRobot
from coupling.inverse.spline import UniformSpline
from coupling.native.desk_robot import DeskRest
from coupling.native.robot_text import MOST_TABLE_POINTS
from coupling.path.histories import WrenchHistory
from elastic_robot.chain import build_chain
from elastic_robot.description import StopElement
from elastic_robot.dynamics import Dynamics
from elastic_robot.hysteresis import Hysteresis, Past
from elastic_robot.parameters import Parameters
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import TORQUE_CURVES
from tests.helpers.random_robots import make_robot


@pytest.mark.parametrize("curve", TORQUE_CURVES)
@pytest.mark.parametrize("slips", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_gears_come_to_rest_as_in_python(seed: int, slips: bool, curve: str):
    robot, rng = make_robot(seed, joints=5 + seed % 3), np.random.default_rng(seed)
    if slips:
        stops = (StopElement(30.0, 1e-4), StopElement(50.0, 3e-4))
        joints = [replace(j, hysteresis=stops if j.stiffness else ()) for j in robot.joints]
        robot = replace(robot, joints=tuple(joints))
    chain, numbers = build_chain(robot), Parameters.of(robot)
    dynamics, law = Dynamics(chain, numbers.gravity), TORQUE_CURVES[curve].build(numbers)
    unloaded = Past.start(Hysteresis(chain.elements, numbers.hysteresis))
    rest = DeskRest(robot, curve)
    for _ in range(4):
        q, wrench = rng.normal(size=chain.joint_count), 50.0 * rng.normal(size=6)
        expected = equilibrium(dynamics, law, q, ToolLoad(wrench), unloaded)
        np.testing.assert_allclose(rest.at(q, wrench), expected, rtol=0.0, atol=1e-12)


def test_a_load_that_bends_a_robot_beyond_all_bounds_has_no_rest():
    robot = make_robot(1, joints=6)
    assert DeskRest(robot, "linear").at(np.zeros(6), np.full(6, 1e12)) is None


def test_a_table_with_more_points_than_the_library_holds_is_one_of_its_springs():
    """Points on a straight line are that line's spring."""
    robot, rng = make_robot(2, joints=6), np.random.default_rng(2)
    angle = np.linspace(-0.02, 0.02, MOST_TABLE_POINTS + 1)
    points = [tuple(zip(angle, (j.stiffness or 0.0) * angle, strict=True)) for j in robot.joints]
    joints = [
        replace(joint, torque_table=table if joint.stiffness else None)
        for joint, table in zip(robot.joints, points, strict=True)
    ]
    tabled = MovingRobot(replace(robot, joints=tuple(joints)), "spline")
    plain = MovingRobot(robot, "linear")
    posture = rng.normal(size=plain.model.chain.model.nq)
    still = UniformSpline(0.0, 1.0, np.tile(posture, (6, 1)), 5)
    wrench = WrenchHistory(np.array([0.0, 1.0]), np.full((2, 6), 20.0))
    np.testing.assert_allclose(
        tabled.at_rest(still, np.zeros(1), wrench),
        plain.at_rest(still, np.zeros(1), wrench),
        rtol=0.0,
        atol=1e-12,
    )
