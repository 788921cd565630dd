"""Statics and dynamics: gradients, closed forms, conservation and invariance, over random robots."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pendulum import dynamics_of, held, pendulum
from random_robots import hardly_loaded, make_robot, robots
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from elastic_robot.body import Body
from elastic_robot.chain import build_chain
from elastic_robot.description import Joint, Tilt
from elastic_robot.errors import ElasticRobotError, EquilibriumError
from elastic_robot.kinematics import base_from_tool, pose_of
from elastic_robot.parameters import Parameters
from elastic_robot.robot import ElasticRobot
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import Load, ToolLoad
from elastic_robot.torque_curves import TORQUE_CURVES

SEEDS = st.integers(0, 10**6)


@given(robots(), SEEDS, st.sampled_from(sorted(TORQUE_CURVES)))
def test_equilibrium_balances_springs_and_loads(robot, seed, curve_name):
    """S(x) = J^T w - g, with J^T w from finite differences of the pose: an independent path."""
    dynamics, parameters = dynamics_of(robot)
    chain, rng = dynamics.chain, np.random.default_rng(seed)
    assume(chain.elastic_count > 0)
    curve = TORQUE_CURVES[curve_name].build(parameters)
    q, wrench = rng.uniform(-3, 3, chain.joint_count), rng.normal(size=6) * 300.0
    x = equilibrium(dynamics, curve, q, ToolLoad(wrench))
    model, data = chain.model, chain.model.createData()
    for k in range(chain.elastic_count):
        step = 1e-6 * np.eye(chain.elastic_count)[k]
        above, below = chain.theta(q, x + step), chain.theta(q, x - step)
        potential = pin.computePotentialEnergy(model, data, above)
        potential -= pin.computePotentialEnergy(model, data, below)
        high, low = base_from_tool(chain, data, above).copy(), base_from_tool(chain, data, below)
        work = wrench[:3] @ (high.translation - low.translation)
        work += wrench[3:] @ pin.log3(high.rotation @ low.rotation.T)
        torque = (work - potential) / 2e-6
        # 1e-6 rad steps of energies of 1e4 J leave 1e-6 N m of rounding.
        assert curve.torque(x)[k] == pytest.approx(torque, abs=1e-4 + 1e-8 * abs(torque))


def test_loaded_pendulum_rests_where_the_closed_form_says():
    """k e = m g l cos(e) for a horizontal arm; positive e turns it down."""
    robot = ElasticRobot(pendulum(), "linear")
    robot.reset(0.0, held([0.0]), Load())
    expected = brentq(lambda e: 1e4 * e - 50 * 9.81 * np.cos(e), 0, 1, xtol=1e-15)
    assert robot.deflection()[0] == pytest.approx(expected, abs=1e-14)


def test_backlash_adds_its_half_width_on_the_loaded_side():
    robot = ElasticRobot(pendulum(backlash=2e-3), "backlash")
    for sign in (1.0, -1.0):
        wrench = np.array([0.0, 0.0, 50 * 9.81 - sign * 400.0, 0.0, 0.0, 0.0])
        robot.reset(0.0, held([0.0]), Load(wrench))
        e = robot.deflection()[0]
        expected = brentq(lambda e, s=sign: 1e4 * (e - s * 2e-3) - s * 400.0 * np.cos(e), -1, 1)
        assert e == pytest.approx(expected, abs=1e-11)


def test_unloaded_gear_rests_in_the_middle_of_its_backlash():
    """Gravity along the axis: no torque; rounding or 1e-7 N sideways must not pick a flank."""
    robot = ElasticRobot(pendulum(gravity=(0.0, -9.81, 0.0), backlash=1e-3), "backlash")
    for force in (0.0, 5e-7, -5e-7):
        robot.reset(0.0, held([0.3]), Load(np.array([0, 0, force, 0, 0, 0.0])))
        assert robot.deflection()[0] == 0.0
    robot.reset(0.0, held([0.0]), Load(np.array([0, 0, -1e-3, 0, 0, 0])))
    assert robot.deflection()[0] == pytest.approx(1e-3 + 1e-7, abs=1e-9)


def test_robot_that_hangs_in_its_backlash_rests_where_the_load_vanishes():
    """The arm hangs down, 0.5 mrad off the vertical, in a backlash of 2 mrad: it finds the vertical."""
    robot = ElasticRobot(pendulum(backlash=2e-3), "backlash")
    robot.reset(0.0, held([np.pi / 2 - 5e-4]), Load())
    assert robot.deflection()[0] == pytest.approx(5e-4, abs=1e-12)


def test_of_two_flanks_the_less_loaded_one_is_taken():
    """An upright arm 0.5 mrad off the vertical falls either way in a backlash of 2 mrad.

    Both flanks are equilibria: m g l sin at -1.5 mrad and at 2.5 mrad; the first carries less.
    """
    robot = ElasticRobot(pendulum(backlash=2e-3), "backlash")
    robot.reset(0.0, held([-np.pi / 2 + 5e-4]), Load())
    e = robot.deflection()[0]
    expected = brentq(
        lambda e: 1e4 * (e + 2e-3) - 50 * 9.81 * np.sin(e + 5e-4), -0.1, 0, xtol=1e-15
    )
    assert e == pytest.approx(expected, abs=1e-11)


@pytest.mark.parametrize("kind", TORQUE_CURVES)
def test_hardly_loaded_gears_rest_in_balance(example, kind):
    """Lined-up postures, in which Newton's method alone sends a gear round the world.

    To what a gear may carry in the middle of its gap, 1e-6 N m, and the rounding of 1e4 N m.
    """
    dynamics, parameters = dynamics_of(example)
    curve, rng = TORQUE_CURVES[kind].build(parameters), np.random.default_rng(1)
    for _ in range(120):
        q, wrench = hardly_loaded(rng, 6)
        x = equilibrium(dynamics, curve, q, ToolLoad(wrench))
        torque = dynamics.static_torque(dynamics.chain.theta(q, x), ToolLoad(wrench))
        np.testing.assert_allclose(curve.torque(x), torque, rtol=0, atol=1e-6)


@given(SEEDS)
def test_equilibrium_has_no_memory(seed):
    """The same drives and wrench give the same bits, whatever came before."""
    robot = ElasticRobot(make_robot(seed, 6), "backlash", quasistatic=True)
    rng = np.random.default_rng(seed)
    q, wrench = rng.uniform(-3, 3, 6), 500.0 * rng.normal(size=6)
    robot.reset(0.0, held(q), Load(wrench))
    first = robot.tcp()
    robot.step(1.0, held(rng.uniform(-3, 3, 6)), Load(500.0 * rng.normal(size=6)))
    robot.step(2.0, held(q), Load(wrench))
    assert np.array_equal(robot.tcp(), first)


def test_buckling_robot_is_an_error():
    robot = ElasticRobot(pendulum(stiffness=1.0), "linear")
    with pytest.raises(EquilibriumError, match="too soft"):
        robot.reset(0.0, held([-np.pi / 2 + 0.1]), Load(np.array([0, 0, -1e6, 0, 0, 0.0])))


def test_compliance_inside_the_backlash_is_that_of_the_flank():
    """Axis 1 under gravity alone carries no torque; its backlash is no infinite compliance."""
    robot = ElasticRobot(pendulum(gravity=(0.0, -9.81, 0.0), backlash=1e-3), "backlash")
    robot.reset(0.0, held([0.0]), Load())
    assert robot.compliance()[2, 2] == pytest.approx(1.0 / 1e4, rel=1e-12)


def test_one_joint_is_the_closed_form_oscillator():
    """Released from 0: x = x0 (1 - exp(-d t)(cos w t + d/w sin w t)) for m l^2 = 50, k = 1e4, c = 50.

    The force is a moment about the joint's axis, so that the equation is linear exactly.
    """
    robot = ElasticRobot(pendulum(gravity=(0.0, 0.0, 0.0), damping=50.0), "linear")
    robot.reset(0.0, held([0.0]), Load(), undeflected=True)
    decay, omega0 = 50.0 / 100.0, np.sqrt(1e4 / 50.0)
    omega = np.sqrt(omega0**2 - decay**2)
    for t in np.linspace(0.01, 2.0, 200):
        robot.step(t, held([0.0]), Load(np.array([0, 0, 0, 0, 10.0, 0.0])))
        swing = np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
        assert robot.deflection()[0] == pytest.approx(1e-3 * (1 - swing), abs=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_energy_of_a_free_undamped_robot_is_conserved(seed):
    """Half a second from rest under gravity, linear springs; relative to the energy that moves."""
    described = make_robot(seed, 4, backlash=0.0)
    bare = tuple(
        replace(j, damping=0.0, tilt=tuple(replace(t, damping=0.0) for t in j.tilt))
        for j in described.joints
    )
    robot = ElasticRobot(replace(described, joints=bare), "linear", tolerance=1e-12)
    q = np.linspace(-1, 1, 4)
    robot.reset(0.0, held(q), Load(), undeflected=True)
    chain, parameters = robot.chain, robot.parameters
    model, data = chain.model, chain.model.createData()

    def energies() -> tuple[float, float, float]:
        state = robot._now()
        theta, rate = chain.theta(q, state.x), chain.theta(0.0 * q, state.v)
        spring = 0.5 * float(parameters.stiffness @ state.x**2)
        kinetic = float(pin.computeKineticEnergy(model, data, theta, rate))
        return kinetic, float(pin.computePotentialEnergy(model, data, theta)), spring

    start, largest, drift = sum(energies()), 0.0, 0.0
    mgl = 9.81 * sum(joint.body.mass for joint in described.joints)  # scale of the energies [J/m]
    for k in range(1, 26):
        robot.step(0.02 * k, held(q), Load())
        kinetic, potential, spring = energies()
        largest = max(largest, kinetic)
        drift = max(drift, abs(kinetic + potential + spring - start))
    # Rounding of potential energies of some mgl joules; nothing else may be lost.
    assert drift < 1e-9 * largest + 1e-12 * mgl


@given(SEEDS)
@settings(max_examples=12)
def test_rotated_base_with_rotated_gravity_gives_the_rotated_motion(seed):
    described = make_robot(seed, 5)
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed)
    # A rigid joint that the turned robot has in front stands for the rotation of its base.
    vector = turn.as_rotvec()
    angle = float(np.linalg.norm(vector))
    weightless = Body(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    axis = vector / angle
    base = Joint((0.0, 0.0, 0.0), tuple(axis.tolist()), weightless)
    turned = replace(
        described,
        joints=(base, *described.joints),
        gravity=tuple(turn.apply(described.gravity).tolist()),
    )
    q, wrench = rng.uniform(-2, 2, 5), 500.0 * rng.normal(size=6)
    one, two = ElasticRobot(described), ElasticRobot(turned)
    turned_wrench = np.append(turn.apply(wrench[:3]), turn.apply(wrench[3:]))
    one.reset(0.0, held(q), Load())
    two.reset(0.0, held([angle, *q]), Load())
    for end in (0.004, 0.02):
        one.step(end, held(q), Load(wrench))
        two.step(end, held([angle, *q]), Load(turned_wrench))
    np.testing.assert_allclose(two.tcp()[:3], turn.apply(one.tcp()[:3]), rtol=0, atol=1e-8)


def test_rigid_robot_has_no_elastic_coordinates_and_no_deviation():
    rigid = ElasticRobot(pendulum(stiffness=None))
    rigid.reset(0.0, held([0.5]), Load(np.full(6, 100.0)))
    rigid.step(0.1, held([0.5]), Load(np.full(6, 100.0)))
    assert rigid.deflection().size == 0
    assert np.array_equal(rigid.tcp(), rigid.rigid())
    assert np.array_equal(rigid.compliance(), np.zeros((6, 6)))


def test_massless_tip_is_refused():
    joint = replace(
        pendulum().joints[0],
        body=Body(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        tilt=(Tilt((0.0, 0.0, 1.0), 1e6, 0.0),),
    )
    with pytest.raises(ElasticRobotError, match="expected an inertia of its own to move, got none"):
        build_chain(replace(pendulum(), joints=(joint,)))


@given(SEEDS)
def test_pose_has_a_unit_quaternion_with_positive_scalar(seed):
    pin.seed(seed)
    placement = pin.SE3.Random()
    pose = pose_of(placement)
    assert pose[6] >= 0.0
    assert np.linalg.norm(pose[3:]) == pytest.approx(1.0, abs=1e-12)
    turned = Rotation.from_quat(pose[3:]).as_matrix()
    np.testing.assert_allclose(turned, placement.rotation, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", TORQUE_CURVES)
def test_torque_curves_agree_with_their_verbs(name):
    stiffness, backlash = np.array([1e4, 2e5, 3e6]), np.array([1e-3, 0.0, 2e-4])
    parameters = Parameters(np.zeros(3), stiffness, np.zeros(3), backlash, np.zeros(3), (None,) * 3)
    curve = TORQUE_CURVES[name].build(parameters)
    x = np.array([-3e-3, 1e-3, 2.7e-4])
    torque = curve.torque(x)
    np.testing.assert_allclose(curve.torque(-x), -torque, rtol=1e-15)
    np.testing.assert_allclose(curve.deflection(torque), x, rtol=1e-12)
    slope = (curve.torque(x + 1e-8) - curve.torque(x - 1e-8)) / 2e-8
    np.testing.assert_allclose(curve.slope(x), slope, rtol=1e-6)
    branch = curve.in_region(curve.region(x))
    np.testing.assert_allclose(branch.torque(x), torque, rtol=1e-12)
