"""Modes of vibration in space: the robot swings as each of them does, in its gears and its tilts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coupling.report.run_scene import scene_robot
from coupling.results.modes_result import SwingingRobotResult
from coupling.results.scene import Scene, SceneMode, SceneMotion


def modes_scene(swinging: SwingingRobotResult, first_Hz: float = 0.0) -> Scene:
    """Return a robot in a posture with its modes.

    Args:
        first_Hz: Frequency whose nearest mode is shown first.
    """
    motion = SceneMotion(np.zeros(1), np.array([swinging.angles_rad]))
    robot = scene_robot(swinging.name, swinging.chain, motion, description=swinging.description)
    meshes = [replace(part, body=swinging.bodies[part.body]) for part in robot.meshes]
    modes = [
        SceneMode(swing.frequency_Hz, np.array(swing.amplitude))
        for swing in sorted(swinging.swings, key=lambda swing: abs(swing.frequency_Hz - first_Hz))
    ]
    return Scene(robots=[replace(robot, meshes=meshes, modes=modes)])
