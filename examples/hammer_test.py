"""Tap the tool with a hammer: the robot's compliance over frequency, measured and computed.

A short blow excites all modes; the spectrum of the tool's motion over that of the force is the dynamic
compliance, which decides where milling chatters.  The linearised robot gives it without a simulation.
"""

import tempfile
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from elastic_robot.coupling.files.robot_file import load_robot, shipped_robots
from elastic_robot.coupling.fmu_export.build import build_fmu
from elastic_robot.coupling.path.histories import WrenchHistory
from elastic_robot.coupling.path.joint_path import JointPath
from elastic_robot.coupling.robot.robot_fmu import RobotFmu
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

FIGURE = Path(__file__).parent.parent / "results" / "hammer_test.html"

posture = np.array([0.0, 0.3, 0.2, 0.0, 1.0, 0.0])  # [rad]
model = load_robot(shipped_robots()["icme2008"])
frequency = np.geomspace(3.0, 120.0, 400)  # [Hz]

BLOW = 1000.0  # [N], held for one sample
SAMPLE = 1e-3  # [s]
RECORD = 8.0  # [s]; the slowest mode has decayed to less than a thousandth


def robot_at_rest() -> ElasticRobot:
    """Return the robot under its own weight, without backlash: a gear that rattles is not linear."""
    robot = ElasticRobot(model, "linear")
    robot.reset(0.0, HeldCommand(0.0, posture, np.zeros(6), np.zeros(6)), Load())
    return robot


def tap(direction: int) -> np.ndarray:
    """Return the compliance in one direction [m/N] from a simulated blow, complex, one per frequency."""
    time = SAMPLE * np.arange(round(RECORD / SAMPLE) + 1)
    blow = np.zeros((len(time), 6))
    blow[1, direction] = BLOW
    rest = JointPath(time, (np.tile(posture, (len(time), 1)),))
    with tempfile.TemporaryDirectory() as folder:
        file = build_fmu(model, Path(folder, "Robot.fmu"))
        with RobotFmu(file, "linear") as robot:
            path = robot.simulate(rest, WrenchHistory.of_means(time, blow), "dynamic")
    motion = path.position[0, :, direction] - path.position[0, 0, direction]
    s = 2j * np.pi * frequency
    of_motion = SAMPLE * np.exp(-np.outer(s, time)) @ motion
    of_force = BLOW * (1.0 - np.exp(-s * SAMPLE)) / s
    return of_motion / of_force


if __name__ == "__main__":
    linear = robot_at_rest().linearise()
    for f, ratio in zip(linear.modes.frequency, linear.modes.damping_ratio, strict=True):
        if np.isfinite(f):  # others creep and do not swing
            print(f"{f:7.2f} Hz, damping ratio {ratio:.4f}")
    computed = np.abs(linear.dynamic_compliance(frequency))
    figure = go.Figure()
    for direction, colour in enumerate(("#1f77b4", "#d62728", "#2ca02c")):
        name, tapped = "xyz"[direction], np.abs(tap(direction))
        line = {"x": frequency, "y": 1e6 * computed[:, direction, direction], "line_color": colour}
        dots = {"x": frequency[::5], "y": 1e6 * tapped[::5], "marker_color": colour}
        figure.add_scatter(**line, name=f"{name}, linearised")
        figure.add_scatter(**dots, name=f"{name}, tapped", mode="markers", marker_size=5)
    figure.update_xaxes(type="log", title="frequency [Hz]")
    figure.update_yaxes(type="log", title="compliance of the TCP [um/N]")
    figure.update_layout(template="plotly_white", width=900, height=480)
    FIGURE.parent.mkdir(exist_ok=True)
    figure.write_html(FIGURE)
    print(f"{FIGURE}: drawn")
