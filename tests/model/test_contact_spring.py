"""A spring at the TCP: closed forms, equilibria and motion of random robots, an independent engine."""

from dataclasses import replace

import numpy as np
import pytest
from complex_robot import Numbers, acceleration, evaluate
from derivative_errors import random_spring
from pendulum import dynamics_of, held, pendulum
from random_robots import hardly_loaded, make_robot
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from elastic_robot.errors import ParameterError
from elastic_robot.kinematics import base_from_tool
from elastic_robot.robot import ElasticRobot
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import ContactSpring, Load, ToolLoad, symmetric
from elastic_robot.torque_curves import TORQUE_CURVES
from elastic_robot.trajectory import HeldCommand

WEIGHTLESS = {"gravity": (0.0, 0.0, 0.0)}
# Stiffness of the gear of `pendulum`, its inertia about the joint, and of a spring at its tip.
GEAR, INERTIA, SPRING = 1e4, 50.0, 3e4


def upright(height=0.0, rate=0.0, stiffness=SPRING) -> ContactSpring:
    """Return a spring in z alone, anchored at a height [m] that rises at a rate [m/s]."""
    k = np.diag([0.0, 0.0, stiffness])
    return ContactSpring(np.array([1.0, 0.0, height]), np.array([0.0, 0.0, rate]), k)


def push(force: float) -> np.ndarray:
    return np.array([0.0, 0.0, force, 0.0, 0.0, 0.0])


def random_load(rng, tcp, spread=3e-3) -> ToolLoad:
    """Return a wrench, and a spring of rank 1 to 3, 1 to 1e8 N/m, anchored some millimetres off."""
    wrench = rng.normal(size=6) * [500, 500, 500, 50, 50, 50]
    return ToolLoad(wrench, tcp + spread * rng.normal(size=3), symmetric(random_spring(rng)))


def rigid_tcp(dynamics, q) -> np.ndarray:
    chain = dynamics.chain
    return base_from_tool(chain, dynamics.data, chain.theta(q)).translation.copy()


# A robot of one joint.


@pytest.mark.parametrize("quasistatic", [True, False])
def test_arm_on_a_spring_rests_where_the_closed_form_says(quasistatic):
    """k e = (K (e-arm's height - anchor) - F) cos e, at the anchor's place at the step's end."""
    robot = ElasticRobot(pendulum(**WEIGHTLESS, damping=1e6), "linear", quasistatic)

    def rest(anchor, force):
        def torque(e):
            return GEAR * e - (SPRING * (-np.sin(e) - anchor) - force) * np.cos(e)

        return brentq(torque, -1.0, 1.0, xtol=1e-16)

    robot.reset(0.0, held([0.0]), Load(push(-50.0), upright(2e-3, rate=9.0)))
    assert robot.deflection()[0] == pytest.approx(rest(2e-3, -50.0), abs=1e-14)
    if quasistatic:
        robot.step(0.1, held([0.0]), Load(push(200.0), upright(2e-3, rate=0.05)))
        assert robot.deflection()[0] == pytest.approx(rest(7e-3, 200.0), abs=1e-14)


def test_arm_on_a_spring_swings_as_one_with_a_stiffer_gear():
    """Near the horizontal a spring K at 1 m adds K to the gear; 1e-5 rad are linear to 1e-10."""
    stiffer = ElasticRobot(
        pendulum(**WEIGHTLESS, stiffness=GEAR + SPRING, damping=50.0), "linear", tolerance=1e-12
    )
    held_up = ElasticRobot(pendulum(**WEIGHTLESS, damping=50.0), "linear", tolerance=1e-12)
    decay = 50.0 / (2.0 * INERTIA)
    omega = np.sqrt((GEAR + SPRING) / INERTIA - decay**2)
    for robot, spring in ((stiffer, upright(stiffness=0.0)), (held_up, upright())):
        robot.reset(0.0, held([0.0]), Load(push(-0.4), spring))
        start = 0.4 / (GEAR + SPRING)
        for t in np.linspace(0.01, 1.0, 100):
            robot.step(t, held([0.0]), Load(spring=spring))
            swing = np.cos(omega * t) + decay / omega * np.sin(omega * t)
            expected = start * np.exp(-decay * t) * swing
            assert robot.deflection()[0] == pytest.approx(expected, abs=1e-6 * start)
        (mode,) = robot.linearise().modes.frequency
        assert mode == pytest.approx(np.sqrt((GEAR + SPRING) / INERTIA) / (2 * np.pi), rel=1e-8)
        assert robot.compliance()[2, 2] == pytest.approx(1.0 / (GEAR + SPRING), rel=1e-8)


def test_moving_anchor_is_exact_within_a_step():
    """The arm's own equation by another integrator, anchor and force changing every 40 ms."""
    robot = ElasticRobot(pendulum(damping=30.0), "linear", tolerance=1e-12)
    robot.reset(0.0, held([0.0]), Load(spring=upright(stiffness=1e6)))
    state, anchor = np.array([robot.deflection()[0], 0.0]), 0.0
    for k, (rate, stiffness) in enumerate([(0.1, 1e6), (-0.3, 1e6), (0.2, 3e4), (0.0, 0.0)]):
        spring = upright(anchor, rate, stiffness)
        robot.step(0.04 * (k + 1), held([0.0]), Load(push(80.0), spring))

        def motion(t, y, height=anchor, rate=rate, stiffness=stiffness):
            force = 80.0 - 50.0 * 9.81 + stiffness * (height + rate * t + np.sin(y[0]))
            return [y[1], (-force * np.cos(y[0]) - GEAR * y[0] - 30.0 * y[1]) / INERTIA]

        solved = solve_ivp(motion, (0.0, 0.04), state, "DOP853", rtol=1e-13, atol=1e-15)
        state, anchor = solved.y[:, -1], anchor + 0.04 * rate
        assert robot.deflection()[0] == pytest.approx(state[0], abs=1e-11)
        assert robot.velocity()[2] == pytest.approx(-state[1] * np.cos(state[0]), abs=1e-9)


def test_gear_in_its_backlash_rests_against_the_spring():
    """Gravity along the axis leaves the gear free: in its backlash of 2 mrad the tip is at the anchor.

    Beyond, the spring is shared with the flank: k (e - B) = K (anchor - tip), tip = -sin e.
    """
    robot = ElasticRobot(
        pendulum(gravity=(0.0, -9.81, 0.0), backlash=2e-3), "backlash", quasistatic=True
    )
    for weak in (1.0, SPRING, 1e8):
        for height in (-1.9e-3, -1e-5, 3e-8, 1.5e-3):
            robot.reset(0.0, held([0.0]), Load(spring=upright(height, stiffness=weak)))
            assert robot.tcp()[2] == pytest.approx(height, abs=2e-6 / weak + 1e-15)
        robot.reset(0.0, held([0.0]), Load(spring=upright(-5e-3, stiffness=weak)))

        def torque(e, weak=weak):
            return GEAR * (e - 2e-3) - weak * (5e-3 - np.sin(e)) * np.cos(e)

        expected = brentq(torque, 0.0, 0.1, xtol=1e-16)
        assert robot.deflection()[0] == pytest.approx(expected, abs=1e-13)


def test_gear_that_nothing_holds_rests_in_the_middle_of_its_backlash():
    """Weight and spring along the axis: neither support nor force, or rounding, so no flank."""
    robot = ElasticRobot(pendulum(gravity=(0.0, -9.81, 0.0), backlash=1e-3), "backlash")
    along = ContactSpring(np.array([1.0, 0.4, 0.3]), np.zeros(3), np.diag([0.0, 1e8, 0.0]))
    for force in (0.0, 5e-7, -5e-7):
        robot.reset(0.0, held([0.0]), Load(push(force), along))
        assert robot.deflection()[0] == 0.0
    robot.reset(0.0, held([0.0]), Load(push(-1e-3), along))
    assert robot.deflection()[0] == pytest.approx(1e-3 + 1e-7, abs=1e-9)


def test_of_two_rests_the_one_nearer_to_the_anchor_is_taken():
    """An upright arm falls either way in its backlash; 1 N/m does not hold it up, but tells the side."""
    robot = ElasticRobot(pendulum(backlash=2e-3), "backlash")
    for side in (1.0, -1.0):
        for lean in (5e-4, -5e-4):
            anchor = ContactSpring(np.array([side * 1e-2, 0.0, 1.0]), np.zeros(3), np.eye(3))
            robot.reset(0.0, held([-np.pi / 2 + lean]), Load(spring=anchor))
            assert np.sign(robot.deflection()[0]) == side
            assert abs(robot.deflection()[0]) > 2e-3
            assert np.sign(robot.tcp()[0]) == side


# Random robots.


@pytest.mark.parametrize("kind", sorted(TORQUE_CURVES))
def test_equilibria_balance_torques_of_an_independent_model(kind):
    """Newton's and Euler's laws at rest, spring included; what a spring rounds to is left."""
    for seed in range(40):
        robot = make_robot(seed, 1 + seed % 8)
        dynamics, parameters = dynamics_of(robot)
        curve, rng = TORQUE_CURVES[kind].build(parameters), np.random.default_rng(seed)
        q = rng.uniform(-3, 3, dynamics.chain.joint_count)
        acting = random_load(rng, rigid_tcp(dynamics, q))
        x = equilibrium(dynamics, curve, q, acting)
        numbers = Numbers(
            drives=np.array([q, 0 * q, 0 * q]),
            motion=np.array([x, 0 * x, 0 * x]),
            wrench=acting.wrench,
            gravity=parameters.gravity,
            stiffness=parameters.stiffness,
            damping=parameters.damping,
            backlash=parameters.backlash,
            anchor=acting.anchor,
            spring=acting.stiffness[np.triu_indices(3)],
        )
        if len(x):
            torque = -evaluate(robot, numbers).loads.real
            np.testing.assert_allclose(curve.torque(x), torque, rtol=0, atol=2e-6)


@pytest.mark.parametrize("kind", sorted(TORQUE_CURVES))
def test_hanging_gears_rest_in_balance(example, kind):
    """Lined-up postures with hardly loaded gears on springs of every stiffness: none is without rest."""
    dynamics, parameters = dynamics_of(example)
    curve, rng = TORQUE_CURVES[kind].build(parameters), np.random.default_rng(1)
    for _ in range(200 if kind == "backlash" else 40):
        q, wrench = hardly_loaded(rng, 6)
        far = 10.0 ** rng.uniform(-6.0, -1.0)
        acting = replace(random_load(rng, rigid_tcp(dynamics, q), far), wrench=wrench)
        x = equilibrium(dynamics, curve, q, acting)
        torque = dynamics.static_torque(dynamics.chain.theta(q, x), acting)
        np.testing.assert_allclose(curve.torque(x), torque, rtol=0, atol=1.5e-6)


def test_a_stiff_spring_pins_the_tool(example):
    """What is left falls with 1 / K: the robot gives way by 0.1 mm, the spring by its force over K."""
    q = [0.3, -0.4, 0.5, 0.2, 0.6, 0.1]
    robot = ElasticRobot(example, "backlash", quasistatic=True)
    robot.reset(0.0, held(q), Load())
    aim = robot.tcp()[:3] + np.array([1e-4, -5e-5, 8e-5])
    left = []
    for stiffness in (1e8, 1e9, 1e10):
        spring = ContactSpring(aim, np.zeros(3), stiffness * np.eye(3))
        robot.reset(0.0, held(q), Load(push(-300.0), spring))
        left.append(np.linalg.norm(robot.tcp()[:3] - aim))
    assert left[0] < 1e-5
    np.testing.assert_allclose(left[1:], np.array([0.1, 0.01]) * left[0], rtol=5e-2)


@pytest.mark.parametrize("seed", range(3))
def test_motion_on_a_spring_is_that_of_an_independent_engine(seed):
    """Three joints, moving drives and anchor; Newton's and Euler's laws, integrated by DOP853."""
    described = make_robot(seed + 20, 3, backlash=0.0)
    n, rng = len(described.joints), np.random.default_rng(seed)
    robot = ElasticRobot(described, "linear", tolerance=1e-12)
    p, q = robot.parameters, rng.uniform(-1.0, 1.0, (3, n))
    start = base_from_tool(robot.chain, robot._dynamics.data, robot.chain.theta(q[0])).translation
    entries = np.diag(10.0 ** rng.uniform(5.0, 6.5, 3))[np.triu_indices(3)]
    spring = ContactSpring(
        start + 1e-3 * rng.normal(size=3), 0.1 * rng.normal(size=3), symmetric(entries)
    )
    wrench = rng.normal(size=6) * [300, 300, 300, 30, 30, 30]
    drives = HeldCommand(0.0, *q)
    robot.reset(0.0, drives, Load(wrench, spring), undeflected=True)
    robot.step(0.02, drives, Load(wrench, spring))

    def motion(t, y):
        x, v = np.split(y, 2)
        moving = np.array([q[0] + q[1] * t + 0.5 * q[2] * t * t, q[1] + q[2] * t, q[2]])
        numbers = Numbers(
            moving,
            np.array([x, v, 0 * x]),
            wrench,
            p.gravity,
            p.stiffness,
            p.damping,
            p.backlash,
            spring.position + spring.velocity * t,
            entries,
        )
        return np.append(v, acceleration(described, "linear", numbers).real)

    m = robot.chain.elastic_count
    y = solve_ivp(motion, (0.0, 0.02), np.zeros(2 * m), "DOP853", rtol=1e-9, atol=1e-13).y[:, -1]
    assert np.abs(y[:m]).max() > 1e-6
    np.testing.assert_allclose(robot.deflection(), y[:m], rtol=0, atol=1e-10)


# The type, and what is kept.


@pytest.mark.parametrize(
    ("stiffness", "said"),
    [
        (np.diag([1e6, -1.0, 0.0]), r"no eigenvalue below 0, got -1, 0, 1e\+06 N/m"),
        (symmetric(np.array([1.0, 2.0, 0.0, 1.0, 0.0, 0.0])), "got -1, 0, 3 N/m"),
        (np.array([[1.0, 2.0, 0], [0, 5.0, 0], [0, 0, 1.0]]), "expected a symmetric matrix"),
        (np.full((3, 3), np.nan), "expected 3x3 finite numbers"),
        (np.zeros(6), "expected 3x3 finite numbers"),
        (-1e300 * np.eye(3), r"got -1e\+300"),
    ],
)
def test_stiffness_that_is_none_is_refused(stiffness, said):
    with pytest.raises(ParameterError, match=said):
        ContactSpring(np.zeros(3), np.zeros(3), stiffness)


def test_rounding_of_a_stiffness_is_none_of_the_users_business():
    """Eigenvalues of a rank-one matrix may be -1e-10 of its largest, by the digits of a file."""
    axis = np.array([0.6, -0.3, 0.2])
    k = 1e7 * np.outer(axis, axis)
    ContactSpring(np.zeros(3), np.zeros(3), k - 4e-3 * np.eye(3))
    with pytest.raises(ParameterError):
        ContactSpring(np.zeros(3), np.zeros(3), k - 6e-3 * np.eye(3))
