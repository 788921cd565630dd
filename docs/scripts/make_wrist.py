"""Write the table of docs/robot_file.md on the wrist of the KR 210: make wrist.

Its modes with the stiffness of joints 4 and 5 that its file has, and with that of modal tests of others.
"""

from __future__ import annotations

import sys
from dataclasses import replace as changed

import numpy as np

from coupling.files.robot_file import find_robot, load_robot
from docs.scripts.page import finish, replace, table
from elastic_robot.description import Robot
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

# Stiffness of joints 4 and 5 [N m/rad]: the diagonals of [GBTMilling]'s matrices.
MODAL = {
    "modal fit 28N6": (2.350e6, 2.157e6),
    "modal fit 286M1": (1.505e6, 1.703e6),
    "modal fit 38M3": (3.364e6, 1.615e6),
}
POSTURE = np.deg2rad([0.0, 10.0, 20.0, 0.0, 60.0, 0.0])


def with_wrist(robot: Robot, stiffness: tuple[float, float]) -> Robot:
    """Return the robot with other stiffness of joints 4 and 5 [N m/rad], its damping 1 ms of it."""
    joints = list(robot.joints)
    for number, value in zip((3, 4), stiffness, strict=True):
        joints[number] = changed(joints[number], stiffness=value, damping=1e-3 * value)
    return changed(robot, joints=tuple(joints))


def modes_and_compliance(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Return eigenfrequencies [Hz], (6,), and the tool's compliance along x, y, z [m/N], (3,)."""
    model, still = ElasticRobot(robot, "linear"), np.zeros(6)
    model.reset(0.0, HeldCommand(0.0, POSTURE, still, still), Load())
    return model.linearise().modes.frequency, np.diag(model.compliance())[:3]


def wrist() -> str:
    """Return the table."""
    robot = load_robot(find_robot("kuka_kr210"))
    own = robot.joints[3].stiffness, robot.joints[4].stiffness
    assert own[0] is not None
    assert own[1] is not None
    rows = []
    for name, stiffness in {"the file": (own[0], own[1]), **MODAL}.items():
        frequency, given = modes_and_compliance(with_wrist(robot, stiffness))
        rows.append(
            (
                name,
                ", ".join(f"{1e-6 * value:.2f}" for value in stiffness),
                *(f"{value:.1f}" for value in frequency),
                ", ".join(f"{1e6 * value:.2f}" for value in given),
            )
        )
    head = ("joints 4 and 5 of", "[MN m/rad]", *(f"mode {k} [Hz]" for k in range(1, 7)))
    return table((*head, "tool, x, y, z [um/N]"), rows)


if __name__ == "__main__":
    sys.exit(finish(lambda: replace("robot_file", "wrist", wrist())))
