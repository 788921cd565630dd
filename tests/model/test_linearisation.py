"""The linearised robot and its derivatives: closed forms, complex steps, the nonlinear robot in time."""

from dataclasses import replace

import numpy as np
import pytest
from complex_robot import Numbers, along, derivative, residual, torque
from conftest import reference
from derivative_errors import (
    Case,
    engaged,
    residual_errors,
    rest,
    state_space_errors,
    static_errors,
)
from hypothesis import assume, given
from hypothesis import strategies as st
from random_robots import robots, with_hysteresis
from scipy.signal import StateSpace

from coupling.fmu_export.exchange_blocks import all_blocks
from elastic_robot.body import Body
from elastic_robot.chain import build_chain
from elastic_robot.description import Joint, Robot
from elastic_robot.errors import ParameterError
from elastic_robot.linearisation import linearise
from elastic_robot.parameter_names import parameter_names
from elastic_robot.parameters import Parameters
from elastic_robot.residual import OperatingPoint, residual_derivatives
from elastic_robot.residual import residual as model_residual
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.torque_curves import TORQUE_CURVES
from elastic_robot.trajectory import HeldCommand
from examples.mujoco_robot import MujocoRobot

SEEDS = st.integers(0, 10**6)
CURVES = st.sampled_from(sorted(TORQUE_CURVES))


def arm(**joint) -> Robot:
    """Return a 1 m arm about the y axis with 50 kg at its end, k = 1e4 N m/rad, d = 50 N m s/rad."""
    link = Body(mass=50.0, com=(1.0, 0.0, 0.0), inertia=(0.0, 0.0, 0.0))
    values = {"stiffness": 1e4, "damping": 50.0, **joint}
    axis = Joint((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), link, **values)
    return Robot("arm", (axis,), tcp_position=(1.0, 0.0, 0.0))


def at_rest(robot: Robot, q, curve: str = "linear", wrench=(0.0,) * 6, **options) -> ElasticRobot:
    q = np.asarray(q, dtype=float)
    elastic = ElasticRobot(robot, curve, **options)
    elastic.reset(0.0, HeldCommand(0.0, q, 0 * q, 0 * q), Load(np.array(wrench, dtype=float)))
    return elastic


def assert_close(found: np.ndarray, expected: np.ndarray, scale: float, relative: float) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=relative * scale)


@given(robots(), st.integers(0, 10**6), st.sampled_from(sorted(TORQUE_CURVES)))
def test_state_space_is_that_of_complex_steps_in_motion_too(robot, seed, curve):
    case = Case(robot, curve, seed)
    errors = list(state_space_errors(case))
    assert len(errors) == 2
    assert [item for item in errors if item[1] > 1e-10] == []
    a, b, _, _ = linearise(*case.model()).state_space
    m = case.chain.elastic_count
    assert np.array_equal(a[:m], np.eye(m, 2 * m, k=m))
    assert not b[:m].any()


def test_one_joint_has_the_closed_form_eigenvalues():
    """I s^2 + d s + k + m g l sin(theta) = 0 with I = m l^2 and the height -l sin(theta)."""
    robot = at_rest(arm(), [0.7])
    stiffness = 1e4 + 50.0 * 9.81 * np.sin(0.7 + robot.deflection()[0])
    modes = robot.linearise().modes
    omega = np.sqrt(stiffness / 50.0)
    assert modes.frequency == pytest.approx([omega / (2.0 * np.pi)], rel=1e-12)
    assert modes.damping_ratio == pytest.approx([50.0 / (2.0 * 50.0 * omega)], rel=1e-12)
    assert modes.eigenvalue.imag == pytest.approx([np.sqrt(omega**2 - 0.25)], rel=1e-12)
    # One radian turns the TCP about y and moves it downwards and back on a circle of 1 m.
    theta = 0.7 + robot.deflection()[0]
    circle = [-np.sin(theta), 0.0, -np.cos(theta), 0.0, 1.0, 0.0]
    np.testing.assert_allclose(modes.tcp[:, 0], circle, rtol=0, atol=1e-12)


def test_a_gear_inside_its_backlash_has_a_zero_eigenvalue():
    """Gravity along the axis: neither spring nor weight, only the damper d / I = 1 1/s is left."""
    free = replace(arm(backlash=1e-3), gravity=(0.0, -9.81, 0.0))
    linear = at_rest(free, [0.3], "backlash").linearise()
    np.testing.assert_allclose(linear.modes.eigenvalue, [0.0, -1.0], rtol=0, atol=1e-12)
    assert linear.modes.damping_ratio[1] == 1.0
    assert np.isnan(linear.modes.frequency).all()
    with pytest.raises(ParameterError, match="inside its backlash"):
        linear.dynamic_compliance(np.array([0.0]))


def test_example_robot_has_the_eigenvalues_of_mujocos_matrices(example):
    """Stiffness by central differences of MuJoCo's bias forces: 1e-8 of the springs is left of them.

    The figures known beforehand: 46 to 2600 1/s, slowest modes 7 to 12 Hz with damping ratios of
    0.013 to 0.018, fastest oscillation 235 Hz with 0.39; rounded, and of a few postures.
    """
    other = MujocoRobot(example)
    chain, parameters = build_chain(example), Parameters.of(example)
    rows = np.ix_(chain.elastic, chain.elastic)
    for q in np.vstack([np.zeros(6), reference("poses")[:, 1:]]):
        elastic = at_rest(example, q)
        theta, bias = chain.theta(q, elastic.deflection()), []
        for angle in [*(theta + 1e-5 * np.eye(12)), *(theta - 1e-5 * np.eye(12))]:
            other.set(angle, np.zeros(12))
            bias.append(other.bias())
        gradient = (np.array(bias[:12]) - np.array(bias[12:])).T / 2e-5
        other.set(theta, np.zeros(12))
        stiffness = gradient[rows] + np.diag(parameters.stiffness)
        matrix = np.block(
            [[0.0 * stiffness, np.eye(11)], [-stiffness, -np.diag(parameters.damping)]]
        )
        matrix[11:] = np.linalg.solve(other.mass_matrix()[rows], matrix[11:])
        expected = np.linalg.eigvals(matrix)
        expected = expected[expected.imag >= 0.0]
        modes = elastic.linearise().modes
        np.testing.assert_allclose(
            modes.eigenvalue, expected[np.argsort(np.abs(expected))], rtol=1e-7
        )
        swinging = np.flatnonzero(modes.eigenvalue.imag > 0.0)
        slowest, fastest = swinging[0], swinging[-1]
        assert 46.0 < np.abs(modes.eigenvalue).min() < np.abs(modes.eigenvalue).max() < 2600.0
        assert 7.0 < modes.frequency[slowest] < 12.5
        assert 0.012 < modes.damping_ratio[slowest] < 0.02
        assert modes.frequency[fastest] == pytest.approx(235.0, rel=0.05)
        assert modes.damping_ratio[fastest] == pytest.approx(0.39, rel=0.1)


def test_rigid_robot_follows_its_drives_alone():
    """No states: y is the Jacobian times the drives."""
    linear = at_rest(arm(stiffness=None, damping=0.0), [0.0]).linearise()
    a, b, c, d = linear.state_space
    assert a.shape == (0, 0)
    assert (b.shape, c.shape) == ((0, 9), (12, 0))
    assert linear.modes.eigenvalue.size == 0
    assert linear.inputs[6:] == ("q_cmd[1]", "qd_cmd[1]", "qdd_cmd[1]")
    assert linear.outputs[:3] == ("tcp.x", "tcp.y", "tcp.z")
    np.testing.assert_allclose(d[:6, 6], [0.0, 0.0, -1.0, 0.0, 1.0, 0.0], atol=1e-15)


@pytest.mark.parametrize(("quasistatic", "rate"), [(False, 2.0), (True, 0.0)])
def test_a_moving_drive_counts_in_dynamic_mode_alone(quasistatic, rate):
    """The TCP moves on a circle of 1 m: dv/dq is the rate times the unit vector to the axis."""
    q = np.array([0.3])
    robot = ElasticRobot(arm(stiffness=None, damping=0.0), quasistatic=quasistatic)
    robot.reset(0.0, HeldCommand(0.0, q, 0 * q + 2.0, 0 * q), Load())
    of_velocity = robot.linearise().feedthrough[6:9, 6]
    towards_axis = [-np.cos(0.3), 0.0, np.sin(0.3)]
    np.testing.assert_allclose(of_velocity, rate * np.array(towards_axis), atol=1e-14)


@given(robots(backlash=0.0), st.integers(0, 10**6))
def test_modes_satisfy_the_equation_of_motion(robot, seed):
    rng = np.random.default_rng(seed)
    linear = at_rest(robot, rng.uniform(-3, 3, len(robot.joints))).linearise()
    modes = linear.modes
    for value, shape in zip(modes.eigenvalue, modes.shape.T, strict=True):
        terms = [value**2 * linear.mass @ shape, value * linear.damping @ shape]
        terms.append(linear.stiffness @ shape)
        assert_close(sum(terms), np.zeros(len(shape)), np.abs(terms).max(), 1e-8)
        assert np.abs(shape).max() == pytest.approx(1.0, rel=1e-15)
    pairs = np.sum(modes.eigenvalue.imag > 0.0)
    assert 2 * pairs + np.sum(modes.eigenvalue.imag == 0.0) == 2 * len(linear.mass)


@given(robots(backlash=0.0), st.integers(0, 10**6))
def test_dynamic_compliance_is_the_frequency_response_and_at_zero_the_static_one(robot, seed):
    rng = np.random.default_rng(seed)
    elastic = at_rest(robot, rng.uniform(-3, 3, len(robot.joints)), wrench=300 * rng.normal(size=6))
    linear, frequency = elastic.linearise(), np.array([0.0, 3.0, 40.0])
    found = linear.dynamic_compliance(frequency)
    static = elastic.compliance()
    assert_close(found[0], static, np.abs(static).max(), 1e-10)
    if len(linear.mass) == 0:
        return
    system = StateSpace(*linear.state_space)
    for response, f in zip(found, frequency, strict=True):
        pole = 2j * np.pi * f * np.eye(len(system.A)) - system.A
        expected = (system.C @ np.linalg.solve(pole, system.B) + system.D)[:6, :6]
        assert_close(response, expected, np.abs(expected).max(), 1e-8)


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
