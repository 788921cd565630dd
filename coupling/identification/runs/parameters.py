"""What is learned of a robot: log factors of the parameters whose rows have a prior."""

from __future__ import annotations

import numpy as np

from coupling.robot.parameter_table import PARAMETER_KINDS
from coupling.robot.parameters import RobotParameter, robot_parameters
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot

_PRIOR = {key: kind.prior for key, kind in PARAMETER_KINDS.items() if kind.prior is not None}
# The order in learned.json, in which backlash stands before what every robot has.
LEARNED = tuple(sorted(_PRIOR, key=lambda key: key != "backlash"))


def learnable(robot: Robot, torque_curve: str, drive: str) -> tuple[RobotParameter, ...]:
    """Return what is learned of a robot whose drives are "ideal" or have a "servo"."""
    return robot_parameters(robot, torque_curve, LEARNED, drive)


def prior_of(parameters: tuple[RobotParameter, ...]) -> np.ndarray:
    """Return the standard deviations of log factors before anything is measured [1], (P,)."""
    return np.array([_PRIOR[parameter.kind] for parameter in parameters])


def factors_between(parameters: tuple[RobotParameter, ...], robot: Robot) -> np.ndarray:
    """Return the log factors that another robot of the same build has [1], (P,).

    Raises:
        ValueError: If it lacks an elasticity.
    """
    names, parameters_of_robot = (
        build_chain(robot).elastic_names,
        robot_parameters(robot, "backlash", LEARNED),
    )
    values = {parameter.name: parameter.value for parameter in parameters_of_robot}
    x = np.zeros(len(parameters))
    for k, parameter in enumerate(parameters):
        if parameter.name.removesuffix(f".{parameter.kind}") not in names:
            raise ValueError(f"expected a robot with {parameter.name}, got none")
        value = values.get(parameter.name, 0.0)
        x[k] = np.log(max(value, 1e-3 * parameter.value) / parameter.value)
    return x
