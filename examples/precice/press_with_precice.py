"""Press on an elastic wall with preCICE: the robot's FMU and a wall, two participants, two processes.

The drives push the tool 2 mm past a wall that it does not touch at first.  Robot and wall share that way
like two springs in a row.
"""

import contextlib
import multiprocessing
import os
import tempfile
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from fmpy import simulate_fmu

from elastic_robot.coupling.files.robot_file import load_robot, shipped_robots
from elastic_robot.coupling.fmu.precice_robot import CoupledMotion, PreciceNames, run_robot
from elastic_robot.coupling.fmu_export.build import build_fmu

WALL_STIFFNESS = 1e6  # [N/m]
CLEARANCE, DEPTH, LASTS = 1e-3, 2e-3, 0.2  # [m, m, s]; before contact, commanded past the wall
NAMES = PreciceNames()
CONFIGURATION = Path(__file__).with_name("precice-config.xml")
FIGURE = Path("results", "press_with_precice.html")

posture = np.array([0.0, 0.3, 0.2, 0.0, 1.0, 0.0])  # [rad]


def motion(folder: Path) -> Path:
    """Write the drives' motion, axis 2 downwards and then at rest, and return the file."""
    time = np.linspace(0.0, 1.0, 501)
    s = np.minimum(time / LASTS, 1.0)
    path = 6 * s**5 - 15 * s**4 + 10 * s**3
    rate = (30 * s**4 - 60 * s**3 + 30 * s**2) / LASTS
    acceleration = (120 * s**3 - 180 * s**2 + 60 * s) / LASTS**2
    turn = np.zeros(6)
    turn[1] = (CLEARANCE + DEPTH) / 1.5  # [rad], with some 1.5 m from axis 2 to the tool
    rows = [
        time,
        posture + np.outer(path, turn),
        np.outer(rate, turn),
        np.outer(acceleration, turn),
    ]
    header = ",".join(["time", *(f"{name}{i}" for name in ("q", "qd", "qdd") for i in range(1, 7))])
    file = folder / "motion.csv"
    np.savetxt(file, np.column_stack(rows), delimiter=",", header=header, comments="", fmt="%.17g")
    return file


def wall(height: float, configuration: Path, has_spring: bool) -> None:
    """Be the wall: a participant that answers a position with a force and, if asked, its stiffness."""
    import precice

    participant = precice.Participant("Wall", str(configuration), 0, 1)
    mesh = "Wall-Mesh"
    vertex = participant.set_mesh_vertices(mesh, np.zeros((1, 3)))
    participant.initialize()
    while participant.is_coupling_ongoing():
        participant.requires_writing_checkpoint()  # a wall remembers nothing
        window = participant.get_max_time_step_size()
        depth = height - participant.read_data(mesh, "Position", vertex, window)[0, 2]
        stiffness = WALL_STIFFNESS if depth > 0.0 else 0.0
        rows = {"Force": [0.0, 0.0, stiffness * depth]}
        if has_spring:
            rows |= {"Stiffness": [0.0, 0.0, stiffness], "Cross-Stiffness": [0.0, 0.0, 0.0]}
        for data, row in rows.items():
            participant.write_data(mesh, data, vertex, np.array([row]))
        participant.advance(window)
        participant.requires_reading_checkpoint()
    participant.finalize()


def prepare(folder: Path, mode: str) -> tuple[Path, dict[str, float | str], float]:
    """Return the robot's FMU, its start values and the height of the wall [m]."""
    fmu = build_fmu(load_robot(shipped_robots()["icme2008"]), folder / "Robot.fmu")
    motion_file = str(motion(folder))
    parameters: dict[str, float | str] = {"trajectory": motion_file, "mode": mode}
    parameters["torque_curve"] = "linear"
    rest = simulate_fmu(str(fmu), stop_time=0.0, start_values=parameters, output=["tcp.z"])
    return fmu, parameters, float(rest["tcp.z"][0]) - CLEARANCE


def press(
    mode: str = "dynamic",
    configuration: Path = CONFIGURATION,
    names: PreciceNames = NAMES,
) -> tuple[CoupledMotion, float]:
    """Return the motion of the tool, and the height of the wall [m]."""
    with tempfile.TemporaryDirectory() as place, contextlib.chdir(place):
        fmu, parameters, height = prepare(Path(place), mode)
        partner = start_wall(height, configuration, bool(names.stiffness))
        tool = run_robot(fmu, configuration, parameters, names)
        partner.join()
    return tool, height


def start_wall(height: float, configuration: Path, has_spring: bool) -> BaseProcess:
    """Start the wall in a process of its own: preCICE connects the two, in the working folder."""
    arguments = (height, configuration, has_spring)
    process = multiprocessing.get_context("spawn").Process(target=wall, args=arguments, daemon=True)
    process.start()
    return process


if __name__ == "__main__":
    tool, height = press()
    depth = height - tool.pose[:, 2]
    print(f"{len(tool.time) - 1} windows, {np.mean(tool.iterations[1:]):.2f} iterations each")
    print(f"{1e3 * depth[-1]:.3f} mm deep under {tool.force[-1, 2]:.1f} N")
    figure = go.Figure(go.Scatter(x=tool.time, y=tool.force[:, 2]))
    figure.update_layout(xaxis_title="time [s]", yaxis_title="force of the wall [N]")
    FIGURE.parent.mkdir(exist_ok=True)
    figure.write_html(os.fspath(FIGURE))
    print(f"{FIGURE}: drawn")
