"""Offsets of a device's frame and clock are stated as a whole, found coarsely or finely."""

import numpy as np

from coupling.identification.runs.alignment import aligned
from coupling.identification.runs.measurement import Measurement
from coupling.path.histories import ToolPath


def test_a_frame_far_away_and_a_late_clock_are_the_measurements_offset():
    time = np.linspace(0.0, 20.0, 1001)
    pose = np.zeros((len(time), 7))
    pose[:, 0], pose[:, 1] = 0.2 * np.sin(0.7 * time), 0.1 * np.cos(1.3 * time)
    pose[:, 2], pose[:, 6] = 0.05 * np.sin(0.3 * time), 1.0
    away = np.array([5.0, -1.0, 0.5])
    recorded = Measurement("device.csv", time[100:900] - 0.5, pose[100:900, :3] + away)
    found = aligned(recorded, ToolPath(time, pose), own_frame=True)
    shift, turn = found.frame_offset(np.zeros(3), np.zeros(3))
    np.testing.assert_allclose(shift, away, atol=1e-3)
    np.testing.assert_allclose(turn, 0.0, atol=1e-3)
    np.testing.assert_allclose(found.clock, 0.5, atol=0.011)
