"""A swing that leaves no vibration, found by CasADi in the robot's own equations.

A stretched robot swings by 30 degrees about its first axis and stops; its gears and bearings swing on.
CasADi imports the FMU in model exchange, and shapes the drive's motion so that all elastic angles
come to rest with it.  The shaped swing is then driven in co-simulation, as any master would.
"""

import tempfile
from pathlib import Path

import casadi as ca
import fmpy
import numpy as np
import plotly.graph_objects as go

from elastic_robot.coupling.files.robot_file import load_robot, shipped_robots
from elastic_robot.coupling.fmu_export.build import BuildOptions, build_fmu

SWING, LASTS = np.radians(30.0), 0.6  # [rad, s]
SHAPES = 5  # polynomials that may be added to the swing
PASSES = 3  # of Newton's method
REST = 0.4  # time that is watched behind it [s]
STEP = 0.002  # [s]
FIGURE = Path("results", "least_vibration.html")

posture = np.array([0.0, 0.5, 0.1, 0.0, 0.4, 0.0])  # at the beginning [rad]


def swing(time: ca.SX, shape: ca.SX) -> ca.SX:
    """Return the angle of the first drive [rad]: from rest to rest, whatever the shape.

    The quintic that is at rest at both ends, and s^3 (1 - s)^3 times Legendre's polynomials.
    """
    s = time / LASTS
    legendre = [ca.SX(1.0), 2.0 * s - 1.0]
    for k in range(1, SHAPES - 1):
        legendre.append(((2 * k + 1) * legendre[1] * legendre[k] - k * legendre[k - 1]) / (k + 1))
    bumps = (s * (1.0 - s)) ** 3 * ca.vertcat(*legendre[:SHAPES])
    return SWING * (s**3 * (10.0 - 15.0 * s + 6.0 * s**2) + ca.dot(shape, bumps))


def drives() -> ca.Function:
    """Return q, q', q'' of all drives, (6, 3), from time and shape."""
    time, shape = ca.SX.sym("time"), ca.SX.sym("shape", SHAPES)
    angle = swing(time, shape)
    rate = ca.jacobian(angle, time)
    first = ca.horzcat(angle, rate, ca.jacobian(rate, time))
    others = ca.horzcat(ca.DM(posture[1:]), ca.DM(5, 2))
    return ca.Function("drives", [time, shape], [ca.vertcat(first, others)])


def best_shape(folder: Path) -> np.ndarray:
    """Return the shape with which the robot of an unpacked FMU comes to rest at the swing's end.

    Least squares in rates and accelerations of the elastic angles there, by Gauss and Newton; they and
    their derivatives come from CVODES, its right-hand side and Jacobians from the FMU.
    """
    robot = ca.DaeBuilder("robot", str(folder))
    robot.set("torque_curve", "linear")
    equation = robot.create("equation", ["x", "u"], ["ode"])
    inputs, m = robot.u(), robot.nx() // 2

    def motion(state: ca.MX, driven: ca.MX) -> ca.MX:
        """X' and x'' under drives (6, 3); no force."""
        first = inputs.index("q_cmd[1]")
        none = ca.MX(first, 1), ca.MX(len(inputs) - first - 18, 1)
        return equation(state, ca.vertcat(none[0], ca.vec(driven), none[1]))

    x, time, shape = ca.MX.sym("x", m), ca.MX.sym("time"), ca.MX.sym("shape", SHAPES)
    at_rest = motion(ca.vertcat(x, ca.MX(m, 1)), drives()(0.0, ca.MX(SHAPES, 1)))[m:]
    equilibrium = ca.rootfinder("equilibrium", "newton", {"x": x, "g": at_rest})
    start = ca.vertcat(equilibrium(ca.DM(m, 1), ca.DM(0, 1)), ca.DM(m, 1))

    state = ca.MX.sym("state", 2 * m)
    ode = motion(state, drives()(time, shape))
    problem = {"x": state, "t": time, "p": shape, "ode": ode}
    flow = ca.integrator("flow", "cvodes", problem, 0.0, LASTS, {"abstol": 1e-10, "reltol": 1e-8})
    end = flow(x0=start, p=shape)["xf"]
    left = motion(end, drives()(LASTS, shape))
    # In um at the tool of a robot of 10 Hz and 2 m, about.
    residual = ca.vertcat(left[:m] / 60.0, left[m:] / 60.0**2) * 2e6
    find = ca.Function("find", [shape], [residual, ca.jacobian(residual, shape)])
    best = np.zeros(SHAPES)
    for _ in range(PASSES):
        error, slope = (np.array(value) for value in find(best))
        best -= np.linalg.lstsq(slope, error.ravel())[0]
    return best


def driven(folder: Path, shape: np.ndarray, curve: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and how far the tool is from where it comes to rest [m], by co-simulation."""
    time = np.arange(0.0, LASTS + REST + STEP / 2, STEP)
    moving, motion = np.minimum(time, LASTS), drives()
    rows = [np.array(motion(t, shape)).T.ravel() for t in moving]
    names = [f"{name}{i}" for name in ("q", "qd", "qdd") for i in range(1, 7)]
    path = folder / "swing.csv"
    header = ",".join(["time", *names])
    np.savetxt(path, np.column_stack([time, rows]), delimiter=",", header=header, comments="")
    result = fmpy.simulate_fmu(
        str(folder),
        fmi_type="CoSimulation",
        stop_time=time[-1],
        output_interval=STEP,
        start_values={"trajectory": str(path), "torque_curve": curve},
        output=["tcp.x", "tcp.y", "tcp.z", "rigid.x", "rigid.y", "rigid.z"],
    )
    found = np.array(result.tolist())
    behind = found[:, 0] >= LASTS
    away = found[:, 1:4] - np.mean(found[behind, 1:4], axis=0)
    return found[behind, 0], np.linalg.norm(away[behind], axis=1)


def compare() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return times [s] and ways from rest [m] behind the swing, by its kind and the gears'."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary, "fmu")
        robot = load_robot(shipped_robots()["icme2008"])
        file = build_fmu(robot, Path(temporary, "Robot.fmu"), BuildOptions("native"))
        fmpy.extract(str(file), unzipdir=str(folder))
        shape = best_shape(folder)
        return {
            "quintic": driven(folder, np.zeros(SHAPES), "linear"),
            "shaped": driven(folder, shape, "linear"),
            "quintic, backlash": driven(folder, np.zeros(SHAPES), "backlash"),
            "shaped, backlash": driven(folder, shape, "backlash"),
        }


if __name__ == "__main__":
    ways = compare()
    largest = {name: 1e6 * way.max() for name, (_, way) in ways.items()}
    print(
        f"Behind a swing of {np.degrees(SWING):.0f} degrees in {LASTS} s the tool is"
        f" {largest['quintic']:.0f} um from rest; shaped, {largest['shaped']:.1f} um."
        f" With backlash, {largest['quintic, backlash']:.0f} and {largest['shaped, backlash']:.0f} um."
    )
    figure = go.Figure([go.Scatter(x=t, y=1e6 * y, name=name) for name, (t, y) in ways.items()])
    figure.update_xaxes(title_text="time [s]")
    figure.update_yaxes(title_text="tool from where it comes to rest [um]", type="log")
    FIGURE.parent.mkdir(exist_ok=True)
    figure.write_html(FIGURE, include_plotlyjs="cdn")
    print(f"The tool behind the swing over time is in {FIGURE}.")
