"""Where a motion from rest begins: tool on its pose, tilts in balance, idle gears idle."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.files.robot_file import load_robot, shipped_robots
from coupling.inverse.link_model import LinkModel
from coupling.inverse.links import equilibrium_angles


def test_a_symmetric_robot_stands_symmetric_with_its_tool_on_the_pose():
    """Axes 1 and 4 stay at zero to rounding, so their gears carry less than the neutral torque."""
    model = LinkModel(load_robot(shipped_robots()["icme2008"]))
    q = np.array([0.0, 0.24, 0.63, 0.0, -0.87, 0.0])
    (position,), (axes,) = model.placement(model.chain.theta(q[None]))
    rotation, load = Rotation.from_matrix(axes), np.array([0.0, 0, -300.0, 0, 0, 0])
    theta = equilibrium_angles(model, q, position, rotation, load)[None]
    rest = np.zeros_like(theta)
    state = model.state(theta, rest, rest, load[None])
    np.testing.assert_allclose(state.position[0], position, atol=1e-14)
    np.testing.assert_allclose(state.rotation[0], axes, atol=1e-13)
    balance = state.load[0, model.tilts] + model.tilt_stiffness * theta[0, model.tilts]
    assert np.abs(balance).max() < 1e-7
    gears = np.abs(state.load[0, model.gears])
    assert max(gears[0], gears[3]) < 1e-10
    assert np.abs(theta[0, model.tilts]).max() > 1e-5
