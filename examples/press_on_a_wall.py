"""Press on an elastic wall: robot and wall share the load like two springs in a row.

The robot is commanded 2 mm into a wall; the FMU and the wall iterate until they agree.
"""

import tempfile
from pathlib import Path

import numpy as np

from elastic_robot.coupling.files.robot_file import load_robot, shipped_robots
from elastic_robot.coupling.fmu_export.build import build_fmu
from elastic_robot.coupling.path.histories import WrenchHistory
from elastic_robot.coupling.path.joint_path import JointPath
from elastic_robot.coupling.process import ElasticWall
from elastic_robot.coupling.robot.robot_fmu import RobotFmu
from elastic_robot.coupling.solve.coupling import couple
from elastic_robot.coupling.solve.fixed_point import Loop

WALL_STIFFNESS = 1e6  # [N/m]
COMMANDED_DEPTH = 2e-3  # [m], beyond where the unloaded tool would be

time = np.linspace(0.0, 1.0, 51)  # [s]
posture = np.array([0.0, 0.3, 0.2, 0.0, 1.0, 0.0])  # [rad]
command = JointPath(time, (np.tile(posture, (len(time), 1)),))


def press() -> tuple[float, float, int]:
    """Return the depth [m], the force [N] and the number of process evaluations."""
    robot = load_robot(shipped_robots()["icme2008"])
    with tempfile.TemporaryDirectory() as folder:
        fmu = build_fmu(robot, Path(folder, "Robot.fmu"))
        with RobotFmu(fmu, torque_curve="linear") as robot_fmu:
            unloaded = robot_fmu.simulate(command, WrenchHistory.none(time), "quasistatic")
            point = unloaded.position[0, 0] + [0.0, 0.0, COMMANDED_DEPTH]
            wall = ElasticWall(point, np.array([0.0, 0.0, 1.0]), WALL_STIFFNESS)
            result = couple(Loop(robot_fmu, wall, "quasistatic"), command)
    depth = float(point[2] - result.path.position[0, -1, 2])
    return depth, float(result.response.wrench.force[0, -1, 2]), len(result.evaluations)


if __name__ == "__main__":
    depth, force, evaluations = press()
    print(f"commanded {1e3 * COMMANDED_DEPTH:.3f} mm, reached {1e3 * depth:.3f} mm, {force:.1f} N")
    give = (COMMANDED_DEPTH - depth) / force
    print(f"robot compliance {1e6 * give:.3f} um/N, found in {evaluations} evaluations")
