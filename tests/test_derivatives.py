"""Derivatives of the model against complex steps through an independent model, over random robots."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from complex_robot import (
    Numbers,
    along,
    changed,
    derivative,
    evaluate,
    residual,
    small_rotation,
    torque,
)
from hypothesis import assume, given
from hypothesis import strategies as st
from random_robots import robots

from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import ParameterError
from elastic_robot.interface import blocks
from elastic_robot.parameter_names import parameter_names
from elastic_robot.parameters import Parameters
from elastic_robot.residual import OperatingPoint, residual_derivatives
from elastic_robot.residual import residual as model_residual
from elastic_robot.robot import ElasticRobot
from elastic_robot.static_sensitivity import static_sensitivities
from elastic_robot.statics import equilibrium
from elastic_robot.torque_curves import TORQUE_CURVES
from elastic_robot.trajectory import HeldCommand

SEEDS = st.integers(0, 10**6)
CURVES = st.sampled_from(sorted(TORQUE_CURVES))


class Case:
    """A random robot in a random state, as the project's model and as the independent one."""

    def __init__(self, robot: Robot, curve: str, seed: int) -> None:
        self.robot, self.name = robot, curve
        self.rng = rng = np.random.default_rng(seed)
        self.parameters = parameters = Parameters.of(robot)
        self.chain = build_chain(robot)
        self.dynamics = Dynamics(self.chain, parameters.gravity)
        self.curve = TORQUE_CURVES[curve].build(parameters)
        n, m = self.chain.joint_count, self.chain.elastic_count
        drives = rng.normal(size=(3, n)) * [[1.5], [1.0], [5.0]]
        # Deflections on both sides of a dead band of 1e-4 rad and inside it.
        motion = rng.normal(size=(3, m)) * [[2e-4], [0.1], [10.0]]
        wrench = rng.normal(size=6) * [1e3, 1e3, 1e3, 1e2, 1e2, 1e2]
        self.point = OperatingPoint(drives, motion, wrench, self.curve.region(motion[0]))
        values = (parameters.gravity, parameters.stiffness, parameters.damping, parameters.backlash)
        self.numbers = Numbers(drives, motion, wrench, *values)

    def model(self) -> tuple:
        return self.dynamics, self.curve, self.parameters.damping, self.point

    def directions(self) -> dict[str, np.ndarray]:
        """A random direction of each argument; tilts have no backlash to change."""
        found = {name: self.rng.normal(size=v.shape) for name, v in vars(self.numbers).items()}
        found["backlash"] *= self.chain.elastic_tilt == 0
        return found

    def columns(self, directions: dict[str, np.ndarray]) -> np.ndarray:
        """The directions of the parameters in the order of `parameter_names`, (p,)."""
        keys = ("gravity", "stiffness", "damping")
        backlash = directions["backlash"][self.chain.twists]
        return np.concatenate([*(directions[key] for key in keys), backlash])


def assert_close(found: np.ndarray, expected: np.ndarray, scale: float, relative: float) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=relative * scale)


@given(robots(), SEEDS, CURVES)
def test_residual_is_that_of_newton_and_euler(robot, seed, curve):
    case = Case(robot, curve, seed)
    expected = residual(robot, curve, case.numbers).real
    scale = 1.0 + np.abs(expected).max(initial=0.0)
    assert_close(model_residual(*case.model()), expected, scale, 1e-11)


@given(robots(), SEEDS, CURVES)
def test_residual_derivatives_are_those_of_complex_steps(robot, seed, curve):
    """One random direction for each argument, so that a permuted column shows too."""
    case = Case(robot, curve, seed)
    by, directions = residual_derivatives(*case.model()), case.directions()
    blocks_of = {
        "drives": (by.drive, by.drive_rate, by.drive_acceleration),
        "motion": (by.x, by.rate, by.acceleration),
    }
    for name, matrices in blocks_of.items():
        for row, matrix in enumerate(matrices):
            direction = np.zeros_like(directions[name])
            direction[row] = directions[name][row]
            expected = derivative(residual(robot, curve, along(case.numbers, **{name: direction})))
            scale = 1.0 + np.abs(matrix).max(initial=0.0)
            assert_close(matrix @ direction[row], expected, scale, 1e-12)
    expected = derivative(residual(robot, curve, along(case.numbers, wrench=directions["wrench"])))
    assert_close(by.wrench @ directions["wrench"], expected, 1.0, 1e-12)
    for key in ("gravity", "stiffness", "damping", "backlash"):
        one = {name: d * (name == key) for name, d in directions.items()}
        expected = derivative(residual(robot, curve, along(case.numbers, **{key: directions[key]})))
        columns = by.parameters.values * case.columns(one)
        assert_close(columns.sum(axis=-1), expected, np.abs(columns).max(initial=0.0), 1e-12)


def test_states_of_a_step_at_once_are_those_one_by_one(example):
    case = Case(example, "backlash", 1)
    points = [Case(example, "backlash", seed).point for seed in (1, 2, 3)]
    region = case.curve.region(points[0].motion[0])
    drives, motion = (
        np.stack([getattr(point, name) for point in points], axis=1)
        for name in ("drives", "motion")
    )
    stages = OperatingPoint(drives, motion, case.point.wrench, region)
    model = (case.dynamics, case.curve, case.parameters.damping)
    at_once, torques = residual_derivatives(*model, stages), model_residual(*model, stages)
    for k in range(3):
        one = replace(stages, drives=drives[:, k], motion=motion[:, k])
        alone = residual_derivatives(*model, one)
        assert np.array_equal(model_residual(*model, one), torques[k])
        assert np.array_equal(alone.parameters.values, at_once.parameters.values[k])
        for name in ("x", "rate", "acceleration", "drive", "drive_rate", "wrench"):
            assert np.array_equal(getattr(alone, name), getattr(at_once, name)[k])


@given(SEEDS, st.floats(1e3, 1e8), st.floats(1e-6, 1e-2), CURVES)
def test_gradients_of_the_torque_curves_are_those_of_complex_steps(seed, k, b, name):
    """Without play the derivative by B is that of a play that opens, -k sign(x)."""
    rng = np.random.default_rng(seed)
    stiffness, backlash = np.full(8, k), np.full(8, b)
    x = b * rng.uniform(-4.0, 4.0, 8)
    curve = TORQUE_CURVES[name].build(
        Parameters(np.zeros(3), stiffness, 0 * x, backlash, (None,) * 8)
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
    tight = TORQUE_CURVES[name].build(Parameters(np.zeros(3), stiffness, 0 * x, 0 * x, (None,) * 8))
    opening = 0.0 if name == "linear" else -k * np.sign(x)
    np.testing.assert_allclose(tight.backlash_gradient(x), opening + 0.0 * x, rtol=1e-15)


def test_a_table_takes_the_place_of_stiffness_and_backlash():
    points = tuple((a, 1e6 * a + 1e9 * a**3) for a in np.linspace(-1e-2, 1e-2, 9).tolist())
    x = np.array([3e-3])
    for k, b in ((1e6, 1e-3), (2e6, 2e-3)):
        parameters = Parameters(np.zeros(3), np.array([k]), 0 * x, np.array([b]), (points,))
        curve = TORQUE_CURVES["spline"].build(parameters)
        assert curve.torque(x)[0] == pytest.approx(1e6 * x[0] + 1e9 * x[0] ** 3, rel=1e-2)
        assert curve.stiffness_gradient(x)[0] == 0.0
        assert curve.backlash_gradient(x)[0] == 0.0


def equilibrium_after(case: Case, x: np.ndarray, **directions: np.ndarray) -> Numbers:
    """Newton's method in complex arithmetic: the equilibrium an imaginary step further."""
    numbers = along(case.numbers, **directions)
    theta = case.chain.theta(case.numbers.drives[0], x)
    stiffness = np.diag(case.curve.slope(x))
    stiffness = stiffness - case.dynamics.static_torque_gradient(theta, case.numbers.wrench)
    for _ in range(8):
        step = np.linalg.solve(stiffness, -residual(case.robot, case.name, numbers))
        x = x + step
        numbers = changed(numbers, motion=np.array([x, 0 * x, 0 * x]))
    return numbers


@given(robots(), SEEDS, CURVES)
def test_static_sensitivities_are_those_of_complex_steps(robot, seed, curve):
    """Of the equilibrium itself, found anew by Newton's method in complex arithmetic.

    Robots whose gears all carry load: inside its play a gear counts with its flank's stiffness.
    """
    case = Case(robot, curve, seed)
    q, wrench = case.point.drives[0], case.point.wrench
    x = equilibrium(case.dynamics, case.curve, q, wrench)
    assume(np.all(np.abs(case.curve.torque(x)) > 1.0))
    assume(np.all(case.curve.region(1.01 * x) == case.curve.region(0.99 * x)))
    drives = np.array([q, 0 * q, 0 * q])
    case.numbers = changed(case.numbers, drives=drives, motion=np.array([x, 0 * x, 0 * x]))
    by, directions = (
        static_sensitivities(case.dynamics, case.curve, q, x, wrench),
        case.directions(),
    )
    for key in ("wrench", "drives", "gravity", "stiffness", "damping", "backlash"):
        direction = directions[key]
        if key == "drives":
            direction = direction * [[1.0], [0.0], [0.0]]
        moved = equilibrium_after(case, x, **{key: direction})
        answer = evaluate(robot, moved)
        tcp = np.append(derivative(answer.position), small_rotation(answer.rotation))
        one = {name: d * (name == key) for name, d in directions.items()}
        for sensitivity, expected in ((by.x, derivative(moved.motion[0])), (by.tcp, tcp)):
            matrix, change = {
                "wrench": (sensitivity.wrench, direction),
                "drives": (sensitivity.drives, direction[0]),
            }.get(key, (sensitivity.parameters.values, case.columns(one)))
            scale = np.abs(matrix * change).max(initial=1e-300)
            assert_close(matrix @ change, expected, scale, 1e-9)


def test_parameters_are_those_of_the_fmu_in_its_order(example):
    table = blocks(example)
    keys = ("gravity", "stiffness", "damping", "backlash")
    names = [variable.name for key in keys for variable in table[key].variables]
    assert list(parameter_names(build_chain(example))) == names


def test_every_named_sensitivity_is_that_of_the_simulated_robot(example):
    """Central differences of the pose over every parameter; what is left is their own error."""
    posture = np.array([0.3, -0.3, 0.5, 0.4, 0.6, 0.2])
    rest = HeldCommand(0.0, posture, np.zeros(6), np.zeros(6))
    wrench = np.array([300.0, 800.0, -1500.0, 20.0, 30.0, 40.0])
    robot = ElasticRobot(example, "backlash", quasistatic=True)
    robot.reset(0.0, rest, wrench)
    nominal, by = robot.parameters, robot.static_sensitivities().tcp.parameters

    def position(name: str, change: float) -> np.ndarray:
        group, _, key = name.rpartition(".")
        field = "gravity" if group == "gravity" else key
        values = getattr(nominal, field).copy()
        index = "xyz".index(key) if group == "gravity" else robot.chain.elastic_names.index(group)
        values[index] += change
        robot.parameters = replace(nominal, **{field: values})
        robot.reset(0.0, rest, wrench)
        return robot.tcp()[:3]

    steps = {"stiffness": 1e3, "damping": 1.0, "backlash": 1e-6}
    for name in by.names:
        step = steps.get(name.rpartition(".")[2], 1e-2)
        expected = (position(name, step) - position(name, -step)) / (2 * step)
        np.testing.assert_allclose(by[name][:3], expected, rtol=1e-6, atol=1e-14 / step)


def test_a_parameter_that_does_not_exist_is_an_error_with_the_known_names(example):
    robot = ElasticRobot(example)
    robot.reset(0.0, HeldCommand(0.0, *np.zeros((3, 6))), np.zeros(6))
    with pytest.raises(ParameterError, match=r"joint\[6\].stiffness.*joint\[5\].stiffness"):
        robot.residual_derivatives().parameters["joint[6].stiffness"]
