"""The shipped KUKA KR 300: its source's Denavit-Hartenberg model, and its units by a recording.

The model here is that of the source, in its own convention and frames, and shares no code with the
project.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from coupling.files.controller_axes import controller_axes
from coupling.files.robot_file import load_robot, shipped_robots
from elastic_robot.chain import build_chain
from elastic_robot.dynamics import Dynamics
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load, ToolLoad
from elastic_robot.trajectory import HeldCommand

FILE = shipped_robots()["kuka_kr300"]
ROBOT = load_robot(FILE)

# Standard Denavit-Hartenberg parameters, the base turned by 180 deg about x; links' masses [kg], centres
# [mm] and inertias about them [1e-6 kg m2], xx, yy, zz, xy, yz, xz, in the frame at the link's end.
D = [-0.675, -0.189, 0.189, -1.0, 0.0, -0.24]
A = [0.350, 1.15, 0.041, 0.0, 0.0, 0.0]
ALPHA = np.array([1, 0, -1, 1, -1, 2]) * np.pi / 2
OFFSET = [0.0, 0.0, np.pi / 2, 0.0, 0.0, 0.0]
MASS = [395.40, 339.12, 105.21, 35.80, 31.46, 17.78]
CENTRE = [
    [-353, 174, -4],
    [-709, -1, 23],
    [-18, -18, -76],
    [0, 236, 1],
    [0, -80, -9],
    [0, 0, -50],
]
INERTIA = [
    [16733765, 29799119, 32814954, -1703664, 129384, 4404062],
    [7507819, 88886691, 88673761, 430046, 173157, -4396607],
    [10783798, 10186135, 1943179, 118474, -606384, -101950],
    [425035, 217993, 428465, -4, -11353, -27],
    [283826, 229562, 258266, -4, -19521, -120],
    [60429, 60382, 90701, 21, 6, 4],
]
PAYLOAD = 150.0, [0.0, 0.0, 100.0], 1.8  # [kg], [mm], [kg m2]


def frames(angles: np.ndarray) -> list[np.ndarray]:
    """Return the frames of base and links at angles in KUKA's count [rad]."""
    found = [np.diag([1.0, -1.0, -1.0, 1.0])]
    for theta, d, a, alpha in zip(angles + OFFSET, D, A, ALPHA, strict=True):
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        step = [
            [c, -s * ca, s * sa, a * c],
            [s, c * ca, -c * sa, a * s],
            [0, sa, ca, d],
            [0, 0, 0, 1],
        ]
        found.append(found[-1] @ np.array(step))
    return found


def bodies() -> list[tuple[int, float, np.ndarray, np.ndarray]]:
    """Return the link, mass, centre [m] and inertia of links and payload, in the links' frames."""
    found = []
    for link, (mass, centre, values) in enumerate(zip(MASS, CENTRE, INERTIA, strict=True)):
        xx, yy, zz, xy, yz, xz = 1e-6 * np.array(values)
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        found.append((link, mass, 1e-3 * np.array(centre), tensor))
    mass, centre, inertia = PAYLOAD
    return [*found, (5, mass, 1e-3 * np.array(centre), inertia * np.eye(3))]


def mass_and_weight(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mass matrix and the torques that hold the weight, by the bodies' Jacobians."""
    at = frames(angles)
    mass_matrix, weight = np.zeros((6, 6)), np.zeros(6)
    for link, mass, centre, inertia in bodies():
        end = at[link + 1]
        place, turned = end[:3, :3] @ centre + end[:3, 3], end[:3, :3] @ inertia @ end[:3, :3].T
        axes = np.array([at[k][:3, 2] if k <= link else np.zeros(3) for k in range(6)]).T
        levers = np.array([np.cross(axes[:, k], place - at[k][:3, 3]) for k in range(6)]).T
        mass_matrix += mass * levers.T @ levers + axes.T @ turned @ axes
        weight += mass * 9.81 * levers[2]
    return mass_matrix, weight


def counterbalance(angle: np.ndarray) -> np.ndarray:
    """Torque that the source's hydraulic counterbalance asks of axis 2 [N m], A2 [rad], any shape."""
    far, near = 0.8, 0.2  # [m], where it holds, from the axis; shortest at A2 = -95 deg
    beyond = angle + np.deg2rad(95.0)
    length = np.sqrt(far**2 + near**2 - 2.0 * far * near * np.cos(beyond))
    area = np.pi / 4.0 * (0.055**2 - 0.03**2)
    pressure = 1.01 * 296.8 * 328.0 * 0.159 / (0.96e-3 - (length - (far - near)) * area)
    return np.sin(beyond) * far * near / length * pressure * area


@pytest.mark.parametrize("seed", range(5))
def test_the_file_is_the_denavit_hartenberg_model_of_its_source(seed):
    """Tool, mass matrix and weight at random angles in KUKA's count."""
    angles = np.random.default_rng(seed).uniform(-np.pi, np.pi, 6)
    axes = controller_axes(FILE, 6)
    q = axes.file_angles(angles[None])[0]
    robot = ElasticRobot(ROBOT)
    still = np.zeros(6)
    robot.reset(0.0, HeldCommand(0.0, q, still, still), Load(), undeflected=True)
    flange, tool = frames(angles)[-1], robot.rigid()
    turned = (Rotation.from_quat(tool[3:]) * axes.last_from_flange).as_matrix()
    np.testing.assert_allclose(tool[:3], flange[:3, 3], rtol=0, atol=1e-14)
    np.testing.assert_allclose(turned, flange[:3, :3], rtol=0, atol=1e-14)
    bare = [replace(joint, balancer=None) for joint in ROBOT.joints]
    dynamics = Dynamics(build_chain(replace(ROBOT, joints=tuple(bare))), np.array(ROBOT.gravity))
    theta = dynamics.chain.theta(q)
    mass, weight = mass_and_weight(angles)
    np.testing.assert_allclose(dynamics.mass_matrix(theta), mass, rtol=0, atol=1e-12 * mass.max())
    held = -dynamics.static_torque(theta, ToolLoad())
    np.testing.assert_allclose(held, weight, rtol=0, atol=1e-12 * abs(weight).max())


def test_the_balancer_is_the_counterbalance_of_the_source():
    """On the whole range of A2; its sign is that of what it takes off the gear."""
    points = np.array(ROBOT.joints[1].balancer)
    between = CubicSpline(*points.T, bc_type="natural")
    q = np.linspace(*ROBOT.joints[1].limits, 500)
    asked = counterbalance(q - np.pi / 2)
    np.testing.assert_allclose(between(q), -asked, rtol=0, atol=1e-4 * abs(asked).max())
