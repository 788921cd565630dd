"""The C core against Pinocchio, closed forms and other engines; the order of its stepper alone."""

from dataclasses import replace
from math import comb

import numpy as np
import pytest
from conftest import reference
from native_core import CURVES, LANES, Core, library, with_settings
from pendulum import held, pendulum
from places import REFERENCE
from random_robots import make_robot
from touching import entries, onto

from elastic_robot.chain import build_chain
from elastic_robot.dynamics import Dynamics
from elastic_robot.kinematics import base_from_tool, pose_of, tcp_jacobian
from elastic_robot.parameters import Parameters
from elastic_robot.plane_contact import PlaneContact
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load, ToolLoad
from elastic_robot.torque_curves import TORQUE_CURVES

NO_LOAD = np.zeros(6)
REFERENCE_CURVES = {"nobacklash": "linear", "backlash": "backlash"}
# Gauss collocation of four stages: nodes, their Lagrange polynomials, and the integrals of these.
NODES = 0.5 + 0.5 * np.polynomial.legendre.leggauss(4)[0]
LAGRANGE = [
    np.polynomial.Polynomial.fromroots(others) / np.prod(node - others)
    for node, others in ((node, np.delete(NODES, k)) for k, node in enumerate(NODES))
]
A1 = np.array([basis.integ(1)(NODES) for basis in LAGRANGE]).T
STIFFNESS, INERTIA = 1e4, 50.0  # of `pendulum` [N m/rad, kg m^2]
ANYTHING = 1e9  # a tolerance that rejects no step [m]


def _assert_relative(found, expected, tolerance):
    """Largest difference relative to the largest entry."""
    scale = np.abs(expected).max(initial=0.0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * scale)


@pytest.mark.parametrize("plain", [True, False])
def test_a_thousand_random_chains_agree_with_pinocchio(plain):
    """1 to 8 joints, random axes: loads, mass matrix, Jacobian, pose and static torque to 1e-12.

    Angles near the reference take the series for sines, the others libm.
    """
    rng = np.random.default_rng(0)
    for seed in range(500):
        robot = make_robot(seed + 500 * plain, 1 + seed % 8)
        core, chain = Core(robot, plain), build_chain(robot)
        dynamics = Dynamics(chain, np.array(robot.gravity))
        angles, m = chain.model.nv, chain.elastic_count
        spread = 0.09 if seed % 3 else 3.0
        theta = rng.uniform(-3.0, 3.0, angles) + rng.uniform(-spread, spread, (LANES, angles))
        reference_angles = theta[0].copy()
        rate, acceleration = rng.normal(size=(2, LANES, angles))
        wrench = rng.normal(size=6) * [1e3, 1e3, 1e3, 1e2, 1e2, 1e2] * bool(seed % 5)
        loaded = wrench if wrench.any() else None
        expected = dynamics.loads(theta, rate, acceleration, ToolLoad(wrench))
        found = core.loads(reference_angles, theta, rate, acceleration, loaded, m)
        _assert_relative(found, expected, 1e-12)
        found = core.chain(theta[0].copy(), wrench, m)
        pose = pose_of(base_from_tool(chain, dynamics.data, theta[0]))
        np.testing.assert_allclose(found["pose"], pose, rtol=0, atol=1e-12)
        _assert_relative(found["jacobian"], tcp_jacobian(chain, dynamics.data, theta[0]), 1e-12)
        _assert_relative(found["mass"], dynamics.mass_matrix(theta[0]), 1e-12)
        _assert_relative(found["torque"], dynamics.static_torque(theta[0], ToolLoad(wrench)), 1e-12)
        gradient = dynamics.static_torque_gradient(theta[0], ToolLoad(wrench))
        _assert_relative(found["gradient"], gradient, 1e-11)


TABLE = tuple((0.5e-4 * k, 40.0 * np.sinh(0.5 * k)) for k in range(-4, 6))


@pytest.mark.parametrize("kind", CURVES)
def test_curves_agree_with_python(example, kind):
    """Torque, slope and inverse on every branch, with a joint's own table among them."""
    joints = (replace(example.joints[0], torque_table=TABLE), *example.joints[1:])
    robot = replace(example, joints=joints)
    core, curve = Core(robot), TORQUE_CURVES[kind].build(Parameters.of(robot))
    x = np.random.default_rng(1).uniform(-6e-4, 6e-4, (200, 11))
    torque, slope, deflection = (values.T for values in core.curve(kind, x.T.copy()))
    np.testing.assert_allclose(torque, curve.torque(x), rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(slope, curve.slope(x), rtol=1e-11, atol=1e-4)
    expected = [curve.deflection(row) for row in curve.torque(x)]
    np.testing.assert_allclose(deflection, expected, rtol=1e-9, atol=1e-13)
    for side in (-1, 0, 1):
        region = np.where(np.isfinite(curve.half_width), side, 1)
        branch = curve.in_region(region)
        torque = core.curve(kind, x.T.copy(), side)[0].T
        switching = np.isfinite(curve.half_width)
        expected = branch.torque(x)
        np.testing.assert_allclose(
            torque[:, switching], expected[:, switching], rtol=1e-12, atol=1e-9
        )


def test_the_gauss_coefficients_are_integrals_of_lagrange_polynomials():
    """Node by node, the Bernstein form of the quintic, and the eigenvectors of A1 as an identity."""

    def constant(name, *shape):
        values = (np.ctypeslib.ctypes.c_double * int(np.prod(shape))).in_dll(library(), name)
        return np.array(values).reshape(shape)

    for name, expected in (
        ("node", NODES),
        ("once", A1.T),
        ("twice", (A1 @ A1).T),
        ("end_rate", np.array([basis.integ(1)(1.0) for basis in LAGRANGE])),
        ("end_position", np.array([basis.integ(2)(1.0) for basis in LAGRANGE])),
        ("end_acceleration", np.array([basis(1.0) for basis in LAGRANGE])),
    ):
        found = constant(f"er_gauss_{name}", *expected.shape)
        np.testing.assert_allclose(found, expected, rtol=0, atol=2e-15)
    # Position over a step from x_0, h v_0 and h^2 a_j: 1, s, and the second integrals.
    quintic = [np.polynomial.Polynomial([1.0]), np.polynomial.Polynomial([0.0, 1.0])]
    quintic += [basis.integ(2) for basis in LAGRANGE]
    s = np.linspace(0.0, 1.0, 6)
    bernstein = np.array([comb(5, k) * s**k * (1.0 - s) ** (5 - k) for k in range(6)]).T
    values = np.array([polynomial(s) for polynomial in quintic]).T
    found = constant("er_gauss_bernstein", 6, 6)
    np.testing.assert_allclose(bernstein @ found, values, rtol=0, atol=2e-15)
    nodes = np.concatenate([[0.0], NODES, [1.0]])
    controls = constant("er_gauss_bernstein_from_value", 6, 6)
    basis = [comb(5, k) * nodes**k * (1.0 - nodes) ** (5 - k) for k in range(6)]
    np.testing.assert_allclose(controls @ np.transpose(basis), np.eye(6), rtol=0, atol=2e-14)
    eigen = constant("er_gauss_eigen_re", 2) + 1j * constant("er_gauss_eigen_im", 2)
    to, back = constant("er_gauss_to_pairs", 4, 4).T, constant("er_gauss_from_pairs", 4, 4) / 2.0
    to, back = to[:2] + 1j * to[2:], back[:2] - 1j * back[2:]
    rebuilt = sum(2.0 * (eigen[p] * np.outer(back[p], to[p])).real for p in range(2))
    np.testing.assert_allclose(rebuilt, A1, rtol=0, atol=1e-14)
    np.testing.assert_allclose(to @ back.T, np.eye(2), rtol=0, atol=1e-14)
    powers = constant("er_gauss_power_from_stage", 4, 4)
    np.testing.assert_allclose(
        NODES[:, None] ** np.arange(4) @ powers, np.eye(4), rtol=0, atol=1e-14
    )


@pytest.mark.parametrize("plain", [True, False])
@pytest.mark.parametrize("m", [1, 2, 3, 11, 12, 36])
def test_a_pass_of_newtons_method_solves_the_collocation_equations(example, m, plain):
    """Linear ones, of any size: the stages' equations written out, (4 m x 4 m) real."""
    random, h = np.random.default_rng(m), 0.004
    root = random.normal(size=(m, m))
    mass = root @ root.T / m + np.eye(m)
    damping, stiffness = (
        np.diag(random.uniform(0.0, 300.0, m)),
        np.diag(random.uniform(0.0, 1e6, m)),
    )
    eigenvalues = np.linalg.eigvals(A1)
    eigenvalues = sorted(eigenvalues[eigenvalues.imag > 0.0], key=lambda value: value.imag)
    matrices = np.array([mass + h * u * damping + (h * u) ** 2 * stiffness for u in eigenvalues])
    residual = random.normal(size=(4, m))
    whole = sum(
        np.kron(stages, part)
        for stages, part in (
            (np.eye(4), mass),
            (h * A1, damping),
            (h * h * A1 @ A1, stiffness),
        )
    )
    found, length = Core(example, plain).newton(matrices, residual)
    expected = -np.linalg.solve(whole, residual.ravel()).reshape(4, m)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * m * np.abs(expected).max())
    np.testing.assert_allclose(length, np.linalg.norm(expected), rtol=1e-13 * m)


@pytest.mark.parametrize("plain", [True, False])
def test_a_singular_matrix_is_told(example, plain):
    """Its last pivot is exactly zero."""
    singular = np.array([np.eye(3), np.ones((3, 3)) + np.diag([0.0, 1.0, 0.0])]) + 0j
    _, length = Core(example, plain).newton(singular, np.ones((4, 3)))
    assert np.isnan(length)


@pytest.mark.parametrize("plain", [True, False])
@pytest.mark.parametrize(("curve", "limit"), [("nobacklash", 1e-8), ("backlash", 1e-6)])
def test_whole_iso_path_at_default_settings(example, curve, limit, plain):
    expected, core = reference(f"d_iso_{curve}_10ms"), Core(example, plain)
    path = REFERENCE / "iso_path_joints.npz"
    core.reset(REFERENCE_CURVES[curve], 0.0, np.zeros(6), NO_LOAD, path=path)
    rows = core.run(expected[:, 0].copy(), 11)
    assert np.abs(rows[:, :3] - expected[:, 1:4]).max() < limit


def test_error_falls_with_the_tolerance(example):
    """12 s with backlash: over four decades of the tolerance the error falls by three at least."""
    expected = reference("d_iso_backlash_10ms")[:1201]
    errors = []
    for tolerance in (1e-4, 1e-6, 1e-8):
        core = Core(example)
        path = REFERENCE / "iso_path_joints.npz"
        core.reset("backlash", 0.0, np.zeros(6), NO_LOAD, path=path, tolerance=tolerance)
        rows = core.run(expected[:, 0].copy(), 11)
        errors.append(np.abs(rows[:, :3] - expected[:, 1:4]).max())
        assert errors[-1] < tolerance
    assert errors[0] > 1e3 * errors[2]


def fixed(robot, step: float) -> Core:
    """Steps of one length [s], solved exactly."""
    return with_settings(robot, longest_step=step, first_step=step, iteration=1e-22)


def about_y(moment: float) -> np.ndarray:
    return np.array([0.0, 0.0, 0.0, 0.0, moment, 0.0])


def test_order_is_eight_at_the_steps_end():
    """Pressed, damped and rubbed by a plane that moves: halved steps leave nearly 1/256 of the error."""
    plane, ends = PlaneContact(1e5, 1.0, 0.02, 0.3, 0.5), []
    for steps in (4, 8, 16, 128):
        core = fixed(pendulum(damping=20.0), 0.1 / steps)
        core.reset("linear", 0.0, [0.0], entries(onto(plane, (0, 0, -0.03))), tolerance=ANYTHING)
        core.step(0.1, [0.0], entries(onto(plane, (0, 0, -0.03), (0.1, 0.0, 0.05))))
        ends.append(core.outputs(1)["x"][0])
        assert core.contact()[0][2] > 0.0
    errors = np.abs(np.array(ends[:-1]) - ends[-1])
    assert errors[0] > 1e4 * errors[2] > 1e-12
    assert np.log2(errors[0] / errors[1]) > 7.0


@pytest.mark.parametrize("omega_h", [0.3, 3.0, 10.0, 1e3])
def test_a_spring_of_any_stiffness_keeps_its_energy(omega_h):
    """An arm let go swings on in ten steps of 20 ms, each of omega h radians, and loses nothing."""
    stiffness = INERTIA * (omega_h / 0.02) ** 2
    core = fixed(pendulum(gravity=(0.0, 0.0, 0.0), stiffness=stiffness), 0.02)
    core.reset("linear", 0.0, [0.0], about_y(1e-5 * stiffness), tolerance=ANYTHING)
    for k in range(10):
        core.step(0.02 * (k + 1), [0.0], about_y(0.0))
        out = core.outputs(1)
        x, v = out["x"][0], out["velocity"][2]
        assert np.hypot(x, v * 0.02 / omega_h) == pytest.approx(1e-5, rel=1e-8)


def test_flight_through_the_backlash_and_bounces_follow_the_closed_form():
    """Free flight over the backlash 2 B, half a sine on each flank, from rest on one of them."""
    backlash, wound = 2e-3, 1e-2
    omega = np.sqrt(STIFFNESS / INERTIA)
    speed, bounce = omega * wound, np.pi / omega
    flight = 2.0 * backlash / speed
    core = Core(pendulum(gravity=(0.0, 0.0, 0.0), backlash=backlash))
    core.reset("backlash", 0.0, [0.0], about_y(STIFFNESS * wound), tolerance=1e-9)
    assert core.outputs(1)["x"][0] == pytest.approx(backlash + wound, abs=1e-12)
    for cycles in (0, 1, 5):
        core.step(0.5 * (bounce + flight) + 2.0 * cycles * (bounce + flight), [0.0], about_y(0.0))
        out = core.outputs(1)
        assert out["x"][0] == pytest.approx(0.0, abs=1e-8)
        assert out["velocity"][2] == pytest.approx(speed, abs=1e-7)


def test_a_grazing_touch_is_not_stepped_over():
    """A flight that is braked and reaches the other flank by 10 urad for a moment, in one call."""
    backlash, braking, beyond = 1e-3, 50.0, 1e-5
    left = (
        2.0 * braking / INERTIA * (2.0 * backlash + beyond)
    )  # speed squared where the flank is left
    amplitude = np.sqrt(left * INERTIA / STIFFNESS + (braking / STIFFNESS) ** 2)
    robot = pendulum(gravity=(0.0, 0.0, 0.0), backlash=backlash)
    start, push = (about_y(-STIFFNESS * amplitude - braking), about_y(-braking))
    core, python = Core(robot), ElasticRobot(robot, tolerance=1e-9)
    core.reset("backlash", 0.0, [0.0], start, tolerance=1e-9)
    python.reset(0.0, held([0.0]), Load(start))
    core.step(0.25, [0.0], push)
    python.step(0.25, held([0.0]), Load(push))
    assert core.outputs(1)["x"][0] == pytest.approx(python.deflection()[0], abs=1e-10)


@pytest.mark.parametrize("time", [0.0, 100.0])
@pytest.mark.parametrize("step", [1e-11, 1e-14])
def test_a_robot_moves_in_steps_of_any_length(step, time):
    """Newton's law over a thousand steps of a free arm; a step of usual length goes on from there."""
    core, moment = Core(pendulum(gravity=(0.0, 0.0, 0.0), stiffness=1.0)), 1e4
    core.reset("linear", time, [0.0], about_y(0.0), tolerance=1e-6)
    for k in range(1, 1001):
        core.step(k * step, [0.0], about_y(moment))
    rate = core.outputs(1)["velocity"][4]
    assert rate == pytest.approx(moment / INERTIA * 1000 * step, rel=1e-9)
    core.step(1e-3, [0.0], about_y(moment))
    assert core.outputs(1)["velocity"][4] == pytest.approx(moment / INERTIA * 1e-3, rel=1e-6)
