"""What is learned of a robot: log factors of its backlash, stiffness, damping, hysteresis, friction."""

from __future__ import annotations

import numpy as np

from coupling.robot.parameters import (
    KINDS,
    SLIPPING,
    RobotParameter,
    robot_parameters,
    with_values,
)
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import IDEAL

# Standard deviations of the logarithm of a factor before anything is measured: what a gear's backlash,
# damping and hysteresis, a motor's friction, which falls by a third as it gets warm, and a stiffness
# from a data sheet or a static identification, are known to.
PRIOR = {"backlash": 0.3, "stiffness": 0.1, "damping": 0.3, "hysteresis": 0.3, "friction": 0.3}


def learnable(robot: Robot, torque_curve: str, drive: str) -> tuple[RobotParameter, ...]:
    """Return what is learned of a robot whose drives are "ideal" or have a "servo".

    Friction turns no drive that follows its command whatever that takes.
    """
    kinds = (*KINDS, *(kind for kind in SLIPPING if drive != IDEAL or kind != "friction"))
    return robot_parameters(robot, torque_curve, kinds)


def prior_of(parameters: tuple[RobotParameter, ...]) -> np.ndarray:
    """Return the standard deviations of log factors before anything is measured [1], (P,)."""
    return np.array([PRIOR[parameter.kind] for parameter in parameters])


def changed(parameters: tuple[RobotParameter, ...], x: np.ndarray) -> dict[str, float]:
    """Return the FMU's parameters of log factors x [1], (P,), by name."""
    values = [p.value * float(np.exp(own)) for p, own in zip(parameters, x, strict=True)]
    return {p.name: value for p, value in zip(parameters, values, strict=True)}


def robot_with(robot: Robot, parameters: tuple[RobotParameter, ...], x: np.ndarray) -> Robot:
    """Return the robot with log factors x [1], (P,)."""
    return with_values(robot, changed(parameters, x))


def factors_between(parameters: tuple[RobotParameter, ...], robot: Robot) -> np.ndarray:
    """Return the log factors that another robot of the same build has [1], (P,).

    Raises:
        ValueError: If it lacks an elasticity.
    """
    names, kinds = build_chain(robot).elastic_names, (*KINDS, *SLIPPING)
    values = {own.name: own.value for own in robot_parameters(robot, "backlash", kinds)}
    x = np.zeros(len(parameters))
    for k, own in enumerate(parameters):
        if own.name.rsplit(".", 1)[0] not in names:
            raise ValueError(f"expected a robot with {own.name}, got none")
        x[k] = np.log(max(values.get(own.name, 0.0), 1e-3 * own.value) / own.value)
    return x
