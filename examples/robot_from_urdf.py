"""How much a real robot gives way along a line: a KUKA KR 210 from its URDF.

Seen from the tool the joints are springs in a row, J diag(1/k) J^T, each the softer the longer the
force's lever about it; a force of 1 kN acts in turn along x, y and z while the tool, pointing down,
moves away from the base.  (Along y it is joint 1 that counts, whose stiffness is an assumption.)
"""

import tempfile
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from elastic_robot.coupling.files.robot_file import load_robot
from elastic_robot.coupling.fmu_export.build import build_fmu
from elastic_robot.coupling.path.histories import ToolPath, WrenchHistory
from elastic_robot.coupling.robot.inverse_kinematics import InverseKinematics
from elastic_robot.coupling.robot.robot_fmu import RobotFmu

ROBOT = Path(__file__).parent / "robots" / "kuka_kr210.toml"
FORCE = 1000.0  # [N]
HOME = np.array([0.0, 0.3, 0.2, 0.0, 1.07, 0.0])  # [rad], where inverse kinematics starts
DOWN = np.array([0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)])  # the tool's x axis along -z of the base

time = np.linspace(0.0, 10.0, 61)  # [s]
reach = np.linspace(1.4, 2.6, len(time))  # [m], distance from axis 1
height = 0.9  # [m] above the floor


def deviations() -> np.ndarray:
    """Return how far forces along x, y and z push the tool along the line [m], (3, samples, 3)."""
    robot = load_robot(ROBOT)
    position = np.column_stack([reach, np.zeros_like(reach), np.full_like(reach, height)])
    line = ToolPath(time, np.hstack([position, np.tile(DOWN, (len(time), 1))]))
    command = InverseKinematics(robot, HOME).plan(line)
    with tempfile.TemporaryDirectory() as folder:
        fmu = build_fmu(robot, Path(folder, "KukaKr210.fmu"))
        with RobotFmu(fmu, torque_curve="linear") as robot_fmu:
            unloaded = robot_fmu.simulate(command, WrenchHistory.none(time), "quasistatic")
            pushed = []
            for direction in range(3):
                wrench = np.zeros((len(time), 6))
                wrench[:, direction] = FORCE
                load = WrenchHistory(time, wrench)
                loaded = robot_fmu.simulate(command, load, "quasistatic")
                pushed.append(loaded.position[0] - unloaded.position[0])
    return np.array(pushed)


if __name__ == "__main__":
    distance = np.linalg.norm(deviations(), axis=2)
    figure = go.Figure()
    for name, along in zip("xyz", distance, strict=True):
        print(
            f"{FORCE:.0f} N along {name}: {1e3 * along[0]:.2f} mm at {reach[0]:.1f} m,"
            f" {1e3 * along[-1]:.2f} mm at {reach[-1]:.1f} m"
        )
        figure.add_scatter(x=reach, y=1e3 * along, name=f"force along {name}")
    figure.update_xaxes(title="distance of the tool from axis 1 [m]")
    figure.update_yaxes(title=f"deviation of the tool under {FORCE:.0f} N [mm]", rangemode="tozero")
    figure.update_layout(template="plotly_white", title="KUKA KR 210 L150, tool pointing down")
    page = Path("results", "robot_from_urdf.html")
    page.parent.mkdir(exist_ok=True)
    figure.write_html(page)
    print(f"{page}: drawn")
