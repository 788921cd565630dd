"""Press on an elastic wall with one FMU: its contact spring, driven by any master.

A wall rises by 2 mm against the tool.  Robot and wall share that way like two springs in a row,
without a second FMU and without iterations: the wall is part of the robot's equations.
"""

import tempfile
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from fmpy import read_model_description, simulate_fmu

from elastic_robot.coupling.files.robot_file import load_robot, shipped_robots
from elastic_robot.coupling.fmu_export.build import build_fmu

WALL_STIFFNESS = 1e6  # [N/m]
RISE, LASTS = 2e-3, 0.2  # [m, s]
STEP = 0.01  # [s]
FIGURE = Path("results", "hold_against_a_spring.html")

time = np.linspace(0.0, 1.0, 101)  # [s]
posture = [0.0, 0.3, 0.2, 0.0, 1.0, 0.0]  # [rad]


def simulate(fmu: str, mode: str, **columns: np.ndarray | float) -> np.ndarray:
    """Return the tool's height [m] over time; the columns are inputs, all others are zero."""
    inputs = [v.name for v in read_model_description(fmu).modelVariables if v.causality == "input"]
    table = np.zeros(len(time), dtype=[(name, float) for name in ("time", *inputs)])
    table["time"] = time
    drives = {f"q_cmd[{i}]": angle for i, angle in enumerate(posture, start=1)}
    for name, column in (drives | columns).items():
        table[name] = column
    start = {name: table[name][0] for name in inputs}
    found = simulate_fmu(
        fmu,
        stop_time=time[-1],
        output_interval=STEP,
        start_values={"mode": mode, "torque_curve": "linear", **start},
        input=table,
        output=["tcp.z"],
    )
    return np.array(found["tcp.z"])


def press(mode: str) -> tuple[np.ndarray, np.ndarray]:
    """Return how far the tool gave way and how deep it sank into the wall [m], over time."""
    s = np.minimum(time / LASTS, 1.0)
    rise = RISE * s * s * (3.0 - 2.0 * s)
    with tempfile.TemporaryDirectory() as folder:
        fmu = str(build_fmu(load_robot(shipped_robots()["icme2008"]), Path(folder, "Robot.fmu")))
        free = simulate(fmu, "quasistatic")[0]
        # The anchor at each step's start, and how fast it moves on from there.
        wall = {"anchor.z": free + rise, "anchor.vz": np.append(np.diff(rise) / STEP, 0.0)}
        tool = simulate(fmu, mode, **wall, **{"anchor.kzz": WALL_STIFFNESS})
    return tool - free, free + rise - tool


if __name__ == "__main__":
    way, depth = press("quasistatic")
    print(f"wall up by {1e3 * RISE:.3f} mm, tool by {1e3 * way[-1]:.3f} mm")
    print(f"force {WALL_STIFFNESS * depth[-1]:.1f} N")
    figure = go.Figure()
    figure.add_scatter(x=time, y=WALL_STIFFNESS * press("dynamic")[1], name="moving robot")
    figure.add_scatter(x=time, y=WALL_STIFFNESS * depth, name="at rest at every moment")
    figure.update_layout(xaxis_title="time [s]", yaxis_title="force of the wall [N]")
    FIGURE.parent.mkdir(exist_ok=True)
    figure.write_html(FIGURE)
    print(f"{FIGURE}: drawn")
