"""What a robot predicts of deflections, its gears with memory too, and the derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from loading_loops import loops
from noisy_arm import arm
from slipping_robot import with_hysteresis

from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.measurements import Measurements
from coupling.identification.static.model import StaticModel
from elastic_robot.description import Robot
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand


def require_derivatives(model: StaticModel) -> None:
    """Compare the derivatives by all parameters with differences of predictions."""
    start, predicted = model.elasticity.start, model.predict(model.elasticity.start)
    for j, value in enumerate(start):
        ends = []
        for part in (-1e-6, 1e-6):
            values = start.copy()
            values[j] = value * (1.0 + part)
            ends.append(model.predict(values).deflection)
        slope = (ends[1] - ends[0]) / (2e-6 * value)
        np.testing.assert_allclose(
            predicted.by_parameter[:, :, j],
            slope,
            atol=2e-4 * np.abs(slope).max(),
            err_msg=model.elasticity.names[j],
        )


@pytest.mark.parametrize("tilt", [False, True])
def test_predictions_are_the_robots_own_steps_and_derivatives_their_differences(tilt):
    """Elements that slip, stick and turn back; slip torques, slip angles and compliances."""
    robot = with_hysteresis(arm(tilt), (90.0, 150.0, 60.0))
    rows = loops(robot, 3, 5, 900.0)
    parameters = ElasticParameters.of(robot, "backlash", shaped=(0, 1, 2))
    model = StaticModel(parameters, rows, "backlash")
    predicted = model.predict(parameters.start)
    np.testing.assert_allclose(predicted.deflection, rows.deflection, atol=1e-12)
    require_derivatives(model)


def at_rest(robot: Robot, q: np.ndarray, wrench: np.ndarray, arm: np.ndarray) -> pin.SE3:
    """Return the placement of a point off the TCP, tool axes [m], by the robot that the FMU is."""
    resting = ElasticRobot(robot, "backlash", quasistatic=True)
    resting.reset(0.0, HeldCommand(0.0, q, 0.0 * q, 0.0 * q), Load(wrench))
    tool = pin.XYZQUATToSE3(resting.tcp())
    return pin.SE3(tool.rotation, tool.act(arm))


def test_a_load_from_rest_moves_a_point_by_what_lies_between_the_robots_two_rests():
    """Gears pass through their backlash; load and measured point are off the TCP, rotations are told."""
    robot = arm(tilt=True)
    gears = tuple(replace(joint, backlash=2e-4) for joint in robot.joints)
    robot, rng = replace(robot, joints=gears), np.random.default_rng(3)
    q, wrench = rng.uniform(-1.5, 1.5, (4, 3)), 800.0 * rng.normal(size=(4, 6))
    points = np.repeat(rng.uniform(-0.2, 0.2, (4, 3)), [1, 1, 2, 0], axis=0)
    places = rng.uniform(-0.2, 0.2, (4, 3))
    rows = Measurements.of(q, wrench, np.zeros((4, 6)), points, places)
    model = StaticModel(ElasticParameters.of(robot, "backlash"), rows, "backlash")
    deflection = model.predict(model.elasticity.start).deflection
    for k, point in enumerate(points):
        at_load = replace(robot, tcp_position=tuple(np.add(robot.tcp_position, point)))
        ends = [
            at_rest(at_load, q[k], load, places[k] - point) for load in (np.zeros(6), wrench[k])
        ]
        turn = pin.log3(ends[1].rotation @ ends[0].rotation.T)
        np.testing.assert_allclose(deflection[k, :3], ends[1].translation - ends[0].translation)
        np.testing.assert_allclose(deflection[k, 3:], turn)
    require_derivatives(model)
