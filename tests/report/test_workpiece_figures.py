"""Fields of a workpiece in space: what the menu calls them is what the scale beside them measures."""

from __future__ import annotations

import numpy as np

from coupling.path.workpiece import Workpiece
from coupling.report.workpiece_figures import fields


def test_the_menu_names_the_units_of_the_scales():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    piece = Workpiece(
        corners,
        np.array([[0, 1, 2, 3]]),
        {"deflection [m]": np.array([0.0, 0.0, 0.0, -0.002])},
        {"plastic strain": np.array([0.1]), "stress [Pa]": np.array([1e8])},
    )
    (figure,) = fields({"after": piece})
    names = ["deflection [mm]", "plastic strain", "stress [Pa]"]
    assert [button.label for button in figure.layout.updatemenus[0].buttons] == names
    assert [surface.colorbar.title.text for surface in figure.data] == names
    assert min(figure.data[0].intensity) == -2.0
