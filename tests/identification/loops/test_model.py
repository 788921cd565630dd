"""What gears with memory predict of loading loops, and its derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from loading_loops import loops
from noisy_arm import arm
from slipping_robot import with_hysteresis

from coupling.identification.loops.model import LoopModel
from coupling.identification.loops.parameters import LoopParameters


@pytest.mark.parametrize("tilt", [False, True])
def test_predictions_are_the_robots_own_steps_and_derivatives_their_differences(tilt):
    """Elements that slip, stick and turn back; slip torques, slip angles and compliances."""
    robot = with_hysteresis(arm(tilt), (90.0, 150.0, 60.0))
    rows = loops(robot, 3, 5, 900.0)
    own = LoopParameters.of_loops(robot, "backlash", shaped=(0, 1, 2))
    model = LoopModel(own, rows, "backlash")
    found = model.predict(own.start)
    np.testing.assert_allclose(found.deflection, rows.deflection, atol=1e-12)
    for j, value in enumerate(own.start):
        ends = []
        for part in (-1e-6, 1e-6):
            values = own.start.copy()
            values[j] = value * (1.0 + part)
            ends.append(model.predict(values).deflection)
        slope = (ends[1] - ends[0]) / (2e-6 * value)
        np.testing.assert_allclose(
            found.by_parameter[:, :, j],
            slope,
            atol=2e-4 * np.abs(slope).max(),
            err_msg=own.names[j],
        )
