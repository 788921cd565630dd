"""The task of docs/import.md through FMPy's single FMI calls: what every master must agree with.

python masters_reference.py trajectory|inputs, in a folder with ElasticRobot.fmu and motion.csv; leaves
reference.csv: time and TCP pose at the communication points.  Knows nothing of this project.
"""

import sys

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

JOINTS = range(1, 7)
TCP = [f"tcp.{name}" for name in ("x", "y", "z", "qx", "qy", "qz", "qw")]
DRIVES = [f"{name}_cmd[{i}]" for name in ("q", "qd", "qdd") for i in JOINTS]
FORCE_RATE = -1000.0  # of force.z [N/s]


def simulate(by_inputs: bool) -> np.ndarray:
    """Return time and pose, (n, 8)."""
    motion = np.loadtxt("motion.csv", delimiter=",", skiprows=1)  # time, q1.., qd1.., qdd1..
    description = read_model_description("ElasticRobot.fmu")
    reference = {v.name: v.valueReference for v in description.modelVariables}
    robot = FMU2Slave(
        guid=description.guid,
        unzipDirectory=extract("ElasticRobot.fmu"),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="robot",
    )
    robot.instantiate()
    robot.setupExperiment(startTime=0.0)

    def set_inputs(row: np.ndarray) -> None:
        robot.setReal([reference["force.z"]], [FORCE_RATE * row[0]])
        if by_inputs:
            robot.setReal([reference[name] for name in DRIVES], row[1:].tolist())

    if not by_inputs:
        robot.setString([reference["trajectory"]], ["motion.csv"])
    robot.enterInitializationMode()
    set_inputs(motion[0])
    robot.exitInitializationMode()
    poses = [robot.getReal([reference[name] for name in TCP])]
    for row, end in zip(motion[:-1], motion[1:, 0], strict=True):
        set_inputs(row)
        robot.doStep(row[0], end - row[0])
        poses.append(robot.getReal([reference[name] for name in TCP]))
    return np.column_stack([motion[:, 0], poses])


if __name__ == "__main__":
    np.savetxt("reference.csv", simulate(sys.argv[1] == "inputs"), delimiter=",", fmt="%.17g")
