"""A robot with its modes, as pages draw it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coupling.path.frame import AT_THE_ORIGIN, Frame
from coupling.results.modes_result import SwingingRobotResult, SwingResult
from coupling.results.run_result import ChainResult, three
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.linearisation import Modes

# Modes that are drawn at most, the slowest ones.
_MODES = 6


def swinging_robot(
    robot: Robot,
    description: str,
    q: np.ndarray,
    modes: Modes,
    world_from_base: Frame = AT_THE_ORIGIN,
) -> SwingingRobotResult:
    """Return a robot in a posture with its slowest modes.

    A tilt is drawn as what it is in the model, a joint behind that of its gear.

    Args:
        q: Angles of its drives [rad], (joints,).
    """
    origins: list[Sequence[float]] = []
    axes: list[Sequence[float]] = []
    angles: list[float] = []
    bodies = [0]
    for joint, angle in zip(robot.joints, q.tolist(), strict=True):
        origins += [joint.origin, *[(0.0, 0.0, 0.0)] * len(joint.tilt)]
        axes += [joint.axis, *(tilt.axis for tilt in joint.tilt)]
        angles += [angle, *[0.0] * len(joint.tilt)]
        bodies.append(len(axes))
    elastic = build_chain(robot).elastic
    swings = []
    for column in np.flatnonzero(np.isfinite(modes.frequency))[:_MODES]:
        amplitude = np.zeros(len(axes))
        amplitude[elastic] = modes.shape[:, column].real
        frequency = float(modes.frequency[column])
        swings.append(SwingResult(frequency_Hz=frequency, amplitude=tuple(amplitude.tolist())))
    return SwingingRobotResult(
        name=robot.name,
        description=description,
        chain=ChainResult(
            base_pose=world_from_base.pose,
            origins_m=tuple(three(np.array(origin)) for origin in origins),
            axes=tuple(three(np.array(axis)) for axis in axes),
            tool_pose=Frame.of_rpy(robot.tcp_position, robot.tcp_rpy).pose,
        ),
        angles_rad=tuple(angles),
        bodies=tuple(bodies),
        swings=tuple(swings),
    )
