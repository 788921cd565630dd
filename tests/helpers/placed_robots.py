"""Robots as cases have them, without a case."""

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.case.case import PlacedRobot
from coupling.files.provenance import Provenance
from coupling.path.frame import AT_THE_ORIGIN
from coupling.robot.mounting import Mounting
from elastic_robot.description import Robot


def placed_robot(
    robot: Robot, torque_curve: str = "backlash", drive: str = "ideal", ranges: dict | None = None
) -> PlacedRobot:
    """Return a robot whose base is the world, with ranges of its gears' stiffness."""
    return PlacedRobot(
        "forming",
        robot,
        torque_curve,
        np.zeros(len(robot.joints)),
        AT_THE_ORIGIN,
        Mounting(Rotation.identity(), np.zeros(3)),
        drive,
        provenance=Provenance(stiffness_ranges=ranges or {}),
    )
