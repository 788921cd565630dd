"""Kinematic errors of gears, balancers of joints and motors in the readable model."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from complex_robot import residual
from derivative_errors import (
    Case,
    engaged,
    residual_errors,
    rest,
    state_space_errors,
    static_errors,
)
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pendulum import held, pendulum
from random_robots import driven, limited, make_robot, robots, with_gear_parts
from scipy.integrate import quad

from elastic_robot.balancers import BalancerCurve
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot
from elastic_robot.drive import Drive
from elastic_robot.errors import ParameterError
from elastic_robot.gear_parts import KinematicError
from elastic_robot.residual import residual as model_residual
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.torque_curves import TORQUE_CURVES
from elastic_robot.trajectory import HeldCommand

SEEDS = st.integers(0, 10**6)
CURVES = st.sampled_from(sorted(TORQUE_CURVES))
LINK = Body(mass=20.0, com=(0.5, 0.0, 0.0), inertia=(0.1, 2.0, 2.0))
DRIVE = Drive(
    5.0, position_gain=20.0, rate_gain=500.0, friction=20.0, viscous=3.0, load_friction=0.1
)
STIFFNESS, DAMPING, INERTIA = 1e5, 200.0, 50.0  # [N m/rad, N m s/rad, kg m^2] of the pendulum


def joint_at(q: float, rate: float = 0.0, acceleration: float = 0.0) -> HeldCommand:
    return HeldCommand(0.0, np.array([q]), np.array([rate]), np.array([acceleration]))


def arm(**parts: object) -> Robot:
    """One joint about y with a link along x under gravity along -z."""
    joint = Joint((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), LINK, stiffness=1e5, damping=300.0)
    return Robot("arm", (replace(joint, **parts),), tcp_position=(1.0, 0.0, 0.0))


@given(robots(), SEEDS, CURVES)
def test_residual_is_that_of_newton_and_euler(robot, seed, curve):
    case = Case(with_gear_parts(robot, seed), curve, seed)
    expected = residual(case.robot, curve, case.numbers).real
    scale = 1.0 + np.abs(expected).max(initial=0.0)
    np.testing.assert_allclose(model_residual(*case.model()), expected, rtol=0, atol=1e-11 * scale)


@given(robots(), SEEDS, CURVES)
@settings(max_examples=12)
def test_derivatives_are_those_of_complex_steps(robot, seed, curve):
    """Of the residual, of the state space in motion and of the equilibrium, by the motors."""
    case = Case(with_gear_parts(robot, seed), curve, seed)
    assert [item for item in residual_errors(case) if item[1] > 1e-12] == []
    x = rest(case)
    assume(engaged(case, x))
    assert [item for item in static_errors(case, x) if item[1] > 1e-10] == []
    assume(case.chain.elastic_count > 0)
    assert [item for item in state_space_errors(case) if item[1] > 1e-8] == []


def test_a_balancer_that_carries_the_link_leaves_nothing_to_the_gear():
    """tau_b = -m g l cos(phi), dense points; a constant one besides turns the link by tau / k."""
    angle = np.linspace(-1.5, 1.5, 200)
    weight = -20.0 * 9.81 * 0.5 * np.cos(angle)  # about y, which turns x towards -z
    for more in (0.0, 40.0):
        table = tuple(zip(angle.tolist(), (weight + more).tolist(), strict=True))
        robot = ElasticRobot(arm(balancer=table), "linear")
        for q in (-0.8, 0.3):
            robot.reset(0.0, joint_at(q), Load())
            assert robot.deflection()[0] == pytest.approx(more / 1e5, abs=2e-9)
            assert robot.gear_torque()[0] == pytest.approx(-more, abs=2e-4)


def test_beyond_its_points_a_balancer_goes_on_straight():
    """At both ends value and slope are those of the spline there, whose second derivative is zero."""
    table = ((-0.5, 200.0), (0.1, -50.0), (0.4, 30.0), (0.9, -300.0))
    curve = BalancerCurve.through(table)
    for end, beyond in ((-0.5, -3.0), (0.9, 2.5)):
        near = np.array([end - 1e-5, end, end + 1e-5])
        value, slope = curve.torque(near), curve.slope(near)
        assert np.diff(value) / 1e-5 == pytest.approx(slope[1], rel=1e-4)
        far = value[1] + slope[1] * (beyond - end)
        assert curve.torque(np.array(beyond)) == pytest.approx(far, rel=1e-13)


def test_the_link_follows_the_gears_output():
    """Without load the link is at q + eps(q), the rigid robot at q, the motor's angle q."""
    errors = (KinematicError(1e-3, 100.0, 0.3), KinematicError(2e-3, 1.0))
    weightless = replace(arm(kinematic_error=errors), gravity=(0.0, 0.0, 0.0))
    robot = ElasticRobot(weightless, "linear")
    for q in (0.0, 0.4, -1.2):
        robot.reset(0.0, joint_at(q), Load())
        u = q + 1e-3 * np.sin(100.0 * q + 0.3) + 2e-3 * np.sin(q)
        np.testing.assert_allclose(robot.tcp()[:3], [np.cos(u), 0, -np.sin(u)], atol=1e-15)
        np.testing.assert_allclose(robot.rigid()[:3], [np.cos(q), 0, -np.sin(q)], atol=1e-15)
        assert robot.deflection()[0] == 0.0
        assert robot.motor_angle()[0] == q


def test_a_kinematic_error_shakes_the_link_as_a_force_on_its_base_would():
    """At a steady rate v the wind-up swings with a n^2 v^2 |1 / (w0^2 - w^2 + 2 i D w0 w)|, w = n v."""
    a, n, rate, inertia = 1e-5, 40.0, 0.5, 2.0 + 20.0 * 0.5**2
    shaken = replace(arm(kinematic_error=(KinematicError(a, n),)), gravity=(0.0, 0.0, 0.0))
    robot = ElasticRobot(shaken, "linear", tolerance=1e-10)
    robot.reset(0.0, joint_at(0.0, rate), Load())
    w, found, step = n * rate, [], 1e-3
    for k in range(1, 751):
        robot.step(k * step, joint_at(0.0, rate), Load())
        if k > 500:
            found.append(robot.deflection()[0])
    expected = a * w**2 / np.abs(1e5 / inertia - w**2 + 300.0j / inertia * w)
    assert np.abs(found).max() == pytest.approx(expected, rel=2e-3)


def test_a_motor_feels_its_gear_by_the_slope_and_rubs_with_its_load():
    """tau = J q'' + T (1 + eps') + (F + mu |T|) sign(q') + b q'; at rest, quasi-static, T (1 + eps')."""
    q, rate, acceleration = 0.2, 0.4, 3.0
    described = arm(kinematic_error=(KinematicError(1e-3, 50.0, 0.1),), drive=DRIVE)
    rise = 1.0 + 0.05 * np.cos(50.0 * q + 0.1)
    for quasistatic in (False, True):
        robot = ElasticRobot(described, "linear", quasistatic)
        robot.reset(0.0, joint_at(q, rate, acceleration), Load())
        carried = float(robot.gear_torque()[0])
        rubs = 20.0 + 0.1 * abs(carried) + 3.0 * rate
        expected = carried * rise + (0.0 if quasistatic else 5.0 * acceleration + rubs)
        assert abs(carried) > 50.0
        assert robot.motor_torque()[0] == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("seed", [0, 3])
def test_energy_of_an_undamped_robot_with_balancers_is_conserved(seed):
    """The balancers' potential is minus the integral of their torque, by quadrature."""
    described = with_gear_parts(make_robot(seed, 4, backlash=0.0), seed)
    bare = tuple(
        replace(j, damping=0.0, tilt=tuple(replace(t, damping=0.0) for t in j.tilt))
        for j in described.joints
    )
    robot = ElasticRobot(replace(described, joints=bare), "linear", tolerance=1e-12)
    q = np.linspace(-1, 1, 4)
    rest_there = HeldCommand(0.0, q, 0.0 * q, 0.0 * q)
    robot.reset(0.0, rest_there, Load(), undeflected=True)
    chain, model, data = robot.chain, robot.chain.model, robot.chain.model.createData()
    u = chain.kinematic_errors.at_output(np.stack([q, 0.0 * q, 0.0 * q]))[0]
    assert len(chain.balancers.curves) > 0
    balanced = list(zip(chain.balancers.place, chain.balancers.curves, strict=True))
    first = chain.theta(u)

    def energies() -> tuple[float, float]:
        state = robot._now()
        theta, moving = chain.theta(u, state.x), chain.theta(0.0 * u, state.v)
        stored = 0.5 * float(robot.parameters.stiffness @ state.x**2)
        stored += float(pin.computePotentialEnergy(model, data, theta))
        for place, curve in balanced:
            stored -= quad(curve.torque, first[place], theta[place], epsabs=1e-12)[0]
        return float(pin.computeKineticEnergy(model, data, theta, moving)), stored

    start, largest, drift = sum(energies()), 0.0, 0.0
    mgl = 9.81 * sum(joint.body.mass for joint in described.joints)
    for k in range(1, 16):
        robot.step(0.02 * k, rest_there, Load())
        kinetic, stored = energies()
        largest, drift = max(largest, kinetic), max(drift, abs(kinetic + stored - start))
    assert drift < 1e-9 * largest + 1e-12 * mgl


def test_a_balancer_that_drives_its_link_away_is_refused():
    """tau_b = 2e5 phi against k = 1e5."""
    table = tuple((a, 2e5 * a) for a in (-1.0, 0.0, 1.0))
    with pytest.raises(ValueError, match=r"less than the gear's 100000 N m/rad, .* got 200000"):
        arm(balancer=table)
    arm(balancer=tuple((a, -t) for a, t in table))


def tiny_steps(drive: Drive, jump: float, end: float, count: int) -> np.ndarray:
    """Link's angle, motor's, both rates and z by RK4, the integral's waiting decided step by step."""
    limit = drive.torque_limit

    def rates(y: np.ndarray, waits: bool) -> np.ndarray:
        link, q, link_rate, rate, z = y
        wanted = drive.position_gain * (jump - q) - rate
        torque = min(max(drive.rate_gain * wanted + z, -limit), limit)
        gear = STIFFNESS * (link - q) + DAMPING * (link_rate - rate)
        growth = 0.0 if waits else drive.integral_gain * wanted
        return np.array([link_rate, rate, -gear / INERTIA, (torque + gear) / drive.inertia, growth])

    y, h = np.zeros(5), end / count
    for _ in range(count):
        wanted = drive.position_gain * (jump - y[1]) - y[3]
        asked = drive.rate_gain * wanted + y[4]
        waits = abs(asked) > limit and asked * wanted > 0.0
        a = rates(y, waits)
        b = rates(y + 0.5 * h * a, waits)
        c = rates(y + 0.5 * h * b, waits)
        y = y + h / 6.0 * (a + 2.0 * b + 2.0 * c + rates(y + h * c, waits))
    return y


def test_a_servo_slides_along_its_limit_as_tiny_steps_do():
    """At its limit, along it while z grows as much as keeps it there, below: to 5e-5 of the motion."""
    drive = Drive(20.0, 20.0, 4e3, 1e6, torque_limit=200.0)
    arm = pendulum(gravity=(0.0, 0.0, 0.0), stiffness=STIFFNESS, damping=DAMPING, drive=drive)
    model, jump, modes = ElasticRobot(arm, "linear", tolerance=1e-10, drive="servo"), 0.01, []
    model.reset(0.0, held([0.0]), Load())
    for k in range(60):
        model.step((k + 1) * 1e-3, held([jump]), Load())
        modes.append(int(model._motors.modes(model._instant())[0]))
    assert set(modes) == {0, 1, 2}
    motor = np.concatenate([model.motor_angle(), model.motor_rate(), model.servo_integral()])
    _, q, _, rate, z = tiny_steps(drive, jump, 0.06, 40009)
    apart = np.abs(np.array([q, rate, z]) - motor)
    assert np.all(apart < [5e-7, 5e-5, 0.5]), apart


@pytest.mark.parametrize(("step", "pieces"), [(3, 40), (19, 40)])
def test_what_falls_through_zero_beside_another_edge_is_seen(step, pieces):
    """A servo keeps its torque at the limit while gears pass their backlash: once, and in pieces."""
    robot = limited(driven(make_robot(11, 4), np.random.default_rng(11)), 60.0)
    robot, ends = replace(robot, gravity=(0.0, 0.0, 0.0)), []
    for last in (1, pieces):
        model, time = ElasticRobot(robot, "backlash", tolerance=1e-10, drive="servo"), 0.0
        model.reset(0.0, held(np.zeros(4)), Load())
        for k in range(step):
            load = Load(np.array([np.sin(0.7 * k), 0.0, np.cos(0.3 * k), 0.0, 0.0, 0.0]) * 200.0)
            for _ in range(last if k == step - 1 else 1):
                time += 4e-3 / (last if k == step - 1 else 1)
                model.step(time, held(np.full(4, 2e-3)), load)
        ends.append(np.concatenate([model.deflection(), model.motor_angle()]))
    np.testing.assert_allclose(*ends, rtol=0, atol=1e-11)


def test_what_knows_ideal_drives_alone_says_so():
    robot = driven(make_robot(5, 3), np.random.default_rng(5))
    model = ElasticRobot(robot, "linear", drive="servo")
    model.reset(0.0, held(np.zeros(3)), Load())
    with pytest.raises(ParameterError, match="linearise: expected ideal drives"):
        model.linearise()
    with pytest.raises(ParameterError, match="expected one of ideal, servo, torque, got 'fast'"):
        ElasticRobot(robot, drive="fast")
