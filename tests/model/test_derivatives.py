"""Derivatives of the model against complex steps through an independent model, over random robots."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from complex_robot import Numbers, along, derivative, residual, torque
from derivative_errors import Case, engaged, residual_errors, rest, static_errors
from hypothesis import assume, given
from hypothesis import strategies as st
from random_robots import robots, with_hysteresis

from coupling.fmu_export.exchange_blocks import all_blocks
from elastic_robot.chain import build_chain
from elastic_robot.errors import ParameterError
from elastic_robot.parameter_names import parameter_names
from elastic_robot.parameters import Parameters
from elastic_robot.residual import OperatingPoint, residual_derivatives
from elastic_robot.residual import residual as model_residual
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.torque_curves import TORQUE_CURVES
from elastic_robot.trajectory import HeldCommand

SEEDS = st.integers(0, 10**6)
CURVES = st.sampled_from(sorted(TORQUE_CURVES))


@given(robots(), SEEDS, CURVES)
def test_residual_is_that_of_newton_and_euler(robot, seed, curve):
    case = Case(robot, curve, seed)
    expected = residual(robot, curve, case.numbers).real
    scale = 1.0 + np.abs(expected).max(initial=0.0)
    found = model_residual(*case.model())
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * scale)


@given(robots(), SEEDS, CURVES)
def test_residual_derivatives_are_those_of_complex_steps(robot, seed, curve):
    errors = list(residual_errors(Case(robot, curve, seed)))
    assert len(errors) == 13
    assert [item for item in errors if item[1] > 1e-12] == []


@given(robots(), SEEDS, CURVES)
def test_static_sensitivities_are_those_of_complex_steps(robot, seed, curve):
    """Inside its backlash a gear counts with its flank's stiffness, so here all gears carry load."""
    case = Case(robot, curve, seed)
    x = rest(case)
    assume(engaged(case, x))
    errors = list(static_errors(case, x))
    assert len(errors) == 16
    assert [item for item in errors if item[1] > 1e-10] == []


def test_states_of_a_step_at_once_are_those_one_by_one(example):
    case = Case(example, "backlash", 1)
    points = [Case(example, "backlash", seed).point for seed in (1, 2, 3)]
    region = case.curve.region(points[0].motion[0])
    drives, motion = (
        np.stack([getattr(point, name) for point in points], axis=1)
        for name in ("drives", "motion")
    )
    stages = OperatingPoint(drives, motion, case.point.acting, region)
    model = (case.dynamics, case.curve, case.parameters.damping)
    at_once, torques = residual_derivatives(*model, stages), model_residual(*model, stages)
    for k in range(3):
        one = replace(stages, drives=drives[:, k], motion=motion[:, k])
        alone = residual_derivatives(*model, one)
        assert_same(model_residual(*model, one), torques[k])
        assert_same(alone.parameters.values, at_once.parameters.values[k])
        for name in ("x", "rate", "acceleration", "drive", "drive_rate", "wrench"):
            assert_same(getattr(alone, name), getattr(at_once, name)[k])


def assert_same(found: np.ndarray, expected: np.ndarray) -> None:
    """Products of matrices are summed in another order for several states than for one, by processor."""
    np.testing.assert_allclose(
        found, expected, rtol=0, atol=1e-13 * np.abs(expected).max(initial=0)
    )


@given(SEEDS, st.floats(1e3, 1e8), st.floats(1e-6, 1e-2), CURVES)
def test_gradients_of_the_torque_curves_are_those_of_complex_steps(seed, k, b, name):
    """Without backlash the derivative by B is that of a backlash that opens, -k sign(x)."""
    rng = np.random.default_rng(seed)
    stiffness, backlash = np.full(8, k), np.full(8, b)
    x = b * rng.uniform(-4.0, 4.0, 8)
    curve = TORQUE_CURVES[name].build(
        Parameters(np.zeros(3), stiffness, 0 * x, backlash, 0 * x, (None,) * 8)
    )
    numbers = Numbers(
        np.zeros((3, 0)), np.array([x, 0 * x, 0 * x]), *np.zeros((2, 3)), stiffness, 0 * x, backlash
    )
    branch = curve.in_region(curve.region(x))
    for law in (curve, branch):
        by_k = derivative(torque(name, along(numbers, stiffness=np.ones(8))))
        by_b = derivative(torque(name, along(numbers, backlash=np.ones(8))))
        np.testing.assert_allclose(law.stiffness_gradient(x), by_k, rtol=1e-12, atol=1e-12 * b)
        np.testing.assert_allclose(law.backlash_gradient(x), by_b, rtol=1e-12, atol=1e-12 * k)
    tight = TORQUE_CURVES[name].build(
        Parameters(np.zeros(3), stiffness, 0 * x, 0 * x, 0 * x, (None,) * 8)
    )
    opening = -k * np.sign(x) if TORQUE_CURVES[name].has_backlash else 0.0
    np.testing.assert_allclose(tight.backlash_gradient(x), opening + 0.0 * x, rtol=1e-15)


def test_a_table_takes_the_place_of_stiffness_and_backlash():
    points = tuple((a, 1e6 * a + 1e9 * a**3) for a in np.linspace(-1e-2, 1e-2, 9).tolist())
    x = np.array([3e-3])
    for k, b in ((1e6, 1e-3), (2e6, 2e-3)):
        parameters = Parameters(np.zeros(3), np.array([k]), 0 * x, np.array([b]), 0 * x, (points,))
        curve = TORQUE_CURVES["spline"].build(parameters)
        assert curve.torque(x)[0] == pytest.approx(1e6 * x[0] + 1e9 * x[0] ** 3, rel=1e-2)
        assert curve.stiffness_gradient(x)[0] == 0.0
        assert curve.backlash_gradient(x)[0] == 0.0


def test_parameters_are_those_of_the_fmu_in_its_order(example):
    keys = ("gravity", "stiffness", "damping", "backlash", "hysteresis")
    for robot in (example, with_hysteresis(example, 1)):
        table = all_blocks(robot)
        names = [variable.name for key in keys for variable in table[key].variables]
        assert list(parameter_names(build_chain(robot))) == names


def test_a_parameter_that_does_not_exist_is_an_error_with_the_known_names(example):
    robot = ElasticRobot(example)
    robot.reset(0.0, HeldCommand(0.0, *np.zeros((3, 6))), Load())
    with pytest.raises(ParameterError, match=r"joint\[5\].stiffness.*got 'joint\[6\].stiffness'"):
        robot.residual_derivatives().parameters["joint[6].stiffness"]
