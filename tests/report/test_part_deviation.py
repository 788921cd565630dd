"""Deviation normal to the part, along the feed and across: on surfaces whose normals are known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coupling.path.histories import ToolPath
from coupling.report.part_deviation import part_axes, signed_deviation

# The tool's x axis, in which it approaches, points down.
DOWN = Rotation.from_euler("y", 90.0, degrees=True)


def path_through(points: np.ndarray) -> ToolPath:
    return ToolPath.with_rotation(np.arange(float(len(points))), points, DOWN)


def spiral(slope: float) -> np.ndarray:
    """Points on a cone that opens upwards, its wall at an angle [rad] to the horizontal."""
    angle = np.linspace(0.0, 40 * np.pi, 8001)
    radius = 0.06 - 2e-4 * angle / (2 * np.pi) / np.tan(slope)
    return np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle), (radius - 0.06) * np.tan(slope)]
    )


@pytest.mark.parametrize("degrees", [20.0, 45.0, 60.0])
def test_a_cone_s_wall_has_its_closed_form_normal(degrees):
    """It points inwards and up, to the tool: a shift along it is a deviation along it alone."""
    slope = np.radians(degrees)
    points = spiral(slope)
    outwards = points[:, :2] / np.linalg.norm(points[:, :2], axis=1)[:, None]
    normal = np.column_stack([-np.sin(slope) * outwards, np.full(len(points), np.cos(slope))])
    desired = path_through(points)
    inside = slice(800, -800)
    np.testing.assert_allclose(part_axes(desired)[0][inside], normal[inside], atol=0.03)
    signed = signed_deviation(desired, path_through(points + 1e-3 * normal))
    np.testing.assert_allclose(signed[inside], np.tile([1e-3, 0, 0], (6401, 1)), atol=4e-5)


def test_a_single_pass_has_the_tool_s_axis_for_its_normal():
    points = np.column_stack([np.linspace(0, 0.2, 50), np.zeros(50), np.zeros(50)])
    signed = signed_deviation(
        path_through(points), path_through(points + np.array([1e-4, 2e-4, 3e-4]))
    )
    np.testing.assert_allclose(signed, np.tile([3e-4, 1e-4, 2e-4], (50, 1)), atol=1e-12)


def test_a_plunge_keeps_its_axes_whatever_is_lost_in_rounding():
    """Straight down, the normal may be any, but not another from sample to sample."""
    rng = np.random.default_rng(1)
    points = np.column_stack([np.zeros(50), np.zeros(50), np.linspace(0.0, -0.02, 50)])
    points[:, :2] += 1e-13 * rng.normal(size=(50, 2))
    desired = path_through(points)
    signed = signed_deviation(desired, path_through(points + np.array([3e-4, 0.0, 0.0])))
    assert np.ptp(signed, axis=0) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("count", [2, 5])
def test_a_tool_that_stands_still_has_axes(count):
    desired = path_through(np.zeros((count, 3)))
    signed = signed_deviation(desired, path_through(np.tile([0.0, 0.0, 1e-3], (count, 1))))
    np.testing.assert_allclose(signed[:, 0], 1e-3, atol=1e-12)
    normal, along = part_axes(desired)
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), 1.0)
    np.testing.assert_allclose(np.einsum("ni,ni->n", normal, along), 0.0, atol=1e-12)


def test_the_size_of_a_deviation_stays():
    """Axes are orthonormal, also where the path turns back and stands."""
    rng = np.random.default_rng(2)
    points = np.repeat(rng.normal(size=(80, 3)), 2, axis=0)
    off = points + 1e-3 * rng.normal(size=points.shape)
    signed = signed_deviation(path_through(points), path_through(off))
    sizes = np.linalg.norm(signed, axis=1)
    np.testing.assert_allclose(sizes, np.linalg.norm(off - points, axis=1), rtol=1e-6)
