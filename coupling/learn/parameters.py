"""What is learned of a robot: log factors of its backlash, stiffness and damping."""

from __future__ import annotations

import numpy as np

from coupling.fit.parameters import RobotParameter, with_values
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters

# Standard deviations of the logarithm of a factor before anything is measured: what a gear's backlash
# and damping, and a stiffness from a data sheet or a static identification, are known to.
PRIOR = {"backlash": 0.3, "stiffness": 0.1, "damping": 0.3}


def prior_of(parameters: tuple[RobotParameter, ...]) -> np.ndarray:
    """Return the standard deviations of log factors before anything is measured, (P,)."""
    return np.array([PRIOR[parameter.kind] for parameter in parameters])


def changed(parameters: tuple[RobotParameter, ...], x: np.ndarray) -> dict[str, float]:
    """Return the FMU's parameters of log factors x (P,), by name."""
    values = [p.value * float(np.exp(own)) for p, own in zip(parameters, x, strict=True)]
    return {p.name: value for p, value in zip(parameters, values, strict=True)}


def robot_with(robot: Robot, parameters: tuple[RobotParameter, ...], x: np.ndarray) -> Robot:
    """Return the robot with log factors x, (P,)."""
    return with_values(robot, changed(parameters, x))


def factors_between(parameters: tuple[RobotParameter, ...], robot: Robot) -> np.ndarray:
    """Return the log factors that another robot of the same build has, (P,).

    Raises:
        ValueError: If it lacks an elasticity.
    """
    chain, nominal = build_chain(robot), Parameters.of(robot)
    x = np.zeros(len(parameters))
    for k, own in enumerate(parameters):
        name, kind = own.name.rsplit(".", 1)
        if name not in chain.elastic_names:
            raise ValueError(f"expected a robot with {own.name}, got none")
        value = float(getattr(nominal, kind)[chain.elastic_names.index(name)])
        x[k] = np.log(max(value, 1e-3 * own.value) / own.value)
    return x
