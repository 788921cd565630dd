"""Fields of a workpiece in space: labels name the units of the values."""

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.path.workpiece import Workpiece
from coupling.report.workpiece_figures import tool_envelope, workpiece_surface


def test_lengths_are_millimetres_and_a_field_of_cells_is_that_of_both_halves():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    piece = Workpiece(
        corners,
        np.array([[0, 1, 2, 3]]),
        {"deflection [m]": np.array([0.0, 0.0, 0.0, -0.002])},
        {"plastic strain": np.array([0.1]), "stress [Pa]": np.array([1e8])},
    )
    surface = workpiece_surface("after", piece)
    assert list(surface.fields) == ["deflection [mm]", "plastic strain", "stress [Pa]"]
    assert surface.fields["deflection [mm]"].min() == -2.0
    assert len(surface.triangles) == 2
    np.testing.assert_array_equal(surface.fields["plastic strain"], [0.1, 0.1])


def test_the_envelope_of_a_straight_pass_is_the_tool_s_ball():
    """A ball of 5 mm along y, 2 mm deep at x = 10 mm, seen in a part that is turned and shifted."""
    part = Frame.of_rpy([0.3, -0.2, 0.5], np.array([0.1, 0.2, 0.3]))
    y = np.linspace(-0.02, 0.02, 401)
    tips = np.column_stack([np.full_like(y, 0.01), y, np.full_like(y, -0.002)])
    # The tool comes along minus z of the part: its x axis, the approach, points there.
    down = part.rotation * Rotation.from_euler("y", 90.0, degrees=True)
    quaternion = np.tile(down.as_quat(), (len(y), 1))
    path = ToolPath(np.linspace(0.0, 1.0, len(y)), np.hstack([part.points(tips), quaternion]))
    x, z = tool_envelope(path, part, 0.005).T
    inside = np.abs(x - 0.01) < 0.0049
    expected = -0.002 + 0.005 - np.sqrt(0.005**2 - (x[inside] - 0.01) ** 2)
    np.testing.assert_allclose(z[inside], expected, atol=2e-6)
