"""The C core against Pinocchio, laws in closed form and the reference solutions of other engines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import reference
from native_core import CURVES, LANES, Core
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
