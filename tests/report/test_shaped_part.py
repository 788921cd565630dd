"""The part that a tool shapes: its ball or its end, where and when it works."""

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.path.frame import AT_THE_ORIGIN, Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.report.shaped_part import shaped_part
from coupling.results.scene import SceneTool

DOWN = Rotation.from_euler("y", 90.0, degrees=True)
BALL, END = SceneTool(0.01, is_round=True), SceneTool(0.01, is_round=False)
TIME = np.linspace(0.0, 8.0, 801)
# Along y, 2 mm deep, from 2 s to 6 s; before and after in the air.
Y = np.linspace(-0.04, 0.04, 801)
BUSY = (TIME >= 2.0) & (TIME <= 6.0)


def straight(part: Frame = AT_THE_ORIGIN) -> ToolPath:
    """Return a pass along y of a part, the tool upright on it."""
    tips = np.column_stack([0.0 * Y, Y, np.where(BUSY, -0.002, 0.02)])
    quaternion = np.tile((part.rotation * DOWN).as_quat(), (len(Y), 1))
    return ToolPath(TIME, np.hstack([part.points(tips), quaternion]))


def pushed(force: float) -> WrenchHistory:
    wrench = np.zeros((len(TIME), 6))
    wrench[BUSY, 2] = force
    return WrenchHistory(TIME, wrench)


def test_a_ball_leaves_a_round_groove_where_it_works():
    """In a part that is turned and shifted; above the part's plane it leaves nothing."""
    part = Frame.of_rpy([0.3, -0.2, 0.5], np.array([0.1, 0.2, 0.3]))
    shaped = shaped_part(straight(part), pushed(-50.0), part, BALL)
    x, y, z = shaped.points.T
    middle = np.abs(y) < 0.015
    ball = 0.003 - np.sqrt(0.005**2 - x[middle] ** 2)
    np.testing.assert_allclose(z[middle], ball, atol=2e-5)
    assert z.max() <= 0.0
    assert -0.026 < y.min() < y.max() < 0.026
    np.testing.assert_allclose(np.interp(y[middle], Y, TIME), shaped.time[middle], atol=0.1)


def test_a_flat_end_leaves_a_flat_slot_and_none_where_it_leans():
    shaped = shaped_part(straight(), pushed(-50.0), AT_THE_ORIGIN, END)
    # Some of its last corners are shaped as it rises.
    assert np.mean(np.abs(shaped.points[:, 2] + 0.002) < 1e-9) > 0.99
    assert np.ptp(shaped.points[:, 0]) > 0.009
    leaning = Frame.of_rpy([0.0, 0.0, 0.0], np.array([0.2, 0.0, 0.0]))
    assert shaped_part(straight(), pushed(-50.0), leaning, END) is None


def test_a_tool_that_never_works_leaves_nothing():
    assert shaped_part(straight(), pushed(0.0), AT_THE_ORIGIN, BALL) is None


def test_triangles_join_corners_that_are_there():
    shaped = shaped_part(straight(), pushed(-50.0), AT_THE_ORIGIN, BALL)
    assert set(shaped.triangles.ravel()) <= set(range(len(shaped.points)))
    sides = shaped.points[shaped.triangles]
    area = 0.5 * np.linalg.norm(
        np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])[:, 2:], axis=1
    )
    # The groove is 8 mm wide at the plane, and 40 mm long with its round ends.
    assert 0.9 * 0.008 * 0.04 < area.sum() < 0.008 * 0.05
    height, time = shaped.nearest_to(np.array([[0.0, 0.0, 0.0], [0.5, 0.5, 0.0]]))
    np.testing.assert_allclose([height[0], time[0]], [-0.002, 4.0], atol=0.1)
    assert np.isnan([height[1], time[1]]).all()


def test_a_long_path_is_swept_in_a_moment():
    """Ten minutes at 20 Hz in 400 rows to and fro are as many corners as any other part."""
    time = np.linspace(0.0, 600.0, 12_001)
    x = 0.1 * np.abs((time / 1.5) % 2.0 - 1.0)
    tips = np.column_stack([x, 0.1 * time / 600.0, -0.001 - 0.0 * time])
    path = ToolPath(time, np.hstack([tips, np.tile(DOWN.as_quat(), (len(time), 1))]))
    wrench = WrenchHistory(time, np.tile([0.0, 0, -50, 0, 0, 0], (len(time), 1)))
    shaped = shaped_part(path, wrench, AT_THE_ORIGIN, BALL)
    assert 5000 < len(shaped.points) < 12_000
