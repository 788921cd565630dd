"""Modes in space: the robot that is drawn swings as the model does, its tilts too."""

import time

import numpy as np
import pytest
from browser import NEEDS_CHROMIUM, chromium, opened

from coupling.files.robot_file import find_robot, load_robot
from coupling.modes.locked_robot import LockedRobot
from coupling.modes.posture_modes import PostureModes
from coupling.modes.swinging_robot import swinging_robot
from coupling.report.document import document
from coupling.report.modes_scene import modes_scene
from coupling.report.static_scene import links
from coupling.results.section import Section

POSTURE = np.deg2rad([10.0, 20.0, 30.0, 40.0, 60.0, 50.0])


@pytest.mark.parametrize("name", ["icme2008", "fanuc_r2000ic", "kuka_kr300"])
def test_the_tool_that_is_drawn_swings_as_the_modes_of_the_model(name):
    robot = load_robot(find_robot(name))
    posture = PostureModes.of(LockedRobot(robot, "linear"), POSTURE, np.zeros(6))
    swinging = swinging_robot(robot, name, posture.q, posture.linear.modes)
    (drawn,) = modes_scene(swinging).robots
    assert [mode.frequency for mode in drawn.modes] == pytest.approx(posture.frequency[:6])
    (rest,) = drawn.motion.q
    for mode, column in zip(drawn.modes, posture.swinging, strict=False):
        step = 1e-6 * mode.amplitude
        moved = (links(drawn, rest + step)[-1] - links(drawn, rest - step)[-1]) / 2e-6
        expected = posture.linear.modes.tcp[:3, column].real
        # The model is linear about its equilibrium, where its gears are wound up a little.
        np.testing.assert_allclose(moved, expected, atol=0.03 * np.linalg.norm(expected) + 1e-6)


@NEEDS_CHROMIUM
def test_a_mode_swings_in_the_page(tmp_path):
    robot = load_robot(find_robot("icme2008"))
    posture = PostureModes.of(LockedRobot(robot, "linear"), POSTURE, np.zeros(6))
    scene = modes_scene(swinging_robot(robot, "icme2008", POSTURE, posture.linear.modes))
    page = tmp_path / "modes.html"
    page.write_text(document("Modes", [Section("", [], "modes", scene=scene)]))
    with chromium(tmp_path / "profile") as driver:
        opened(driver, page, 800)
        shown = "return Number(document.getElementById('modes_scene').dataset.shown)"
        first = driver.execute_script(shown)
        deadline = time.monotonic() + 20.0
        while driver.execute_script(shown) < first + 5:
            assert time.monotonic() < deadline
            time.sleep(0.05)
