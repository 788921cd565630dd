"""The C core against Pinocchio, laws in closed form and the reference solutions of other engines."""

from __future__ import annotations

from dataclasses import replace
from math import comb

import numpy as np
import pytest
from conftest import reference
from native_core import CURVES, LANES, Core, library
from places import REFERENCE
from random_robots import make_robot

from elastic_robot.chain import build_chain
from elastic_robot.dynamics import Dynamics
from elastic_robot.kinematics import base_from_tool, pose_of, tcp_jacobian
from elastic_robot.parameters import Parameters
from elastic_robot.tool_load import ToolLoad
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
