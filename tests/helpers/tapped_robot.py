"""Frequency responses of a robot with springs and dampers that a fit is not told."""

from dataclasses import replace

import numpy as np

from coupling.identification.response.posture import MeasuredPosture
from coupling.modes.locked_robot import LockedRobot
from coupling.modes.measured_response import MeasuredResponse
from coupling.robot.parameters import apply_values
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot, Tilt

AXES = "xyz"


def drawn_values(robot: Robot, rng: np.random.Generator) -> dict[str, float]:
    """Return other stiffnesses and dampings of all gears and tilts, by name."""
    values = {}
    for name in build_chain(robot).elastic_names:
        part = robot.joints[int(name[6 : name.index("]")]) - 1]
        part = part.tilt[int(name[-2]) - 1] if "tilt" in name else part
        values[f"{name}.stiffness"] = part.stiffness * float(np.exp(0.3 * rng.normal()))
        values[f"{name}.damping"] = part.damping * float(np.exp(0.5 * rng.normal()))
    return values


def bending_links(robot: Robot, rng: np.random.Generator) -> Robot:
    """Return the robot with a tilt at each joint without one, 3 to 9 times as stiff as its gear."""
    joints = []
    for joint in robot.joints:
        if joint.stiffness is not None and not joint.tilt:
            axis = np.cross(joint.axis, np.eye(3)[np.argmin(np.abs(joint.axis))])
            factor = float(np.exp(rng.uniform(1.2, 2.2)))
            damping = factor * joint.damping
            tilt = Tilt(
                tuple((axis / np.linalg.norm(axis)).tolist()), factor * joint.stiffness, damping
            )
            joint = replace(joint, tilt=(tilt,))
        joints.append(joint)
    return replace(robot, joints=tuple(joints))


def tap(
    robot: Robot,
    values: dict[str, float],
    q: np.ndarray,
    noise: float = 0.0,
    gain: float = 1.0,
    delay: float = 0.0,
    rng: np.random.Generator | None = None,
    is_held_out: bool = False,
) -> MeasuredPosture:
    """Return all nine responses of the robot with other values, in a posture [rad].

    Args:
        noise: Relative deviation of real and imaginary part, and 1/100 of it of the largest value.
        gain, delay: Factor and delay [s] of the instruments.
    """
    frequency = np.geomspace(4.0, 150.0, 240)
    linear = LockedRobot(apply_values(robot, values), "linear").linear(q, np.zeros(6))
    compliance = linear.dynamic_compliance(frequency)[:, :3, :3]
    compliance = compliance * gain * np.exp(-2j * np.pi * frequency * delay)[:, None, None]
    if rng is not None:
        size = np.abs(compliance) + 0.01 * np.abs(compliance).max(axis=0)
        draws = rng.normal(size=compliance.shape) + 1j * rng.normal(size=compliance.shape)
        compliance = compliance + noise * size * draws
    responses = tuple(
        MeasuredResponse(AXES[i] + AXES[j], frequency, compliance[:, i, j])
        for i in range(3)
        for j in range(3)
    )
    return MeasuredPosture("tapped", q, responses, is_held_out)
