"""Work and precision on the ISO 9283 reference path: this stepper beside SciPy's on the same equation.

    python benchmarks/iso_path.py [--end SECONDS]

One run, one core.  Errors are those of the TCP against tests/reference, made with other engines.
"""

import os

for _library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_library] = "1"

import argparse
import itertools
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp
from scipy.linalg import cho_factor, cho_solve

from elastic_robot.chain import build_chain
from elastic_robot.dynamics import Dynamics
from elastic_robot.kinematics import base_from_tool
from elastic_robot.parameters import Parameters
from elastic_robot.robot import ElasticRobot
from elastic_robot.robot_file import load_robot, shipped_robots
from elastic_robot.statics import equilibrium
from elastic_robot.torque_curves import TORQUE_CURVES
from elastic_robot.trajectory import Trajectory, read_trajectory

REFERENCE = Path(__file__).parent.parent / "tests" / "reference"
ROBOT = load_robot(shipped_robots()["icme2008"])
# Reference files by torque curve.
CURVES = {"linear": "d_iso_nobacklash_10ms", "backlash": "d_iso_backlash_10ms"}

Run = Callable[[np.ndarray], np.ndarray]


def stepper(curve: str, drives: Trajectory, tolerance: float, period: float) -> Run:
    """Return this project's stepper with a tolerance and a communication step [s]."""

    def run(times: np.ndarray) -> np.ndarray:
        robot = ElasticRobot(ROBOT, curve, tolerance=tolerance)
        none = np.zeros(6)
        robot.reset(times[0], drives, none)
        x = [robot.deflection()]
        for start, end in itertools.pairwise(times):
            for k in range(1, round((end - start) / period)):
                robot.step(start + k * period, drives, none)
            robot.step(end, drives, none)
            x.append(robot.deflection())
        return np.array(x)

    return run


def scipy_solver(curve_name: str, drives: Trajectory, method: str, tolerance: float) -> Run:
    """Return a SciPy solver on x'' = M^-1 (-load - S - d x') as a first-order system."""
    chain, parameters = build_chain(ROBOT), Parameters.of(ROBOT)
    dynamics = Dynamics(chain, parameters.gravity)
    curve = TORQUE_CURVES[curve_name].build(parameters)
    m = chain.elastic_count

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        q, qd, qdd = (chain.theta(values) for values in drives.at(np.array([t])))
        theta, speed = q + y[:m] @ chain.selection, qd + y[m:] @ chain.selection
        torque = dynamics.loads(theta, speed, qdd, None)[0]
        torque += curve.torque(y[:m]) + parameters.damping * y[m:]
        return np.append(y[m:], cho_solve(cho_factor(dynamics.mass_matrix(theta[0])), -torque))

    def run(times: np.ndarray) -> np.ndarray:
        q = drives.at(times[:1])[0][0]
        start = np.append(equilibrium(dynamics, curve, q, np.zeros(6)), np.zeros(m))
        span = (times[0], times[-1])
        # rtol of angles of 1e-3 rad; atol a tenth of a permille of that.
        result = solve_ivp(
            rate, span, start, method, t_eval=times, rtol=tolerance, atol=1e-4 * tolerance
        )
        return result.y[:m].T

    return run


def measure(run: Run, drives: Trajectory, expected: np.ndarray) -> tuple[float, float, float]:
    """Return wall time [s] and the largest TCP errors [m], whole path and up to 9 s."""
    times = expected[:, 0]
    start = time.perf_counter()
    x = run(times)
    wall = time.perf_counter() - start
    chain = build_chain(ROBOT)
    data = chain.model.createData()
    theta = chain.theta(drives.at(times)[0], x)
    position = np.array([base_from_tool(chain, data, row).translation.copy() for row in theta])
    error = np.abs(position - expected[:, 1:4]).max(axis=1)
    return wall, float(error.max()), float(error[times <= 9.0].max())


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--end", type=float, default=22.8, help="stop here [s]")
    options = parser.parse_args()
    drives = read_trajectory(REFERENCE / "iso_path_joints.npz", 6)
    console = Console()
    for curve, file in CURVES.items():
        expected = np.loadtxt(REFERENCE / f"{file}.csv", delimiter=",", skiprows=1)
        expected = expected[expected[:, 0] <= options.end + 1e-9]
        table = Table("solver", "wall [s]", "TCP error [m]", "up to 9 s [m]", "ratio", title=curve)
        entries: list[tuple[str, Run]] = [
            (f"this stepper, tolerance {tolerance:g} m", stepper(curve, drives, tolerance, 0.01))
            for tolerance in (1e-5, 1e-6, 1e-7, 1e-8)
        ]
        entries.append(("the same, 1e-06 m, 5 ms apart", stepper(curve, drives, 1e-6, 0.005)))
        entries += [
            (f"SciPy {method}, rtol {rtol:g}", scipy_solver(curve, drives, method, rtol))
            for method, rtol in (("DOP853", 1e-5), ("Radau", 1e-5), ("LSODA", 1e-6))
        ]
        base = 0.0
        for name, run in entries:
            wall, whole, early = measure(run, drives, expected)
            base = wall if name.startswith("this stepper, tolerance 1e-06") else base
            ratio = f"{wall / base:.2f}" if base else ""
            table.add_row(name, f"{wall:.2f}", f"{whole:.1e}", f"{early:.1e}", ratio)
            print(f"{curve}: {name}: done in {wall:.1f} s", flush=True)
        console.print(table)


if __name__ == "__main__":
    main()
