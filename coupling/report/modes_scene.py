"""Modes of vibration in space: the robot swings as each of them does, in its gears and its tilts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coupling.modes.posture_modes import PostureModes
from coupling.path.frame import AT_THE_ORIGIN, Frame
from coupling.report.meshes import robot_meshes
from coupling.results.scene import Scene, SceneMode, SceneMotion, SceneRobot
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot

# Modes that are shown at most, the slowest ones.
_MODES = 6


def modes_scene(
    robot: Robot,
    posture: PostureModes,
    description: str,
    world_from_base: Frame = AT_THE_ORIGIN,
) -> Scene:
    """Return a robot in a posture with its modes.

    A tilt is drawn as what it is in the model, a joint behind that of its gear.

    Args:
        robot: The robot.
        posture: Modes in the posture.
        description: Its file, of which meshes are taken.
        world_from_base: Frame of its base.
    """
    origins, axes, angles, bodies = [], [], [], [0]
    for joint, angle in zip(robot.joints, posture.q.tolist(), strict=True):
        origins += [joint.origin, *[(0.0, 0.0, 0.0)] * len(joint.tilt)]
        axes += [joint.axis, *(tilt.axis for tilt in joint.tilt)]
        angles += [angle, *[0.0] * len(joint.tilt)]
        bodies.append(len(axes))
    chain, shape = build_chain(robot), posture.linear.modes.shape
    modes = []
    for column in posture.swinging[:_MODES]:
        amplitude = np.zeros(len(axes))
        amplitude[chain.elastic] = shape[:, column].real
        frequency = float(posture.linear.modes.frequency[column])
        modes.append(SceneMode(frequency, amplitude))
    return Scene(
        robots=[
            SceneRobot(
                name=robot.name,
                world_from_base=world_from_base,
                origins=np.array(origins),
                axes=np.array(axes),
                body_from_tool=Frame.of_rpy(robot.tcp_position, robot.tcp_rpy),
                motion=SceneMotion(np.zeros(1), np.array([angles])),
                flanks={},
                meshes=[
                    replace(part, body=bodies[part.body]) for part in robot_meshes(description)
                ],
                modes=modes,
            )
        ]
    )
