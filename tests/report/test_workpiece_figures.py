"""Fields of a workpiece in space: labels name the units of the values."""

from __future__ import annotations

import numpy as np

from coupling.path.workpiece import Workpiece
from coupling.report.workpiece_figures import workpiece_scene


def test_lengths_are_millimetres_and_a_field_of_cells_is_that_of_both_halves():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    piece = Workpiece(
        corners,
        np.array([[0, 1, 2, 3]]),
        {"deflection [m]": np.array([0.0, 0.0, 0.0, -0.002])},
        {"plastic strain": np.array([0.1]), "stress [Pa]": np.array([1e8])},
    )
    (surface,) = workpiece_scene({"after": piece}).surfaces
    assert list(surface.fields) == ["deflection [mm]", "plastic strain", "stress [Pa]"]
    assert surface.fields["deflection [mm]"].min() == -2.0
    assert len(surface.triangles) == 2
    np.testing.assert_array_equal(surface.fields["plastic strain"], [0.1, 0.1])
